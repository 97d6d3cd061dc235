"""The base class of tasks: an episode of children in a house."""

from __future__ import annotations

import dataclasses
import functools
import math
import numbers
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from dm_env import specs

from caregiver_mj.caregivers.caregiver import Caregiver, Truth, starting_tables
from caregiver_mj.children.child_group import ChildGroup, ChildrenLike
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS, Random, RandomStream, random_state, start_cells
from caregiver_mj.children.walk import WALKING_SPEED, check_speed, novice_timestep
from caregiver_mj.errors import CaregiverError, UnknownOptionError, check_kind, check_number
from caregiver_mj.house.children import Children
from caregiver_mj.house.observer import Observer, TaskInfo
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.rendering import control
from caregiver_mj.house.sensing import Sensing
from caregiver_mj.house.things import Candles, Things, watch_candle
from caregiver_mj.interventions.verb import Intervention
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan, check_starts
from caregiver_mj.plans.hazards import HazardKind, State
from caregiver_mj.plans.visibility import Sight
from caregiver_mj.recording.ledger import Contacts, Ledger
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.embodiments import find_embodiment

CONTROL_TIMESTEP = 0.02  # s; a prototype's grasps held at 50 Hz as well as at 100 Hz
_LOWEST, _HIGHEST = 0.45, 0.75  # m; heights of tables, from a coffee table to a dining table
_CANDLE_OFFSET = 0.02  # m; greatest initial offset of a candle from the table's centre, in x and in y


@dataclasses.dataclass(frozen=True)
class Observed:
    """Description of a key of observations."""

    shape: str  #: shape in words, such as "(candles, 3)"
    unit: str  #: units
    meaning: str  #: meaning, for the documentation
    within: str = ""  #: name of its bounds in `envs.house`; empty for wide ones
    asked: bool = False  #: whether it is only observed on request, or if the house has such things


_OF_EACH_CHILD = "(3,), of several children (children, 3)"
OBSERVED = {
    "clock": Observed("()", "timesteps", "novice timesteps since the start, with fraction", "clock"),
    "toddler_position": Observed(_OF_EACH_CHILD, "m, m, rad", "x, y and yaw of each child", "pose"),
    "toddler_velocity": Observed(_OF_EACH_CHILD, "m/s, m/s, rad/s", "their rates", "rates"),
    "toddler_seen": Observed(
        "(children,)", "", "1 for a child that is seen or felt; 0 for others, whose values are all 0", "share", True
    ),
    "cell_seen": Observed(
        "(free cells, 5)",
        "",
        "1 if a child would be seen: in a cell's middle, and .3 of it to each side",
        "share",
        True,
    ),
    "candle_position": Observed("(candles, 3)", "m", "x, y and height of each candle's foot", "place"),
    "candle_orientation": Observed("(candles, 4)", "", "quaternion (w, x, y, z) of each candle", "quaternion"),
    "battery_position": Observed("(batteries, 3)", "m", "x, y and height of each battery's foot", "place", True),
    "gate_position": Observed("(gates,)", "rad", "opening angle of each gate; 0 is closed", "gate", True),
    "base_position": Observed("(3,)", "m, m, rad", "x, y and yaw of the robot's base", "pose"),
    "base_velocity": Observed("(3,)", "m/s, m/s, rad/s", "their rates", "rates"),
    "arm_position": Observed("(joints,)", "rad", "the arm's joints from the shoulder on", "arm"),
    "arm_velocity": Observed("(joints,)", "rad/s", "their rates", "arm speed"),
    "finger_position": Observed("(2,)", "m", "distance of each finger from the middle", "fingers"),
    "table_height": Observed("(tables,)", "m", "height of each table, if requested", "height", asked=True),
}


@dataclasses.dataclass(frozen=True)
class Placement:
    """Places of tables and candles."""

    candle_offset: float = _CANDLE_OFFSET  #: m; greatest initial offset of a candle from a table's centre, in x and y
    table_offset: float = 0.0  #: m; greatest offset of a table from its place in the plan, drawn once
    #: m; height of all tables, or a range from which each height is drawn once. Observations then include the heights.
    #: None for the height of the model
    table_height: float | Sequence[float] | None = None

    def check(self, plan: FloorPlan) -> None:
        """Raise CaregiverError if an offset is out of range."""
        room = max(0.0, plan.cell_size / 2 - layout.TABLE_HALF_SIZE)  # m; room of a table in its cell
        check_number("candle_offset, in metres,", self.candle_offset, 0, layout.TABLE_HALF_SIZE)
        check_number("table_offset, in metres,", self.table_offset, 0, room)


class CareTask(control.Task):
    """An episode in a house: children walk about, a robot acts. Tasks add a goal and a reward.

    dm_control passes one object through the whole episode, hence the many attributes. Tasks, policies and tests may
    read them.

    Attributes:
        plan: The floor plan.
        random: Source of all randomness.
        family: The specification of the children.
        children: The children in the house.
        candles: Keeps track of the candles.
        things: Keeps track of the small things on the floor.
        ledger: Counts of this episode, a batch of one, up to the last completed novice timestep; `damage` includes the
            present one. The episode's end completes one that it cuts short.
        contacts: Counts of the robot's contacts with the children.
        caregiver: Caregiver that may prepare the house before the children come in, as in the grid. A
            `CaregiverPolicy` sets its own; None for no caregiver.
        observer: Makes the observations of the house.
        caregiver_seed: Seed of this episode for a random caregiver.
        embodiment: The robot.
        has_robot: Whether the robot is in the house.
        control_timestep: Time between actions, s.
        novice_timestep: Length of a novice timestep, s.
        child_speed: Speed of walking children, m/s.
    """

    # Properties of a task.
    needs: HazardKind | None = None  # kind of hazard that the house must have
    needs_robot = False
    time_limit: float | None = None  # s; length of an episode, None for 200 novice timesteps
    observed: ClassVar[Mapping[str, Observed]] = OBSERVED  # keys of its observations
    scorer: Callable[[int, Mapping[str, Any]], np.ndarray] | None = None  # set by `caregiver_mj.load`

    def __init__(
        self,
        plan: FloorPlan,
        family: ChildrenLike | Sequence[ChildrenLike],
        random: Random = None,
        robot: bool = True,
        embodiment: Embodiment | str | None = None,
        control_timestep: float = CONTROL_TIMESTEP,
        *,
        compliant_children: bool = False,
        child_speed: float = WALKING_SPEED,
        sensing: Sensing | Mapping[str, Any] | None = None,
        sight: Sight | str = "all",
        **placement: Any,
    ):
        """Prepare the episodes.

        Args:
            plan: The house.
            family: The children, as `ChildGroup.of` takes them.
            random: Source of all randomness, or its seed, as `random_state` takes it.
            robot: Whether there is a robot in the house.
            embodiment: The robot, or its name; None for the default one.
            control_timestep: Time between actions, s. A `CaregiverPolicy` requires at most 0.06 s; other policies may
                have up to a child's move.
            compliant_children: Whether children yield to a push, so that forces on them are realistic; else they are
                kinematic.
            child_speed: Speed of walking children, m/s, 0.1 to 1; a novice timestep is inversely proportional.
            sensing: Errors of observations, as `Sensing.of` takes them; None for exact ones.
            sight: Children in observations: `all`, or those in view, as `Sight.of` takes it.
            placement: Fields of `Placement`.

        Raises:
            UnknownOptionError: `Placement` has no such field.
            CaregiverError: The robot is unknown, the house is unsuitable for the task or the robot, a number is out of
                range, or a flag is no bool.
        """
        check_kind("robot", robot, bool)
        check_kind("compliant_children", compliant_children, bool)
        self.child_speed = check_speed(child_speed)
        _check_timestep(control_timestep, plan, child_speed)
        try:
            placed = Placement(**placement)
        except TypeError as error:
            raise UnknownOptionError(f"task_kwargs: {str(error).partition('() ')[2]}") from None
        placed.check(plan)
        self.reseed(random)
        self.plan, self.family = plan, ChildGroup.of(family)
        self.has_robot, self.embodiment = robot, find_embodiment(embodiment)
        self.control_timestep = control_timestep
        self.novice_timestep = novice_timestep(control_timestep, plan.cell_size, child_speed)
        self.children = Children(plan, self.family.make(plan), self.novice_timestep, compliant_children, child_speed)
        rectangles = layout.Layout(plan).tables.copy()
        if offset := placed.table_offset:
            rectangles[:, :2] += self.random.uniform(-offset, offset, (len(plan.tables), 2))
        self._shows_heights = placed.table_height is not None
        self.candles = Candles(rectangles, _draw_heights(placed.table_height, len(plan.tables), self.random))
        self.things = Things(plan)
        tables = np.column_stack([rectangles, self.candles.table_heights])
        self.observer = Observer(
            plan, len(self.children), tables, control_timestep, has_robot=robot, sensing=sensing, sight=sight
        )
        self.caregiver: Caregiver | None = None
        self.caregiver_seed = 0
        self._candle_offset = placed.candle_offset
        self._steps_a_move = round(self.novice_timestep / control_timestep)
        self._control_steps = 0
        if robot:
            check_starts(plan, len(self.children))
        self._check_house()

    def _check_house(self) -> None:
        """Raise CaregiverError unless the house suits the task and its robot."""

    @functools.cached_property
    def length(self) -> float:
        """Control steps of an episode: up to the first at or after the time limit, which may be infinite."""
        limit = math.inf if self.time_limit is None else self.time_limit
        return float(np.ceil(round(limit / self.control_timestep, 6)))  # 0.3 / 0.1 is 3

    @property
    def sight(self) -> Sight:
        """The sight of observations."""
        return self.observer.sight

    @property
    def sensing(self) -> Sensing:
        """The errors, gaps and delay of observations."""
        return self.observer.sensing

    @property
    def table_positions(self) -> np.ndarray:
        """Centres of the tables, (tables, 2), m."""
        return self.candles.table_rectangles[:, :2]

    @property
    def table_heights(self) -> np.ndarray:
        """Heights of the tables' tops, (tables,), m."""
        return self.candles.table_heights

    def reseed(self, random: Random) -> None:
        """Seed the next episode."""
        self.random = random_state(random)

    # -- dm_control's interface ------------------------------------------------------------------

    def initialize_episode(self, physics: Physics) -> None:
        streams = RandomStream.draw_group(self.random, len(self.children))
        self.caregiver_seed = streams[0].caregiver_seed
        starts = np.stack([stream.start for stream in streams])[None]
        landings = len(self.plan.landings)
        begins = start_cells(len(self.plan.starts) - landings, landings, starts)
        cells, caregiver = (self.plan.starts[cells] for cells in begins)

        def start(child: int) -> None:
            yaw = self.random.uniform(-np.pi, np.pi)
            self.children.start(child, streams[child], int(cells[0, child]), yaw, physics)

        start(0)
        if self.caregiver:
            self.caregiver.reset(1, [self.caregiver_seed], len(self.children))
        tables = starting_tables(self.plan, self.caregiver)[0].tolist()
        for i, table in enumerate(tables):
            offset = self.random.uniform(-self._candle_offset, self._candle_offset, size=2)
            place = self.table_positions[table] + offset
            physics.set_candle(i, np.array([*place, self.table_heights[table]]), self.random.uniform(-np.pi, np.pi))
        if self.has_robot:
            cell = self.plan.caregiver_cells[int(caregiver[0])]
            physics.set_robot(np.array([*self.plan.position(cell), self.random.uniform(-np.pi, np.pi)]))
        for child in range(1, len(self.children)):  # last, so that all else is independent of the number of children
            start(child)
        physics.set_gates()
        self.things.reset(physics, self.random)
        self.candles.reset(tables)
        self.children.state[:] = State.AS_PLANNED
        self._latched: list[bool] = []
        self.ledger, self.contacts = Ledger(self.plan, cells, EPISODE_TIMESTEPS), Contacts()
        self._control_steps = 0
        self.observer.reset(physics, self.caregiver_seed)

    def action_spec(self, physics: Physics) -> specs.BoundedArray:
        return physics.action_spec()

    def before_step(self, action: np.ndarray, physics: Physics) -> None:
        physics.set_action(action, self.control_timestep)
        if self._control_steps % self._steps_a_move == 0:
            self.children.begin(self.timestep, self.random, physics)
        self.children.step(self.control_timestep, physics)
        self.things.go_along(physics)

    def after_step(self, physics: Physics) -> None:
        if physics.touches:
            self.contacts.take_in(physics.touches, physics.timestep(), physics.time(), self.children.shut_gates)
        self.children.take_in(physics, functools.partial(self.candles.are_on, physics))
        if self.has_robot:
            watch_candle(physics, self.control_timestep, self.contacts)
        if self.plan.mouths:
            latched = physics.gates_latched()
            if latched != self._latched:
                self._latched = latched
                gates = slice(len(self.plan.landings), len(self.plan.stairwells))
                self.children.state[gates] = np.where(latched, State.SHUT, State.AS_PLANNED)
        if self.plan.floor_cells:
            self.things.take_in(physics, self.children)
        self._control_steps += 1
        self.observer.take_in(physics, self._control_steps)
        if self._control_steps % self._steps_a_move == 0 or self._control_steps == self.length:
            self.ledger.attend(self.observer.seen & self.has_robot)
            self.ledger.book(*(np.array([values]) for values in zip(*self.children.end(), strict=True)))
            self.ledger.drop(self.candles.count_fallen(physics))

    def get_observation(self, physics: Physics) -> dict[str, np.ndarray]:
        """Return the observation, which suffices for a caregiver; every key is in `observed`."""
        observation = {"clock": np.array(self._control_steps / self._steps_a_move)}
        observation |= self.observer.observe(physics, self._control_steps)
        if self._shows_heights and self.plan.tables:
            observation["table_height"] = self.table_heights.copy()
        return observation

    def get_termination(self, physics: Physics) -> float | None:
        return None

    def orders(self, observation: Mapping[str, np.ndarray]) -> Intervention | None:
        """Return the order in an observation; None, the default, leaves the choice to the caregiver."""
        return None

    @property
    def info(self) -> TaskInfo:
        """The information for policies beside observations."""
        return TaskInfo(
            plan=self.plan,
            family=self.family,
            embodiment=self.embodiment if self.has_robot else None,
            sensing=self.sensing,
            sight=self.sight,
            novice_timestep=self.novice_timestep,
            child_speed=self.child_speed,
            table_heights=self.table_heights.copy() if self._shows_heights and self.plan.tables else None,
            orders=None if type(self).orders is CareTask.orders else self.orders,
            caregiver_seed=self.caregiver_seed,
            starting_tables=tuple(self.candles.starting_tables),
            truth=self.truth,
        )

    # -- For privileged caregivers only -----------------------------------------------------------

    def truth(self) -> Truth:
        """Return the hidden state after the children's present moves, a batch of one."""
        goals, behaviours = zip(*((child.next_goal, child.behaviour) for child in self.children), strict=True)
        return Truth(np.array([goals]), np.stack([behaviour.epsilons(1) for behaviour in behaviours], axis=1))

    # -- Results ---------------------------------------------------------------------------------

    @property
    def timestep(self) -> int:
        """Novice timesteps completed in this episode."""
        return self.ledger.timestep

    @property
    def damage(self) -> float:
        """Damage to the children so far, including the present novice timestep, which the ledger lacks."""
        return float(self.ledger.damage[0]) + sum(child.move.harm for child in self.children)

    @property
    def strikes(self) -> int:
        """Strikes of children by the robot so far."""
        return int(self.contacts.strikes)

    def outcome(self) -> dict[str, Any]:
        """Return the measures of the episode so far, by column of `EpisodeRecord`.

        An environment of `caregiver_mj.load` adds its `score`, see `caregiver_mj.experiments.score`; the first one in a
        house takes up to a second.

        Raises:
            CaregiverError: No episode has begun.
        """
        if not hasattr(self, "ledger"):
            raise CaregiverError("no episode has begun: call env.reset() first")
        measured = self.ledger.outcome() | self.contacts.outcome()
        return measured | ({"score": self.scorer(self.timestep, measured).item()} if self.scorer else {})

    def note_interventions(self, begun: int, done: int, left: Mapping[int, State] | None = None) -> None:
        """Count new interventions of the caregiver.

        Args:
            begun: Number of interventions begun.
            done: Number of interventions completed.
            left: Claimed states of hazards, by number. Measured states, of gates and small things, ignore it.
        """
        self.ledger.intervene(begun, done)
        for hazard, state in (left or {}).items():
            if hazard < len(self.plan.landings):
                self.children.state[hazard] = state

    def is_standing(self, physics: Physics, candle: int) -> bool:
        """Return whether a candle is upright and at least as high as a table."""
        return bool(self.candles.standing(physics)[candle])


def _check_timestep(seconds: float, plan: FloorPlan, child_speed: float) -> None:
    """Raise CaregiverError for an invalid control timestep; dm_control checks that physics steps divide it."""
    move = plan.cell_size / child_speed
    if not (isinstance(seconds, numbers.Real) and 0 < seconds <= move):
        raise CaregiverError(
            f"control_timestep must be positive and no longer than a child's move, {move:.3g} s, got {seconds!r}"
        )


def _draw_heights(height: float | Sequence[float] | None, tables: int, random: np.random.RandomState) -> np.ndarray:
    """Return the heights of tables, (tables,), m; raise CaregiverError unless they are within the arms' reach."""
    if height is None:
        return np.full(tables, layout.TABLE_HEIGHT)
    heights: list[Any] = [height] if isinstance(height, (float, numbers.Real, str)) else list(height)
    good = all(isinstance(one, numbers.Real) and _LOWEST <= float(one) <= _HIGHEST for one in heights)
    if not good or len(heights) not in (1, 2) or heights[0] > heights[-1]:
        raise CaregiverError(
            f"table_height must be a height in {_LOWEST:g} to {_HIGHEST:g} m, or the lowest and the highest, "
            f"got {height!r}"
        )
    lowest, highest = heights[0], heights[-1]
    return np.full(tables, float(lowest)) if len(heights) == 1 else random.uniform(lowest, highest, tables)

"""What all tasks share: an episode of children in a house."""

from __future__ import annotations

import collections
import dataclasses
import numbers
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from dm_env import specs

from caregiver_mj.caregivers.caregiver import Caregiver, starting_tables
from caregiver_mj.caregivers.privileged import Truth
from caregiver_mj.children.child_group import ChildGroup, ChildrenLike
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS, Random, RandomStream, random_state, start_cells
from caregiver_mj.children.walk import WALKING_SPEED, novice_timestep
from caregiver_mj.errors import CaregiverError, UnknownOptionError, check_kind, check_number
from caregiver_mj.house.candles import Candles, watch_candle
from caregiver_mj.house.children import Children
from caregiver_mj.house.observer import Observer
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.rendering import control
from caregiver_mj.house.sensing import Sensing
from caregiver_mj.house.task_info import TaskInfo
from caregiver_mj.house.things import Things
from caregiver_mj.interventions.verb import Intervention
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan, check_starts
from caregiver_mj.plans.hazards import HazardKind, State
from caregiver_mj.plans.visibility import Sight
from caregiver_mj.recording.contacts import Contacts
from caregiver_mj.recording.ledger import Ledger
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.embodiments import find_embodiment

CONTROL_TIMESTEP = 0.02  # seconds; a prototype's grasps held at 50 Hz as well as at 100 Hz
_LOWEST, _HIGHEST = 0.45, 0.75  # metres, of tables; from a coffee table to a dining table
_CANDLE_OFFSET = 0.02  # metres off the table's centre at the start, at most, in x and in y


@dataclasses.dataclass(frozen=True)
class Observed:
    """What stands under a key of an observation."""

    shape: str  #: its shape in words, such as "(candles, 3)"
    unit: str  #: its units
    meaning: str  #: what it is
    within: str = ""  #: its bounds, by a name of `envs.bounds`; empty for wide ones
    asked: bool = False  #: whether it is only shown if that is asked for, or if there is such a thing in the house


_OF_EACH_CHILD = "(3,), of several children (children, 3)"
OBSERVED = {
    "clock": Observed("()", "timesteps", "novice timesteps since the start, with fraction", "clock"),
    "toddler_position": Observed(_OF_EACH_CHILD, "m, m, rad", "x, y and yaw of each child", "pose"),
    "toddler_velocity": Observed(_OF_EACH_CHILD, "m/s, m/s, rad/s", "their rates", "rates"),
    "toddler_seen": Observed(
        "(children,)", "", "1 for a child that is seen, or felt, else 0, and all else of it 0, too", "share", True
    ),
    "cell_seen": Observed(
        "(free cells, 5)", "", "1 where a child would be seen: in its middle, and .3 of it to each side", "share", True
    ),
    "candle_position": Observed("(candles, 3)", "m", "x, y and height of each candle's foot", "place"),
    "candle_orientation": Observed("(candles, 4)", "", "of each candle, a quaternion (w, x, y, z)", "quaternion"),
    "battery_position": Observed("(batteries, 3)", "m", "x, y and height of each battery's foot", "place", True),
    "gate_position": Observed("(gates,)", "rad", "how far each gate stands open; 0 is closed", "gate", True),
    "base_position": Observed("(3,)", "m, m, rad", "x, y and yaw of the robot's base", "pose"),
    "base_velocity": Observed("(3,)", "m/s, m/s, rad/s", "their rates", "rates"),
    "arm_position": Observed("(joints,)", "rad", "the arm's joints from the shoulder on", "arm"),
    "arm_velocity": Observed("(joints,)", "rad/s", "their rates", "arm speed"),
    "finger_position": Observed("(2,)", "m", "how far each finger stands off the middle", "fingers"),
    "table_height": Observed("(tables,)", "m", "how high each table is, if that is asked for", "height", asked=True),
}


@dataclasses.dataclass(frozen=True)
class Placement:
    """Where tables stand and candles start."""

    candle_offset: float = (
        _CANDLE_OFFSET  #: how far off a table's centre a candle starts at most, in x and in y, metres
    )
    table_offset: float = 0.0  #: how far off its place in the plan a table stands at most; also drawn once
    #: how high all tables are, metres; or the lowest and the highest that one may be, and each is drawn in between,
    #: once. The observation then has the heights. None for those of the table's model
    table_height: float | Sequence[float] | None = None

    def check(self, plan: FloorPlan) -> None:
        """Raise CaregiverError if an offset is out of range."""
        room = max(0.0, plan.cell_size / 2 - layout.TABLE_HALF_SIZE)  # of a table in its cell
        check_number("candle_offset, in metres,", self.candle_offset, 0, layout.TABLE_HALF_SIZE)
        check_number("table_offset, in metres,", self.table_offset, 0, room)


class CareTask(control.Task):
    """An episode in a house: children walk about, a robot acts. Tasks add a goal and a reward.

    It has more attributes than most classes because dm_control hands one object through the whole episode: what is
    public below is for tasks, policies and tests to read.

    Attributes:
        plan: The floor plan.
        random: Source of all randomness.
        family: Who the children are.
        children: The children in the house.
        candles: What looks after the candles.
        things: What looks after the small things on the floor.
        ledger: What has happened in this episode, a batch of one, up to the last novice timestep that is over; `damage`
            has that of the present one, too.
        contacts: What the robot has done to the children in it.
        caregiver: Who may make the house safe before the children come in, as in the grid; a `CaregiverPolicy` enters
            its own one here. None if nobody does.
        observer: What observations show of the house.
        caregiver_seed: This episode's seed for a caregiver that draws lots.
        embodiment: Which robot it is about.
        has_robot: Whether that is in the house.
        control_timestep: Seconds between actions.
        novice_timestep: Seconds of a novice timestep.
    """

    # What a task says of itself.
    needs: HazardKind | None = None  # what must be in the house
    needs_robot = False
    time_limit: float | None = None  # seconds of an episode, if not 200 novice timesteps
    observed: ClassVar[Mapping[str, Observed]] = OBSERVED  # what stands in its observations
    scorer: Callable[[int, Mapping[str, Any]], np.ndarray] | None = None  # of the score; `caregiver_mj.load` enters it

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
        sensing: Sensing | Mapping[str, Any] | None = None,
        sight: Sight | str = "all",
        **placement: Any,
    ):
        """Prepare the episodes.

        Args:
            plan: The house.
            family: The children, as `ChildGroup.of` takes them.
            random: Source of all randomness, or a seed for one, as `random_state` takes it.
            robot: Whether there is a robot in the house.
            embodiment: Which one, or its name; the default one if None.
            control_timestep: Seconds between actions. A `CaregiverPolicy` wants no more than 0.06 s; actions of your
                own may be farther apart, up to a child's move.
            compliant_children: Whether the children give way to a push, so that forces on them mean something; else
                they are kinematic.
            sensing: How well observations show what there is, as `Sensing.of` takes it; None for exactly.
            sight: Which children they show: `all`, or those that are seen, as `Sight.of` takes it.
            placement: Fields of `Placement`.

        Raises:
            UnknownOptionError: It has no such field.
            CaregiverError: There is no robot of that name, the house is not fit for the task and its robot, a timestep,
                an offset, a height or a number of the sensing is out of range, or a bool is none.
        """
        check_kind("robot", robot, bool)
        check_kind("compliant_children", compliant_children, bool)
        _check_timestep(control_timestep, plan)
        try:
            placed = Placement(**placement)
        except TypeError as error:
            raise UnknownOptionError(f"task_kwargs: {str(error).partition('() ')[2]}") from None
        placed.check(plan)
        self.reseed(random)
        self.plan, self.family = plan, ChildGroup.of(family)
        self.has_robot, self.embodiment = robot, find_embodiment(embodiment)
        self.control_timestep = control_timestep
        self.novice_timestep = novice_timestep(control_timestep, plan.cell_size)
        self.children = Children(plan, self.family.make(plan), self.novice_timestep, compliant_children)
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
        """Raise CaregiverError unless the house is fit for the task and its robot."""

    @property
    def sight(self) -> Sight:
        """What observations show children by."""
        return self.observer.sight

    @property
    def sensing(self) -> Sensing:
        """The errors, gaps and delay of observations."""
        return self.observer.sensing

    @property
    def table_positions(self) -> np.ndarray:
        """Where the tables' centres are, (tables, 2), metres."""
        return self.candles.table_rectangles[:, :2]

    @property
    def table_heights(self) -> np.ndarray:
        """How high their tops are, (tables,), metres."""
        return self.candles.table_heights

    def reseed(self, random: Random) -> None:
        """Make the next episode that of a seed, whatever ran before."""
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
        for child in range(1, len(self.children)):  # last, so that all else is as it is for an only child
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
        self.children.take_in(physics, self.candles)
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
        if self._control_steps % self._steps_a_move == 0:
            self.ledger.attend(self.observer.seen & self.has_robot)
            self.ledger.book(*(np.array([values]) for values in zip(*self.children.end(), strict=True)))
            self.ledger.drop(self.candles.count_fallen(physics))

    def get_observation(self, physics: Physics) -> collections.OrderedDict[str, np.ndarray]:
        """Return what there is to see, enough to run the caregiver on; every key is in `observed`."""
        observation = collections.OrderedDict()
        observation["clock"] = np.array(self._control_steps / self._steps_a_move)
        observation.update(self.observer.observe(physics, self._control_steps))
        if self._shows_heights and self.plan.tables:
            observation["table_height"] = self.table_heights.copy()
        return observation

    def get_termination(self, physics: Physics) -> float | None:
        return None

    def orders(self, observation: Mapping[str, np.ndarray]) -> Intervention | None:
        """Return what an observation asks for. A task that leaves that to the caregiver does not override this."""
        return None

    @property
    def info(self) -> TaskInfo:
        """What a policy may know beside observations."""
        return TaskInfo(
            plan=self.plan,
            family=self.family,
            embodiment=self.embodiment if self.has_robot else None,
            sensing=self.sensing,
            sight=self.sight,
            novice_timestep=self.novice_timestep,
            table_heights=self.table_heights.copy() if self._shows_heights and self.plan.tables else None,
            orders=None if type(self).orders is CareTask.orders else self.orders,
            caregiver_seed=self.caregiver_seed,
            starting_tables=tuple(self.candles.starting_tables),
            truth=self.truth,
        )

    # -- For bounds only --------------------------------------------------------------------------

    def truth(self) -> Truth:
        """Return what no caregiver can see, of a batch of one, as it will be after the children's present moves."""
        goals, behaviours = zip(*((child.next_goal, child.behaviour) for child in self.children), strict=True)
        return Truth(np.array([goals]), np.stack([behaviour.epsilons(1) for behaviour in behaviours], axis=1))

    # -- Results ---------------------------------------------------------------------------------

    @property
    def timestep(self) -> int:
        """Novice timesteps completed in this episode."""
        return self.ledger.timestep

    @property
    def damage(self) -> float:
        """All damage to the children so far, with that of the present novice timestep, which is not booked yet."""
        return float(self.ledger.damage[0]) + sum(child.move.harm for child in self.children)

    @property
    def strikes(self) -> int:
        """How often the robot has struck a child so far."""
        return int(self.contacts.strikes)

    def outcome(self) -> dict[str, Any]:
        """Return what has been measured in the episode so far, named as the columns of `EpisodeRecord`.

        In an environment of `caregiver_mj.load` there is also its `score`, see `caregiver_mj.experiments.score`; the
        first one in a house takes up to a second.

        Raises:
            CaregiverError: None has begun.
        """
        if not hasattr(self, "ledger"):
            raise CaregiverError("no episode has begun: call env.reset() first")
        measured = self.ledger.outcome() | self.contacts.outcome()
        return measured | ({"score": self.scorer(self.timestep, measured).item()} if self.scorer else {})

    def note_interventions(self, begun: int, done: int, left: Mapping[int, State] | None = None) -> None:
        """Take note of how many interventions the caregiver has begun now, and how many it has completed.

        Args:
            begun: How many it has begun.
            done: How many it has completed.
            left: What it claims has become of hazards by them so far, by their numbers. What can be measured here,
                whether a gate has latched and a small thing is off the floor, does not depend on it.
        """
        self.ledger.intervene(begun, done)
        for hazard, state in (left or {}).items():
            if hazard < len(self.plan.landings):
                self.children.state[hazard] = state

    def is_standing(self, physics: Physics, candle: int) -> bool:
        """Return whether a candle is upright, and no lower than a table."""
        return bool(self.candles.standing(physics)[candle])


def _check_timestep(seconds: float, plan: FloorPlan) -> None:
    """Raise CaregiverError unless there can be actions so often. Whether physics steps fit in, dm_control says."""
    move = plan.cell_size / WALKING_SPEED
    if not (isinstance(seconds, numbers.Real) and 0 < seconds <= move):
        raise CaregiverError(
            f"control_timestep must be positive and no longer than a child's move, {move:.3g} s, got {seconds!r}"
        )


def _draw_heights(height: float | Sequence[float] | None, tables: int, random: np.random.RandomState) -> np.ndarray:
    """Return how high tables are, (tables,), metres; raise CaregiverError unless that is within the arms' reach."""
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

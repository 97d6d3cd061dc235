"""The scripted caregiver as a policy for the tasks: from observations to actions.

It sees the world through the task's observation only: where the children, the candles and the robot are. What the
children did it infers from how they moved; what to do it asks a `Caregiver`; how, it leaves to the robot's routines.
Only a `PrivilegedCaregiver` knows more than the observation: the task gives it the hidden state.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import dm_env
import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver, starting_tables
from caregiver_mj.caregivers.instructed import InstructedCaregiver
from caregiver_mj.caregivers.percept import Assessment, Percept
from caregiver_mj.caregivers.privileged import PrivilegedCaregiver
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.errors import CaregiverError, check_kind
from caregiver_mj.house.rendering import control
from caregiver_mj.house.scene import build_house
from caregiver_mj.house.sensing import Sensing
from caregiver_mj.house.task_info import TaskInfo
from caregiver_mj.interventions.verb import Intervention
from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import WALKABLE
from caregiver_mj.plans.floor_plan import FloorPlan, check_house
from caregiver_mj.policy.estimates import Senses, base_jumps, hand_error
from caregiver_mj.policy.executive import Executive
from caregiver_mj.policy.pace import robot_pace
from caregiver_mj.policy.perception import Perception
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.governor import govern
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.planning_scene import PlanningScene
from caregiver_mj.robot.retrieval import RetrievalPlanner

# Seconds between actions beyond which the robot no longer keeps what it promises: in 1,020 s of three houses with a
# child that heads for it half the time, none struck and no candle dropped at 0.06 s, three strikes at 0.08, four drops
# at 0.15, 55 strikes at 0.2.
LONGEST_TIMESTEP = 0.06


class CaregiverPolicy:
    """The scripted caregiver. Call it with a time step to get an action.

    From the next reset on, the environment's house is prepared for its children as the caregiver wants it.

    Attributes:
        plan: The house.
        caregiver: Who decides.
        robot: The robot's references, for displays.
        executive: Carries out the interventions; for displays.
    """

    def __init__(
        self,
        env: control.Environment,
        caregiver: str | Caregiver = "expected-danger",
        seed: int = 0,
        sensing: Sensing | Mapping[str, Any] | None = None,
    ):
        """Prepare a caregiver for a task.

        Args:
            env: An environment of this package, with the robot in it.
            caregiver: Name of a caregiver, or one made for the environment's house.
            seed: Seed of the caregiver; what it draws in an episode depends on the episode's seed as well.
            sensing: How well observations show what there is, by which it takes them, as `Sensing.of` takes it; None
                for what the task says.

        Raises:
            CaregiverError: There is no robot in the environment, or no caregiver of that name, or it was made for
                another house, or actions are too far apart for the robot to be controlled, or the sensing is too bad
                to take candles.
        """
        task: Any = getattr(env, "task", None)
        if not hasattr(task, "info"):
            raise CaregiverError(
                "env must be an environment of `caregiver_mj.load`, as is `env.unwrapped.dm_env` of "
                f"Gymnasium's, got {type(env).__name__}"
            )
        info: TaskInfo = task.info
        embodiment = info.embodiment
        if embodiment is None:
            raise CaregiverError("env must have a robot for a caregiver to act with, got none")
        if env.control_timestep() > LONGEST_TIMESTEP + 1e-9:
            raise CaregiverError(
                f"control_timestep must be at most {LONGEST_TIMESTEP} s for a caregiver's policy to control the robot, "
                f"got {env.control_timestep():.3g}"
            )
        self.plan: FloorPlan = info.plan
        self.caregiver = _caregiver(caregiver, info, seed)
        # To be asked for its `info` when an episode begins, and told who is in charge and what has been done.
        self._task = task
        truth = info.truth if isinstance(self.caregiver, PrivilegedCaregiver) else None
        self._timestep, self._has_begun = env.control_timestep(), False
        spec = env.observation_spec()
        self._shapes = {key: array.shape for key, array in spec.items()} if "base_position" in spec else {}
        self._sensing = info.sensing if sensing is None else Sensing.of(sensing)
        delay = self._sensing.delay_steps(self._timestep) * self._timestep
        things = layout.things(self.plan)
        error = hand_error(self._sensing, embodiment, things) if things or self.plan.floor_cells else 0.0
        self.robot = RobotMotion(embodiment, self._timestep, delay, error, base_jumps(self._sensing.base))
        navigator = Navigator(self.plan, embodiment, self.caregiver.yields)
        self._clearance = navigator.clearance
        haste = info.child_speed / WALKING_SPEED
        self._senses = Senses(self._sensing, self.robot, self._timestep, things, haste)
        self._perception = Perception(
            self.plan,
            self._sensing.is_exact,
            self._senses.age,
            self._sensing.candle.noise,
            self._senses.unsure,
            info.sight,
            functools.partial(env.physics.frames, info.sight.is_full),
            haste,
        )
        if isinstance(self.caregiver, PrivilegedCaregiver) and not info.sight.is_full:
            raise CaregiverError(
                f"sight must be all with a caregiver that needs privileged information, got {info.sight}"
            )
        self.caregiver.sight = info.sight
        self._retrievals = RetrievalPlanner(navigator, functools.partial(_make_scene, self.plan, embodiment))
        self.caregiver.pace = robot_pace(navigator, info.novice_timestep, self._timestep, info.child_speed)
        self.executive = Executive(
            self.caregiver, self._perception, navigator, self._retrievals, info.novice_timestep, truth
        )
        # As it will be seen: what takes so long must not wait for the first observation.
        self._perception.table_heights = info.table_heights
        self._prepare_retrievals()
        task.caregiver = self.caregiver  # last: where one cannot be made, the house is not prepared for it

    def __call__(self, timestep: dm_env.TimeStep) -> np.ndarray:
        """Answer an observation with an action; see `see` for errors."""
        self.see(timestep)
        return self.act()

    def see(self, timestep: dm_env.TimeStep) -> bool:
        """Take an observation in, which is the first half of answering it.

        Returns:
            Whether it has just become clear where all children are heading: once a novice timestep.

        Raises:
            CaregiverError: It is no time step, or the observation is flat; the caregiver needs its keys. Or it is of
                another house, or the house has not been prepared as the caregiver wants it, or it has not seen how the
                episode began, or another policy has begun one with the same caregiver since.
        """
        if not hasattr(timestep, "observation"):
            raise CaregiverError(
                f"a policy must be given the time step of env.step or env.reset, got {type(timestep).__name__}"
            )
        observation = timestep.observation
        if "base_position" not in observation:
            raise CaregiverError("the observation must be a dictionary, got a flattened one")
        if timestep.first():
            self._check_house(observation)
            self._reset(observation)
            self._has_begun = True
        elif not self._has_begun:
            raise CaregiverError("the first time step that a caregiver's policy sees must be that of env.reset()")
        elif self.caregiver.serves is not self._serves:
            raise CaregiverError(
                f"another policy has begun an episode with this {type(self.caregiver).__name__} meanwhile: "
                "each policy needs a caregiver of its own"
            )
        view = self._perception.look(self._senses.now(observation), self.robot.now)
        new_move, all_known = self._perception.watch(view, float(observation["clock"]))
        self._seen = view, new_move, all_known
        return all_known

    def act(self) -> np.ndarray:
        """Answer what has been seen with an action, the second half."""
        view, new_move, all_known = self._seen
        executive = self.executive
        begun, done = executive.begun, executive.done
        executive.act(view, self.robot, new_move, all_known)
        if begun != executive.begun or done != executive.done:
            self._task.note_interventions(executive.begun - begun, executive.done - done, executive.left)
        action = govern(view, self.robot, self._clearance, self._timestep)
        self.robot.now += self._timestep
        return action

    def percept(self) -> Percept:
        """Return what has been seen, as a caregiver sees it, of a batch of one."""
        view, *_ = self._seen
        return self.executive.percept(view)

    def _reset(self, observation: dict[str, np.ndarray]) -> None:
        self.robot.reset(observation["base_position"].tolist())
        self._senses.reset()
        self._perception.reset(observation)
        children = len(np.atleast_2d(observation["toddler_position"]))
        info = self._task.info
        self.caregiver.reset(1, [info.caregiver_seed], children)
        self._serves = self.caregiver.serves = object()
        wanted, found = starting_tables(self.plan, self.caregiver)[0].tolist(), list(info.starting_tables)
        if found != wanted:
            raise CaregiverError(
                f"candles must start on tables {wanted} with {type(self.caregiver).__name__}, got {found}: "
                "make its policy before env.reset(), and no other one in between"
            )
        if isinstance(self.caregiver, InstructedCaregiver) and info.orders:
            self.caregiver.orders = info.orders(observation) or Intervention()
        self.executive.reset()
        self._prepare_retrievals()

    def _prepare_retrievals(self) -> None:
        """Have the planning scene made for tables as high as they seem, unless it is: before the robot moves."""
        if self.plan.candle_tables or self.plan.floor_cells:
            seen = self._perception.table_heights
            self._retrievals.prepare(None if seen is None else tuple(seen.tolist()))

    def _check_house(self, observation: dict[str, np.ndarray]) -> None:
        """Raise CaregiverError if an episode begins as none can in this house: it is that of another one."""
        plan = self.plan
        alien = any(np.shape(np.asarray(observation.get(key))) != shape for key, shape in self._shapes.items())
        base, children = observation["base_position"], np.atleast_2d(observation["toddler_position"])
        if "toddler_seen" in observation:
            children = children[observation["toddler_seen"] > 0.0]
        if self._sensing.is_exact and not alien:
            outside = (plan[plan.cell_at(child)] not in WALKABLE for child in children)
            alien = plan.cell_at(base) not in plan.cell_index or any(outside)
        if alien:
            raise CaregiverError(
                f"the environment of this policy must be that of {self._task.info.family} in house '{plan.name}', got "
                "another: make a policy for each environment"
            )

    # -- For displays ----------------------------------------------------------------------------

    @property
    def assessment(self) -> Assessment | None:
        """The numbers behind the last decision, if the caregiver has such, for a batch of one."""
        return self.executive.assessment

    @property
    def in_view(self) -> np.ndarray | None:
        """Which free cells it sees as a whole, bool (cells,); None if it sees everything."""
        return self._perception.in_view

    @property
    def intervention(self) -> Intervention | None:
        """What is being done now."""
        return self.executive.routine.intervention if self.executive.routine else None

    @property
    def target(self) -> int:
        """The number of the hazard that is being protected from now, or NOTHING."""
        return self.executive.target

    @property
    def activity(self) -> str:
        """What the robot is doing, in words."""
        return self.executive.routine.activity if self.executive.routine else "watch"


@functools.lru_cache(maxsize=4)  # it is costly, and remembers nothing between questions
def _make_scene(plan: FloorPlan, embodiment: Embodiment, heights: tuple[float, ...] | None) -> PlanningScene:
    tables = None if heights is None else np.array(heights)
    return PlanningScene(build_house(plan, embodiment, visuals=False, table_heights=tables), plan, embodiment)


def _caregiver(caregiver: str | Caregiver, info: TaskInfo, seed: int) -> Caregiver:
    made: Caregiver | None
    if not isinstance(caregiver, str):
        check_kind("a caregiver", caregiver, str, Caregiver)
        check_house(caregiver, info.plan)
        made = caregiver
    else:
        made = InstructedCaregiver(info.plan) if info.orders else make_caregiver(caregiver, info.plan, seed)
    if made is None:
        raise CaregiverError(f"caregiver must be one that acts, got '{caregiver}': leave the robot out instead")
    return made

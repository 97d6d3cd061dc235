"""The scripted caregiver as a policy for the tasks: from observations to actions.

It uses the task's observation only, and infers the children's actions from their motion. A `Caregiver` decides; the
robot's routines carry out. Only a `PrivilegedCaregiver` also receives the hidden state.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any

import dm_env
import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver, PrivilegedCaregiver, Truth, answer, starting_tables
from caregiver_mj.caregivers.instructed import InstructedCaregiver
from caregiver_mj.caregivers.percept import Assessment, Percept
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.errors import CaregiverError, check_kind
from caregiver_mj.house.observer import TaskInfo
from caregiver_mj.house.rendering import control
from caregiver_mj.house.scene import build_house
from caregiver_mj.house.sensing import Sensing
from caregiver_mj.interventions.verb import DO_NOTHING, LOOK, Intervention, half_of, verb_of
from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import WALKABLE
from caregiver_mj.plans.floor_plan import FloorPlan, check_house
from caregiver_mj.plans.hazards import NOTHING, State
from caregiver_mj.policy.estimates import Senses, base_jumps, hand_error
from caregiver_mj.policy.pace import robot_pace
from caregiver_mj.policy.perception import Perception
from caregiver_mj.policy.routines import COOLDOWN, LEFT_LYING, ROUTINES, Cooldowns, Means, Routine
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.governor import govern
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.retrieval import PlanningScene, RetrievalPlanner
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View

# s; greatest control timestep for which the robot's guarantees hold. In 1,020 s in three houses, a child heading for
# the robot half the time: no strike or drop at 0.06 s, 3 strikes at 0.08, 4 drops at 0.15, 55 strikes at 0.2. In 32
# episodes in 16 homes, epsilon 1 and .5: none at 0.02, 0.04 or 0.06 s, by the stricter count 0, 2 and 3.
LONGEST_TIMESTEP = 0.06


class CaregiverPolicy:
    """The scripted caregiver. Call it with a time step to get an action.

    From the next reset on, the caregiver's `prepare` decides the starting tables of the environment's candles.

    Attributes:
        plan: The house.
        caregiver: The deciding caregiver.
        robot: The robot's references, for displays.
        executive: Carries out the interventions, for displays.
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
            env: An environment of this package with a robot.
            caregiver: Name of a caregiver, or one made for the environment's house.
            seed: Seed of the caregiver; its draws in an episode also depend on the episode's seed.
            sensing: Assumed errors of observations, as `Sensing.of` takes them; None for those of the task.

        Raises:
            CaregiverError: The environment has no robot, the caregiver is unknown or made for another house, the
                control timestep is too long, or the sensing too inexact to grasp candles.
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
        # Source of `info` at the start of an episode; receives the caregiver, and claims of interventions.
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
        exact = self._sensing.is_exact
        senses = None if exact else Senses(self._sensing, self.robot, self._timestep, things, haste)
        frames = functools.partial(env.physics.frames, info.sight.is_full)
        self._perception = Perception(self.plan, info.sight, senses, frames, haste)
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
        # The first observation has them, too, but preparing then would delay the first action.
        self._perception.table_heights = info.table_heights
        self._prepare_retrievals()
        task.caregiver = self.caregiver  # last, in case of an error above

    def __call__(self, timestep: dm_env.TimeStep) -> np.ndarray:
        """Return the action for a time step; see `see` for errors."""
        self.see(timestep)
        return self.act()

    def see(self, timestep: dm_env.TimeStep) -> bool:
        """Process a time step, the first half of a call.

        Returns:
            Whether the moves of all children have just become clear: once a novice timestep.

        Raises:
            CaregiverError: It is no time step, or the episode's first was missed; its observation is flat or of another
                house; candles do not start on the tables of the caregiver's `prepare`; or another policy has since
                begun an episode with the same caregiver.
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
                f"another policy has begun an episode with this {type(self.caregiver).__name__}: each policy requires "
                "its own caregiver"
            )
        view = self._perception.look(observation, self.robot.now)
        new_move, all_known = self._perception.watch(view, float(observation["clock"]))
        self._seen = view, new_move, all_known
        return all_known

    def act(self) -> np.ndarray:
        """Return the action for the last time step, the second half of a call."""
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
        """Return the caregiver's percept of the last time step, a batch of one."""
        view, *_ = self._seen
        return self.executive.percept(view)

    def _reset(self, observation: dict[str, np.ndarray]) -> None:
        self.robot.reset(observation["base_position"].tolist())
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
        """Make the planning scene for the perceived table heights before the robot moves, unless it exists."""
        if self.plan.candle_tables or self.plan.floor_cells:
            seen = self._perception.table_heights
            self._retrievals.prepare(None if seen is None else tuple(seen.tolist()))

    def _check_house(self, observation: dict[str, np.ndarray]) -> None:
        """Raise CaregiverError if an episode begins in a way that is impossible in this house."""
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
        """The numbers behind the last decision, a batch of one, or None."""
        return self.executive.assessment

    @property
    def in_view(self) -> np.ndarray | None:
        """Whether each free cell is entirely in view, bool (cells,); None with full sight."""
        return self._perception.in_view

    @property
    def intervention(self) -> Intervention | None:
        """The intervention under way, or None."""
        return self.executive.routine.intervention if self.executive.routine else None

    @property
    def target(self) -> int:
        """Number of the hazard under intervention, or NOTHING."""
        return self.executive.target

    @property
    def activity(self) -> str:
        """The robot's present activity in words."""
        return self.executive.routine.activity if self.executive.routine else "watch"


@functools.lru_cache(maxsize=4)  # costly, and stateless
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


class Executive:
    """One caregiver in charge of one robot.

    `truth` returns the hidden state for a `PrivilegedCaregiver`, after every move of the children.

    Attributes:
        routine: The intervention under way, or None.
        begun: Interventions begun in this episode.
        done: Interventions completed, such as a stairwell reached or a candle put down.
        left: Lasting states after interventions, by hazard.
    """

    def __init__(
        self,
        caregiver: Caregiver,
        perception: Perception,
        navigator: Navigator,
        retrievals: RetrievalPlanner,
        novice_timestep: float,
        truth: Callable[[], Truth] | None = None,
    ):
        self._caregiver, self._perception, self._truth = caregiver, perception, truth
        self._means = Means(
            plan=navigator.plan,
            navigator=navigator,
            retrievals=retrievals,
            novice_timestep=novice_timestep,
            cooldowns=Cooldowns(len(navigator.plan.hazards)),
            destination=functools.partial(_destination, caregiver),
            takes_orders=caregiver.takes_orders,
        )
        self.reset()

    def reset(self) -> None:
        """Begin an episode; `CaregiverPolicy` resets the caregiver, with the episode's seed."""
        self.routine: Routine | None = None
        self._assessment: Assessment | None = None
        self._decided: Percept | None = None  # of the last decision, until it is assessed
        self.begun = self.done = 0
        self.left: dict[int, State] = {}
        self._means.cooldowns.forget()
        self._was_done = False  # whether the present intervention was completed, but continues

    @property
    def assessment(self) -> Assessment | None:
        """The numbers behind the last decision, or None; computed on demand."""
        if self._decided is not None:
            self._assessment, self._decided = self._caregiver.assess(self._decided), None
        return self._assessment

    @property
    def holding(self) -> int:
        """Index of the candle in the hand, or NOTHING."""
        return self.routine.holding if self.routine else NOTHING

    @property
    def target(self) -> int:
        """Number of the hazard under intervention, or NOTHING."""
        return self.routine.intervention.hazard if self.routine else NOTHING

    def act(self, view: View, robot: RobotMotion, new_move: bool, all_known: bool) -> None:
        """Act for one control step.

        A child's present move, or those of all, may just have become clear: `new_move`, `all_known`.
        """
        if new_move and self.routine:
            self.routine.skill.driver.replan()
        if new_move or view.now == 0.0 or self.routine is None:
            self._decide(view, self.percept(view), observed=all_known)
        if self.routine:
            self._note(self.routine.step(view, robot, lambda: self.percept(view)), view)

    def percept(self, view: View) -> Percept:
        """Return the percept, including what is held, in cooldown and under way."""
        return self._perception.percept(view, self.holding, self._means.cooldowns.active(view.now), self.target)

    def _decide(self, view: View, percept: Percept, observed: bool) -> None:
        """Ask the caregiver, and begin the intervention that it wants unless the robot cannot be interrupted."""
        if observed:
            self._caregiver.watch(percept)
            if self._truth and isinstance(self._caregiver, PrivilegedCaregiver):
                self._caregiver.hear(self._truth())
        self._decided = percept
        if percept.belief is not None:  # assess now: the tracker changes before the next decision
            self._assessment, self._decided = self._caregiver.assess(percept), None
        if self.routine and not self.routine.skill.status.interruptible:
            return
        wanted = answer(self._caregiver, percept)[0]
        if self.routine and self.routine.holding != NOTHING:
            self.routine.hear(percept, wanted)
            return
        assert percept.out_of_reach is not None  # always set in a robot's percept
        if wanted.hazard != NOTHING and percept.out_of_reach[0, wanted.hazard]:
            wanted = Intervention(self._caregiver.idle_verb)
        if self.routine is None or _is_another(wanted, self.routine.intervention):
            self._begin(wanted, view, percept)

    def _begin(self, wanted: Intervention, view: View, percept: Percept) -> None:
        self.begun += verb_of(wanted.verb).counts
        self.routine = half_of(wanted.verb, ROUTINES, "policy.routines.ROUTINES")(self._means, wanted, view, percept)
        self._was_done = False

    def _note(self, status: Status, view: View) -> None:
        """Record the end of the present intervention, or its completion if it goes on."""
        if self.routine is None or not status.ended or (self._was_done and status is Status.DONE):
            return
        intervention = self.routine.intervention
        if status is Status.DONE:
            self._means.cooldowns.succeed(intervention.hazard)
            verb = verb_of(intervention.verb)
            self.done += verb.counts
            self._was_done = True
            if verb.leaves:
                self.left[intervention.hazard] = verb.leaves
                self._means.cooldowns.leave(intervention.hazard)
            if self.routine.goes_on:
                return
        elif status in (Status.FAILED, Status.OUT_OF_REACH) and intervention.hazard != NOTHING:
            wait = LEFT_LYING if status is Status.OUT_OF_REACH else COOLDOWN
            self._means.cooldowns.fail(intervention.hazard, view.now, wait)
        self.routine = None


def _destination(caregiver: Caregiver, percept: Percept, candle: int) -> int:
    return int(caregiver.destination(percept, np.array([candle]))[0])


def _is_another(wanted: Intervention, now: Intervention) -> bool:
    """Return whether an intervention differs from the present one. Idling interrupts none; waiting in a cell does."""
    idle, goes = not verb_of(wanted.verb).counts, wanted.verb in (LOOK, DO_NOTHING)
    if verb_of(now.verb).counts and idle and wanted.destination == NOTHING:
        return False
    if wanted.verb == now.verb and goes and wanted.destination != now.destination:
        return True
    return (now.verb, now.hazard) != (wanted.verb, wanted.hazard)

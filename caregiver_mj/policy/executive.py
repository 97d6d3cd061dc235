"""The executive: carries out a caregiver's decisions with the robot, one intervention at a time."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver, PrivilegedCaregiver, Truth, answer
from caregiver_mj.caregivers.percept import Assessment, Percept
from caregiver_mj.interventions.verb import DO_NOTHING, LOOK, Intervention, half_of, verb_of
from caregiver_mj.plans.hazards import NOTHING, State
from caregiver_mj.policy.perception import Perception
from caregiver_mj.policy.routines import COOLDOWN, LEFT_LYING, ROUTINES, Cooldowns, Means, Routine
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.retrieval import RetrievalPlanner
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View


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

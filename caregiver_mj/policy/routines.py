"""Routines: how the robot carries out interventions, as sequences of skills."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable

import numpy as np

from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.interventions.verb import (
    BLOCK,
    CLOSE,
    DO_NOTHING,
    LOOK,
    PICK_UP,
    RELOCATE,
    STAND_ASIDE,
    Intervention,
    verb_of,
)
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Where
from caregiver_mj.plans.visibility import lookouts
from caregiver_mj.robot import skills
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.retrieval import RetrievalPlanner
from caregiver_mj.robot.skills import Skill
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View

# s; cooldown of a hazard after a failed intervention: three moves of a toddler, which may open the way. Doubles with
# each further failure, up to `LEFT_LYING`, the cooldown of a candle out of the arm's reach.
COOLDOWN = 5.0
LEFT_LYING = 60.0
# Moves from a stairwell within which an approaching child makes the robot put a candle down early. From farther away
# toddlers seldom arrive; without the limit candles end up nearer to them, and total damage increases.
_ALARM = 4
# Share of the base's top speed on average, with corners and stops; s, time to put a candle down.
_CRUISING_SHARE, _PLACING_TIME = 0.792, 1.5


class Cooldowns:
    """Hazards that the robot avoids for a while after a failed intervention."""

    def __init__(self, hazards: int):
        self._until = np.zeros(hazards)
        self._wait = np.full(hazards, COOLDOWN)  # s; cooldown after the next failure

    def forget(self) -> None:
        """Begin an episode."""
        self._until[:], self._wait[:] = 0.0, COOLDOWN

    def fail(self, hazard: int, now: float, least: float = COOLDOWN) -> None:
        """Start the cooldown of a hazard, at least `least` seconds."""
        self._until[hazard] = now + max(least, self._wait[hazard])
        self._wait[hazard] = min(LEFT_LYING, 2 * self._wait[hazard])

    def leave(self, hazard: int) -> None:
        """Start a cooldown for the rest of the episode, after a lasting success."""
        self._until[hazard] = np.inf

    def succeed(self, hazard: int) -> None:
        """Record a success; NOTHING, for no hazard, changes nothing."""
        if hazard != NOTHING:
            self._wait[hazard] = COOLDOWN

    def active(self, time: float) -> np.ndarray:
        """Return whether each hazard is in cooldown at a time, (hazards,)."""
        return self._until > time


@dataclasses.dataclass(frozen=True)
class Means:
    """Resources of an episode's routines."""

    plan: FloorPlan  #: the house
    navigator: Navigator  #: plans the base's paths
    retrievals: RetrievalPlanner  #: plans how to pick up fallen things
    novice_timestep: float  #: seconds of a novice timestep
    cooldowns: Cooldowns  #: hazards in cooldown
    #: returns the caregiver's choice of a table for a candle, by percept and the candle's index
    destination: Callable[[Percept, int], int]
    takes_orders: bool  #: whether the caregiver only passes on orders


class Routine:
    """An intervention under way in the house. The base class carries it out with a single skill.

    Attributes:
        intervention: The intervention.
        skill: The robot's present skill.
        activity: The robot's activity in words.
        holding: Index of the candle in the robot's hand, or NOTHING.
        goes_on: Whether it continues after completion, until the next decision.
    """

    holding = NOTHING

    def __init__(
        self, means: Means, intervention: Intervention, skill: Skill, activity: str | None = None, goes_on: bool = False
    ):
        self.means, self.intervention = means, intervention
        self.skill, self.goes_on = skill, goes_on
        self.activity = activity or verb_of(intervention.verb).describe(means.plan, intervention)

    def step(self, view: View, robot: RobotMotion, see: Callable[[], Percept]) -> Status:
        """Act for one control step.

        Args:
            view: The robot's view.
            robot: The robot's references.
            see: Returns the caregiver's present percept.

        Returns:
            RUNNING, or the status with which it ended.
        """
        status = self.skill.step(view, robot)
        return self.after(status, view, see) if status.ended else status

    def after(self, status: Status, view: View, see: Callable[[], Percept]) -> Status:
        """Begin the next skill after one has ended. Return RUNNING, or the routine's status after the last one."""
        return status

    def is_barred(self, status: Status, view: View) -> bool:
        """Return whether a skill failed because of a barred way, with orders that leave no choice but to retry."""
        return status is Status.FAILED and self.means.takes_orders and self.skill.driver.patience.is_over(view.now)

    def hear(self, percept: Percept, wanted: Intervention) -> None:
        """Consider, with a candle in the hand, the caregiver's present wish."""


class Persisting(Routine):
    """A routine that retries after a barred way if orders leave no choice."""

    def __init__(self, means: Means, intervention: Intervention, make_skill: Callable[[], Skill]):
        super().__init__(means, intervention, make_skill())
        self._make_skill = make_skill

    def after(self, status: Status, view: View, see: Callable[[], Percept]) -> Status:
        if not self.is_barred(status, view):
            return status
        self.skill = self._make_skill()
        return Status.RUNNING


class Relocating(Routine):
    """Takes a candle to a table.

    Attributes:
        candle: Index of the candle.
    """

    def __init__(self, means: Means, intervention: Intervention, view: View, percept: Percept):
        self.candle = means.plan.hazards.among(Where.ON_TABLE, intervention.hazard)
        super().__init__(means, intervention, *_fetching(means, self.candle, view, percept))

    def after(self, status: Status, view: View, see: Callable[[], Percept]) -> Status:  # noqa: PLR0911 one a case
        if isinstance(self.skill, skills.Retrieve) and status is Status.FAILED and self.skill.still_holds(view):
            navigator, retrievals, pitch = self.means.navigator, self.means.retrievals, self.skill.pitch_down
            self.skill = skills.Retrieve(navigator, retrievals, self.candle, pitch)
            return Status.RUNNING
        if not isinstance(self.skill, skills.Place):
            if self.is_barred(status, view):
                self.skill, self.activity = _fetching(self.means, self.candle, view, see())
                return Status.RUNNING
            if status is not Status.DONE:
                return status
            self.holding = self.candle
            self._carry(see())
            return Status.RUNNING
        if status is Status.FAILED:  # with the candle in the hand
            self.means.cooldowns.fail(self.intervention.hazard, view.now)
            self._carry(see(), refused=self.skill.table)
            return Status.RUNNING
        self.holding = NOTHING
        if status is Status.OVERTAKEN and self.means.takes_orders:  # it fell, perhaps at its destination
            self.skill, self.activity = _fetching(self.means, self.candle, view, see())
            return Status.RUNNING
        return status

    def hear(self, percept: Percept, wanted: Intervention) -> None:
        """Put the candle down early if a child could otherwise be at a stairwell before the robot.

        The table is the one from which the robot reaches the stairwell soonest, among those farther from every child
        than the stairwell is from the child in danger. Another candle is no reason: it is no worse than this one, which
        would have to be fetched again.
        """
        if wanted.verb != BLOCK or self.means.takes_orders or not isinstance(self.skill, skills.Place):
            return
        graph, stairwell = self.means.plan.graph, self.means.plan.hazards.among(Where.OPENING, wanted.hazard)
        now = graph.stairwell_distances[percept.child_cell[0], stairwell]
        before = graph.stairwell_distances[percept.previous_cell[0], stairwell]
        if not (heads_there := (now <= _ALARM) & (now < before)).any():
            return
        moves = int(now[heads_there].min())
        time_left = moves * self.means.novice_timestep
        if self._seconds_by_way_of(self.skill.table, stairwell, percept) <= time_left:
            return
        far = graph.table_distances[percept.child_cell[0]].min(axis=0)
        tables = (table for table in self._bare_tables(percept) if far[table] > moves)
        seconds = {table: self._seconds_by_way_of(table, stairwell, percept) for table in tables}
        table = min(seconds, key=seconds.__getitem__, default=self.skill.table)
        if table != self.skill.table and seconds[table] <= time_left:
            self._place_on(table)

    def _carry(self, percept: Percept, refused: int = NOTHING) -> None:
        """Take the candle to the caregiver's table, or to another one if that table refused it."""
        table = self.means.destination(percept, self.candle)
        if table == refused and not self.means.takes_orders:
            far = self.means.plan.graph.table_distances[percept.child_cell[0]].min(axis=0)
            bare = (other for other in self._bare_tables(percept) if other != refused)
            table = max(bare, key=lambda other: (self._is_open(other, percept), far[other]), default=table)
        self._place_on(table)

    def _place_on(self, table: int) -> None:
        self.skill = skills.Place(self.means.navigator, self.candle, table)
        self.activity = f"carry {_name(self.means, self.candle)} to table {table + 1}"

    def _bare_tables(self, percept: Percept) -> list[int]:
        return sorted(set(range(len(self.means.plan.tables))) - set(percept.candle_table[0].tolist()))

    def _is_open(self, table: int, percept: Percept) -> bool:
        """Return whether a route to a table exists that no child bars."""
        plan = self.means.plan
        here = plan.caregiver_cells[percept.caregiver_cell[0]]
        children = [plan.free_cells[cell] for cell in percept.previous_cell[0]]
        stands = plan.free_neighbours(plan.tables[table])
        return any(self.means.navigator.route(here, stand, children) for stand in stands)

    def _seconds_by_way_of(self, table: int, stairwell: int, percept: Percept) -> float:
        """Return the estimated time to put the candle down on a table and drive on to a stairwell, s."""
        plan = self.means.plan
        (stands,) = plan.graph.beside([plan.tables[table]])
        landing = plan.cell_index[plan.posts[stairwell]]
        to_table, to_landing = plan.graph.distances_from([stands, landing])
        moves = int(to_table[percept.caregiver_cell[0]]) + int(to_landing[stands].min())
        cruising = _CRUISING_SHARE * self.means.navigator.robot.limits.base_speed
        return moves * plan.cell_size / cruising + _PLACING_TIME


def _fetching(means: Means, candle: int, view: View, percept: Percept) -> tuple[skills.Skill, str]:
    """Return the skill to take a candle from its present place, and its activity in words."""
    table = int(percept.candle_table[0, candle])
    if table != NOTHING and view.stands_on_table(candle, table):
        pick = skills.Pick(means.navigator, candle, table)
        if pick.has_way(view):
            return pick, f"fetch {_name(means, candle)}"
    return skills.Retrieve(means.navigator, means.retrievals, candle), f"pick up {_name(means, candle)}"


def _name(means: Means, candle: int) -> str:
    return str(means.plan.hazards.at(Where.ON_TABLE)[candle])


def _block(means: Means, intervention: Intervention, *_: object) -> Routine:
    stairwell = means.plan.hazards.among(Where.OPENING, intervention.hazard)
    return Routine(means, intervention, skills.Block(means.navigator, stairwell), goes_on=True)


def _close(means: Means, intervention: Intervention, *_: object) -> Routine:
    opening = means.plan.hazards.among(Where.OPENING, intervention.hazard)
    gate = opening - len(means.plan.landings)
    return Persisting(means, intervention, functools.partial(skills.Close, means.navigator, gate))


def _look(means: Means, intervention: Intervention, *_: object) -> Routine:
    cell = means.plan.caregiver_cells[lookouts(means.plan)[intervention.destination]]
    return Routine(means, intervention, skills.GoTo(means.navigator, cell), goes_on=True)


def _wait(means: Means, intervention: Intervention, *_: object) -> Routine:
    if intervention.destination == NOTHING:
        return Routine(means, intervention, skills.Rest(means.navigator))
    cell = means.plan.caregiver_cells[intervention.destination]
    return Routine(means, intervention, skills.GoTo(means.navigator, cell), goes_on=True)


def _pick_up(means: Means, intervention: Intervention, *_: object) -> Routine:
    thing = means.plan.hazards.among(Where.FLOOR, intervention.hazard)
    make_skill = functools.partial(skills.PickUp, means.navigator, means.retrievals, thing)
    return Persisting(means, intervention, make_skill)


# The robot's half of each verb: makes its routine from the robot's view and the caregiver's percept.
ROUTINES: dict[str, Callable[[Means, Intervention, View, Percept], Routine]] = {
    BLOCK: _block,
    CLOSE: _close,
    RELOCATE: Relocating,
    PICK_UP: _pick_up,
    LOOK: _look,
    STAND_ASIDE: lambda means, intervention, *_: Routine(means, intervention, skills.StandAside(means.navigator)),
    DO_NOTHING: _wait,
}

"""The caregiver that sees harm coming: it looks ahead to where the children may go, and to what it could still do."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.child_model import novice_chain
from caregiver_mj.caregivers.foresight.itineraries import Itineraries
from caregiver_mj.caregivers.foresight.options import Options
from caregiver_mj.caregivers.foresight.prospects import check_size, prospects
from caregiver_mj.caregivers.foresight.reckoning import SOUND, Reckoning
from caregiver_mj.caregivers.foresight.standing import each_on_a_table
from caregiver_mj.caregivers.foresight.values import has_values, values
from caregiver_mj.caregivers.outlook import Outlook
from caregiver_mj.caregivers.pace import PAPER, Pace
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import Assessment, Percept, bare_tables
from caregiver_mj.danger.belief import Belief
from caregiver_mj.interventions.intervention import BLOCK, RELOCATE, Interventions
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

CHANGE = 0.005  # probability, in a timestep, that a child's epsilon is another one from then on
# By how much something else must be better than what it is about, as a share of all damage that would come if it did
# nothing: so that it does not turn round for a trifle.
HYSTERESIS = 0.004


class ForesightCaregiver(Caregiver):
    """Does that from which the least damage is to be expected, later interventions included.

    It believes in every toy bin that a child may be going to, and every epsilon that it may have, as far as the child's
    moves speak for them. What follows for each of them if the caregiver blocks a stairwell, or carries a candle to a
    table, is known beforehand; those expectations are weighed by the belief, and added up over the children.
    """

    def __init__(
        self,
        plan: FloorPlan,
        seed: int = 0,
        *,
        hysteresis: float = HYSTERESIS,
        change: float = CHANGE,
        reckoning: Reckoning = SOUND,
        chooses_table: bool = True,
        options: Callable[..., Options] | None = None,
    ):
        """Looks ahead.

        Args:
            plan: The house.
            seed: Of the paper's model of safety beside it; what it does draws no lots.
            hysteresis: By what share of all the damage to come another intervention must be better than this one.
            change: Probability, in a timestep, that a child's epsilon changes.
            reckoning: What it reckons with when it looks ahead.
            chooses_table: Whether it chooses the table with the candle; else that is the farthest one, as for the rule.
            options: What can be done, if it is not to be `options_of` the house.

        Raises:
            CaregiverError: The house is too large.
        """
        super().__init__(plan, seed)
        check_size(plan)
        self._given = options
        self._options: Callable[..., Options] | None = None
        self._prepared_for: Pace | None = None
        self._hysteresis, self._change, self._reckoning = hysteresis, change, reckoning
        self._chooses_table = chooses_table
        self._rule = PaperCaregiver(plan, seed)  # for whoever looks on; it decides nothing
        self._begin(1, 1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        self._prepare()  # now, so that no decision has to wait for it
        self._rule.reset(batch, seeds, children)
        self._begin(batch, children)

    def _begin(self, batch: int, children: int) -> None:
        self.belief = Belief(novice_chain(self.plan), batch, children, self._change)
        self._begun, self._table = np.full((2, batch), NOTHING)  # the hazard that it is about, and its destination

    def _prepare(self) -> Callable[..., Options]:
        """Finds out what there is to do, if its pace is another one than before."""
        if self._options is None or self._prepared_for != self.pace:
            self._options = self._given or options_of(self.plan, self.pace, self._reckoning)
            self._prepared_for = self.pace
        return self._options

    def watch(self, percept: Percept) -> None:
        self.belief.watch(percept.previous_cell, percept.previous_action)
        self._rule.watch(percept)

    def assess(self, percept: Percept) -> Assessment:
        """What it believes, beside the paper's P(safe|tau); P(reach) in equation (2) is what follows from that belief.

        It decides by more than these numbers: by `expected_damage`, which counts what it could still do.
        """
        outlook = Outlook(novice_chain(self.plan), percept.child_cell, self.belief.probability)
        return dataclasses.replace(self._rule.weigh(outlook.reach(self.plan, percept)), outlook=outlook)

    def choose(self, percept: Percept) -> np.ndarray:
        return self.decide(percept).hazard

    def expected_damage(self, percept: Percept, worlds: np.ndarray) -> np.ndarray:
        """Expected discounted damage to come by stairwells, and by candles instead of bare tables.

        Args:
            percept: What is seen after the caregiver's last action in a timestep.
            worlds: Indices of worlds in which all candles are on tables, (W,).

        Returns:
            Array (W,).
        """
        found = self.options_in(percept, worlds, 0.0)
        return found.candles + found.damage.min(axis=1)

    def options_in(self, percept: Percept, worlds: np.ndarray, left: np.ndarray | float = 1.0) -> Options:
        """What it can do in some worlds, (W,), and what that is worth.

        Args:
            percept: What is seen.
            worlds: Indices of worlds in which all candles are on tables.
            left: Share of a timestep until the children's next moves, (W,) or for all.
        """
        return self._prepare()(percept, worlds, self.belief.probability[worlds], left)

    def decide(self, percept: Percept) -> Interventions:
        answer = Interventions.idle(len(percept.caregiver_cell))
        answer.verb[:] = self.idle_verb
        lying = self._within_reach_on_the_floor(percept)
        # Whoever has a candle in the hand puts it down first, and one on the floor is picked up before anything else.
        empty = percept.holding == NOTHING
        for world in np.flatnonzero(empty & lying.any(axis=1)):
            candle = lying[world].argmax()
            destination = self.destination(percept, np.full(len(lying), candle))[world]
            self._order(answer, np.array([world]), self.plan.hazards.of_candle(int(candle)), destination)
        free = np.flatnonzero(empty & ~lying.any(axis=1))
        if free.size and len(self.plan.hazards):
            left = 1.0 if percept.time_left is None else percept.time_left[free]
            found = self.options_in(each_on_a_table(self.plan, percept), free, left)
            tables = self._only_tables(percept, free)
            self._order(answer, free, *found.best(self._begun[free], self._hysteresis, tables))
        return answer

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        """The table that was chosen with the candle, as long as it is bare; else the farthest one."""
        chosen = np.where(self._begun == self.plan.hazards.of_candle(candle), self._table, NOTHING)
        bare = bare_tables(percept.candle_table, len(self.plan.tables))[np.arange(len(chosen)), chosen]
        return np.where(bare & (chosen != NOTHING), chosen, super().destination(percept, candle))

    def _only_tables(self, percept: Percept, worlds: np.ndarray) -> np.ndarray | None:
        candles = percept.candle_table.shape[1]
        if self._chooses_table or not candles:
            return None
        count = len(percept.candle_table)
        tables = [super(ForesightCaregiver, self).destination(percept, np.full(count, c)) for c in range(candles)]
        return np.stack(tables, axis=1)[worlds]

    def _order(
        self, answer: Interventions, worlds: np.ndarray, hazard: np.ndarray | int, destination: np.ndarray | int
    ) -> None:
        """Enters what to do in some worlds, and remembers it."""
        is_stairwell, is_candle = self.plan.hazards.is_stairwell(hazard), self.plan.hazards.is_candle(hazard)
        answer.verb[worlds] = np.where(is_stairwell, BLOCK, np.where(is_candle, RELOCATE, self.idle_verb))
        answer.hazard[worlds] = self._begun[worlds] = hazard
        answer.destination[worlds] = self._table[worlds] = destination

    def _within_reach_on_the_floor(self, percept: Percept) -> np.ndarray:
        """Which candles are to be picked up, bool (B, candles)."""
        if percept.candle_cell is None:
            return np.zeros(percept.candle_table.shape, bool)
        lying = percept.candle_cell != NOTHING
        if percept.out_of_reach is None:
            return lying
        return lying & ~self.plan.hazards.split(percept.out_of_reach)[1]


def options_of(plan: FloorPlan, pace: Pace = PAPER, reckoning: Reckoning = SOUND) -> Callable[..., Options]:
    """What can be done in a house: `Options` without its first argument. A large house has `Itineraries`."""
    if has_values(plan):
        return functools.partial(Options, values(plan, pace, reckoning))
    return functools.partial(Itineraries, prospects(plan, pace, reckoning))

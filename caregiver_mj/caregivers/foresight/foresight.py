"""The caregiver that sees harm coming: it looks ahead to where the children may go, and to what it could still do."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.child_model import novice_chain
from caregiver_mj.caregivers.foresight.itineraries import Itineraries
from caregiver_mj.caregivers.foresight.options import Options
from caregiver_mj.caregivers.foresight.outlook import outlook
from caregiver_mj.caregivers.foresight.travel import ACTIONS_PER_TIMESTEP
from caregiver_mj.caregivers.foresight.values import has_values, values
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.danger.belief import Belief
from caregiver_mj.interventions.intervention import BLOCK, RELOCATE, Interventions
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

CHANGE = 0.005  # probability, in a timestep, that a child's epsilon is another one from then on
# By how much something else must be better than what it is about, as a share of all damage that would come if it did
# nothing: so that it does not turn round for a trifle.
HYSTERESIS = 0.001


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
        options: Callable[..., Options] | None = None,
    ):
        """Looks ahead.

        Args:
            plan: The house.
            seed: Not used: it draws no lots.
            hysteresis: By what share of all the damage to come another intervention must be better than this one.
            change: Probability, in a timestep, that a child's epsilon changes.
            options: What can be done, if it is not to be `options_of` the house.
        """
        super().__init__(plan, seed)
        self._options = options or options_of(plan)
        self._hysteresis, self._change = hysteresis, change
        self.reset(1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        self.belief = Belief(novice_chain(self.plan), batch, children, self._change)
        self._begun = np.full(batch, NOTHING)  # the hazard that it is about
        self._left = ACTIONS_PER_TIMESTEP

    def watch(self, percept: Percept) -> None:
        self.belief.watch(percept.previous_cell, percept.previous_action)
        self._left = ACTIONS_PER_TIMESTEP

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
        found = self.options_in(percept, worlds, 0)
        return found.candles + found.damage.min(axis=1)

    def options_in(self, percept: Percept, worlds: np.ndarray, left: int | None = None) -> Options:
        """What it can do in some worlds, (W,), and what that is worth.

        Args:
            percept: What is seen.
            worlds: Indices of worlds in which all candles are on tables.
            left: Actions that it has left in this timestep, if not as many as it has.
        """
        left = self._left if left is None else left
        return self._options(percept, worlds, self.belief.probability[worlds], left)

    def decide(self, percept: Percept) -> Interventions:
        batch = len(percept.caregiver_cell)
        answer = Interventions.idle(batch)
        answer.verb[:] = self.idle_verb
        # Whoever has a candle in the hand puts it down first.
        free = np.flatnonzero((percept.candle_table != NOTHING).all(axis=1) & (percept.holding == NOTHING))
        if free.size and len(self.plan.hazards):
            found = self.options_in(percept, free)
            hazard, destination = found.best(self._begun[free], self._hysteresis)
            is_stairwell, is_candle = self.plan.hazards.is_stairwell(hazard), self.plan.hazards.is_candle(hazard)
            answer.verb[free] = np.where(is_stairwell, BLOCK, np.where(is_candle, RELOCATE, self.idle_verb))
            answer.hazard[free], answer.destination[free] = hazard, destination
            self._begun[free] = hazard
        if percept.candle_cell is not None:  # one on the floor is picked up before anything else
            for world in np.flatnonzero((percept.candle_cell != NOTHING).any(axis=1) & (percept.holding == NOTHING)):
                lying = percept.candle_cell[world].argmax()
                answer.verb[world], answer.hazard[world] = RELOCATE, self.plan.hazards.of_candle(int(lying))
                answer.destination[world] = self.destination(percept, np.full(batch, lying))[world]
        self._left = max(1, self._left - 1)
        return answer


def options_of(plan: FloorPlan) -> Callable[..., Options]:
    """What can be done in a house: `Options` without its first argument. A large house has `Itineraries`.

    Raises:
        CaregiverError: It is too large for these as well.
    """
    if has_values(plan):
        return functools.partial(Options, values(plan))
    return functools.partial(Itineraries, outlook(plan))

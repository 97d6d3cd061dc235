"""What is observed where actions are targets: a caregiver's percept as numbers from 0 to 1, alike in both worlds."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from numbers import Integral

import numpy as np
from numpy.typing import ArrayLike

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import ACTIONS
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Where

Observations = dict[str, np.ndarray] | np.ndarray
Places = tuple[int, int] | tuple[int, int, int]  # for stairwells and candles, and for what lies on the floor
_MOST = 1_000  # of a kind: each takes memory in every observation


class Encoder:
    """Observes B worlds with K children each, in episodes of so many novice timesteps.

    The caregiver that is told what to do knows what can be done, and how far it is.

    Attributes:
        shapes: Of each key of an observation of one world; all values are 0 to 1.
        flat: Whether observations are given out as one array a world: the values in the order of `shapes`.
        actions: How many there are: 0 is to protect the children from nothing, the others are the slots.
        slots: Where the hazards are in actions and observations.
    """

    def __init__(
        self, caregiver: Caregiver, children: int, slots: Slots, flat: bool, timesteps: float = EPISODE_TIMESTEPS
    ):
        self._caregiver, self.slots, self.flat, self._timesteps = caregiver, slots, flat, timesteps
        plan, count = caregiver.plan, len(slots)
        places = np.array(plan.caregiver_cells, float).reshape(-1, 2)
        self._places = (places / (np.array(plan.shape) - 1)).astype(np.float32)
        landings = plan.graph.distances_from([plan.cell_index[cell] for cell in plan.posts])
        self._to_stairwell = landings.T.astype(float)  # (cells, stairwells)
        self._to_table = plan.graph.distances_from(plan.graph.beside(plan.tables)).T.astype(float)  # (cells, tables)
        self._to_floor = plan.graph.distances_from(plan.floor_cells).T.astype(float)  # (cells, things on the floor)
        self.actions = count + 1
        self.shapes: dict[str, tuple[int, ...]] = {
            "clock": (1,),  # learners take no arrays without a dimension
            "child_position": (children, 2),
            "child_move": (children, len(ACTIONS)),
            "caregiver_position": (2,),
            "hazard_damage": (count,),
            "hazard_nearness_to_child": (children, count),
            "hazard_nearness_to_caregiver": (count,),
            "holding": (count,),
            "under_way": (count + 1,),
            "action_mask": (count + 1,),
        }

    def observe(self, percept: Percept, mask: np.ndarray) -> Observations:
        """Give an observation of each world out, in new arrays.

        Args:
            percept: What the caregiver sees, with its clock and what is under way.
            mask: As of `mask`.
        """
        assert percept.clock is not None
        assert percept.under_way is not None
        plan, caregiver, batch = self._caregiver.plan, self._caregiver, len(percept.child_cell)
        moves = np.concatenate([np.eye(len(ACTIONS)), np.zeros((1, len(ACTIONS)))])  # the last one is NOTHING
        held = np.zeros((batch, len(plan.hazards)), bool)
        self._mark_held(held, percept)
        values = {
            "clock": np.minimum(1.0, percept.clock / self._timesteps)[:, None],
            "child_position": self._places[percept.child_cell],
            "child_move": moves[percept.previous_action],
            "caregiver_position": self._places[percept.caregiver_cell],
            "hazard_damage": self.slots.spread(np.tile(plan.hazards.damage / (plan.damage.worst or 1.0), (batch, 1))),
            "hazard_nearness_to_child": self.slots.spread(1 / caregiver.hazard_distances(percept)),
            "hazard_nearness_to_caregiver": self.slots.spread(1 / (1 + self._walks(percept))),
            "holding": self.slots.spread(held),
            "under_way": np.eye(len(self.slots) + 1)[self.slots.actions(percept.under_way)],
            "action_mask": mask,
        }
        found = {key: np.array(values[key], np.float32) for key in self.shapes}
        if not self.flat:
            return found
        return np.concatenate([value.reshape(batch, -1) for value in found.values()], axis=1)

    def mask(self, percept: Percept) -> np.ndarray:
        """Return which actions do something, int8 (B, actions).

        Nothing always does, and so do the hazards that the caregiver can do something about; but with a candle in the
        hand only to go on with that does, and stairwells where it takes notice of them.
        """
        worth, stairwells = self._caregiver.worth_protecting(percept), len(self._caregiver.plan.stairwells)
        carries = percept.holding != NOTHING
        worth[carries, stairwells:] = False
        worth[carries if percept.hears is None else carries & ~percept.hears, :stairwells] = False
        self._mark_held(worth, percept)
        mask = np.zeros((len(worth), self.actions), np.int8)
        mask[:, 0] = ~carries
        mask[:, 1:] = self.slots.spread(worth)
        return mask

    def _mark_held(self, which: np.ndarray, percept: Percept) -> None:
        """Marks, among hazards (B, hazards), the candle in the hand."""
        (carries,) = np.nonzero(percept.holding != NOTHING)
        which[carries, self._caregiver.plan.hazards.number(Where.ON_TABLE, percept.holding[carries])] = True

    def _walks(self, percept: Percept) -> np.ndarray:
        """Return the caregiver's moves to where it does something about each hazard, (B, hazards)."""
        plan, cell, table = self._caregiver.plan, percept.caregiver_cell, percept.candle_table
        candles = np.where(table == NOTHING, 0.0, self._to_table[cell[:, None], table])
        if percept.candle_cell is not None:
            for world, candle in np.argwhere(percept.candle_cell != NOTHING):
                candles[world, candle] = plan.graph.distances_from([percept.candle_cell[world, candle]])[0, cell[world]]
        return plan.hazards.join(self._to_stairwell[cell], candles, self._to_floor[cell])


def places_needed(plans: Sequence[FloorPlan]) -> Places:
    """Return how many places there must be for the hazards of some houses; two numbers if nothing lies on a floor."""
    each = ((len(plan.stairwells), len(plan.candle_tables), len(plan.floor_cells)) for plan in plans)
    stairwells, candles, things = map(max, zip(*each, strict=True))
    return (stairwells, candles, things) if things else (stairwells, candles)


class Slots:
    """So many places for stairwells, then for candles, then for what lies on the floor.

    Those that a house has no hazard for stay empty.

    Attributes:
        of_hazard: Slot of each hazard, (hazards,).
        hazard: Hazard in each slot, or NOTHING, (slots,).
    """

    def __init__(self, plan: FloorPlan, slots: Places | None = None):
        """Lay the places out.

        Args:
            plan: The house.
            slots: How many places for stairwells, for candles and, as a third number, for what lies on the floor; as
                many as the house has if None.

        Raises:
            CaregiverError: They are not two or three numbers, or more than 1,000 of a kind, or the house has more.
        """
        needed = places_needed([plan])
        places = needed if slots is None else slots
        good = isinstance(places, Sequence) and len(places) in (2, 3) and all(isinstance(n, Integral) for n in places)
        if not good:
            raise CaregiverError(f"slots must be numbers of stairwells and candles, such as (4, 6), got {slots!r}")
        if slots is not None and max(slots) > _MOST:
            raise CaregiverError(f"slots must be at most {_MOST:,} of a kind, got {slots}")
        if any(place < number for place, number in itertools.zip_longest(places, needed, fillvalue=0)):
            raise CaregiverError(f"slots must be at least {needed} for house '{plan.name}', got {slots}")
        firsts = itertools.accumulate(places, initial=0)
        self.of_hazard = np.concatenate(
            [first + np.arange(number) for first, number in zip(firsts, needed, strict=False)]
        )
        self.hazard = np.full(sum(places), NOTHING)
        self.hazard[self.of_hazard] = np.arange(len(plan.hazards))

    def __len__(self) -> int:
        return len(self.hazard)

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Return the values of hazards (..., hazards) as values of slots (..., slots), 0 in those that are empty."""
        spread = np.zeros((*values.shape[:-1], len(self)), np.float32)
        spread[..., self.of_hazard] = values
        return spread

    def targets(self, actions: ArrayLike, batch: int) -> np.ndarray:
        """Return the hazards that actions (B,) are about: NOTHING for 0 and an empty slot, else what is in the slot.

        Raises:
            CaregiverError: They are of another shape, or out of range.
        """
        actions = np.asarray(actions)
        if actions.shape != (batch,):
            raise CaregiverError(f"actions must be {batch} integers, one for each episode, got {actions.tolist()!r}")
        if not np.issubdtype(actions.dtype, np.integer) or ((actions < 0) | (actions > len(self))).any():
            raise CaregiverError(f"an action must be an integer from 0 to {len(self)}, got {actions.tolist()!r}")
        return np.concatenate([[NOTHING], self.hazard])[actions]

    def actions(self, hazards: np.ndarray) -> np.ndarray:
        """Return the reverse of `targets`, (B,)."""
        return np.concatenate([self.of_hazard + 1, [0]])[hazards]  # the last one is for NOTHING

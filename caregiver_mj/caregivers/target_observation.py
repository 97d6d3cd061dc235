"""Observations for policies over targets: a caregiver's percept as numbers from 0 to 1, equal in both worlds."""

from __future__ import annotations

import collections
from collections.abc import Callable, Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.caregivers.target_map import TRACE, Places, PlanMap, Slots
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import ACTIONS
from caregiver_mj.plans.hazards import NOTHING, Where

Observations = dict[str, np.ndarray] | np.ndarray
_MAPS = ("map", "graph")
_BESIDE = ("clock", "child_move", "holding", "under_way", "action_mask")  # keys that also accompany maps
OBSERVATIONS = ("numbers", "flat", *_MAPS)


class Encoder:
    """Observes B worlds with K children each.

    Attributes:
        observation: One of `OBSERVATIONS`; "flat" is one array a world, the numbers in the order of `shapes`.
        map: Draws the house, for the observations `map` and `graph`.
        shapes: Shape of each key of an observation of one world; all values are 0 to 1, except the nodes of `edges`.
        trace: Cells that the children left in the last timesteps, latest first, (B, K) each. The caller clears it at
            the start of episodes and adds to it.
        actions: Number of actions: 0 protects from nothing, the others are the slots.
        slots: Slots of the hazards in actions and observations.
    """

    def __init__(
        self,
        caregiver: Caregiver,
        children: int,
        observation: str = "numbers",
        slots: Places | None = None,
        shape: Sequence[int] | None = None,
        timesteps: float = EPISODE_TIMESTEPS,
    ):
        if observation not in OBSERVATIONS:
            raise CaregiverError(f"no observation '{observation}': there are {', '.join(OBSERVATIONS)}")
        self._caregiver, self.observation, self._timesteps = caregiver, observation, timesteps
        self.trace: collections.deque[np.ndarray] = collections.deque(maxlen=TRACE)
        plan, self.slots = caregiver.plan, Slots(caregiver.plan, slots, shape)
        count = len(self.slots)
        self.map = PlanMap(plan, children, self.slots, observation == "graph") if observation in _MAPS else None
        places = np.array(plan.caregiver_cells, float).reshape(-1, 2)
        self._places = (places / (np.array(plan.shape) - 1)).astype(np.float32)
        landings = plan.graph.distances_from([plan.cell_index[cell] for cell in plan.posts])
        self._to_stairwell = landings.T.astype(float)  # (cells, stairwells)
        self._to_table = plan.graph.distances_from(plan.graph.beside(plan.tables)).T.astype(float)  # (cells, tables)
        self._to_floor = plan.graph.distances_from(plan.floor_cells).T.astype(float)  # (cells, things on the floor)
        self.actions = count + 1
        self.shapes: dict[str, tuple[int, ...]] = {
            "clock": (1,),  # learners reject scalars
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
        if self.map:
            self.shapes = self.map.shapes | {key: self.shapes[key] for key in _BESIDE}

    def look(self, percept: Percept) -> tuple[Observations, np.ndarray]:
        """Return the observations of all worlds, in new arrays, and the `mask`; the percept must have a clock."""
        clock, under_way = percept.clock, percept.under_way
        assert clock is not None
        assert under_way is not None
        plan, caregiver, batch = self._caregiver.plan, self._caregiver, len(percept.child_cell)
        moves = np.concatenate([np.eye(len(ACTIONS)), np.zeros((1, len(ACTIONS)))])  # the last one is NOTHING
        held, mask = np.zeros((batch, len(plan.hazards)), bool), self.mask(percept)
        damage = np.tile(plan.hazards.damage / (plan.damage.worst or 1.0), (batch, 1))
        self._mark_held(held, percept)
        values: dict[str, Callable[[], np.ndarray]] = {
            "clock": lambda: np.minimum(1.0, clock / self._timesteps)[:, None],
            "child_position": lambda: self._places[percept.child_cell],
            "child_move": lambda: moves[percept.previous_action],
            "caregiver_position": lambda: self._places[percept.caregiver_cell],
            "hazard_damage": lambda: self.slots.spread(damage),
            "hazard_nearness_to_child": lambda: self.slots.spread(1 / caregiver.hazard_distances(percept)),
            "hazard_nearness_to_caregiver": lambda: self.slots.spread(1 / (1 + self._walks(percept))),
            "holding": lambda: self.slots.spread(held),
            "under_way": lambda: np.eye(len(self.slots) + 1)[self.slots.actions(under_way)],
            "action_mask": lambda: mask,
        }
        found = {key: np.array(value(), np.float32) for key, value in values.items() if key in self.shapes}
        if self.observation == "flat":
            return np.concatenate([value.reshape(batch, -1) for value in found.values()], axis=1), mask
        return (self.map.observe(percept, self.trace) | found if self.map else found), mask

    def mask(self, percept: Percept) -> np.ndarray:
        """Return whether each action has an effect, int8 (B, actions).

        These are 0, and the hazards that the caregiver can do something about; with a candle in the hand only that
        candle, and stairwells where the percept `hears`.
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
        """Set the entry of the candle in the hand, in an array (B, hazards)."""
        (carries,) = np.nonzero(percept.holding != NOTHING)
        which[carries, self._caregiver.plan.hazards.number(Where.ON_TABLE, percept.holding[carries])] = True

    def _walks(self, percept: Percept) -> np.ndarray:
        """Return the caregiver's moves to its place of action against each hazard, (B, hazards)."""
        plan, cell, table = self._caregiver.plan, percept.caregiver_cell, percept.candle_table
        candles = np.where(table == NOTHING, 0.0, self._to_table[cell[:, None], table])
        for world, candle, moves in percept.fallen(plan.graph):
            candles[world, candle] = moves[cell[world]]
        return plan.hazards.join(self._to_stairwell[cell], candles, self._to_floor[cell])

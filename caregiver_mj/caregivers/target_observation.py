"""Observations and actions of policies over targets, equal in both worlds.

Observations are numbers from 0 to 1, a map or a graph; actions choose slots, to which hazards are assigned.
"""

from __future__ import annotations

import collections
import itertools
from collections.abc import Callable, Sequence
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.percept import Percept, bare_tables
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import ACTIONS, LEGEND, WALL, Cell, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import KINDS, NOTHING, TABLE, Where

Observations = dict[str, np.ndarray] | np.ndarray
_MAPS = ("map", "graph")
_BESIDE = ("clock", "child_move", "holding", "under_way", "action_mask")  # keys that also accompany maps
OBSERVATIONS = ("numbers", "flat", *_MAPS)
Places = tuple[int, int] | tuple[int, int, int]  # numbers of slots for stairwells, candles, and things on the floor
_MOST = 1_000  # slots of a kind: each takes memory in every observation
TRACE = 8  # novice timesteps for which a child's trace is visible
_STILL = ("floor", "opening", "way_in", "table", "bin")


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
        moves = np.concatenate([np.eye(len(ACTIONS)), np.zeros((1, len(ACTIONS)))])  # last: NOTHING
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

        Action 0 has, and hazards that the caregiver can do something about. With a candle in the hand only that candle
        has, and stairwells where the percept `hears`.
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


def places_needed(plans: Sequence[FloorPlan]) -> Places:
    """Return the numbers of slots that some houses need; two numbers if nothing lies on a floor."""
    each = ((len(plan.stairwells), len(plan.candle_tables), len(plan.floor_cells)) for plan in plans)
    stairwells, candles, things = map(max, zip(*each, strict=True))
    return (stairwells, candles, things) if things else (stairwells, candles)


def _enough(plan: FloorPlan, what: str, of: str, given: Any, needed: Sequence[int], *sizes: int) -> Sequence[int]:
    """Return the given numbers, or a house's needs if None; raise CaregiverError if they are too small."""
    if given is None:
        return needed
    if not (isinstance(given, Sequence) and len(given) in sizes and all(isinstance(n, Integral) for n in given)):
        raise CaregiverError(f"{what} must be numbers of {of}, got {given!r}")
    if max(given) > _MOST:
        raise CaregiverError(f"{what} must be at most {_MOST:,} of a kind, got {given}")
    if any(number < least for number, least in itertools.zip_longest(given, needed, fillvalue=0)):
        raise CaregiverError(f"{what} must be at least {needed} for house '{plan.name}', got {given}")
    return given


class Slots:
    """Numbered slots: so many for stairwells, then for candles, then for things on the floor. Surplus ones stay empty.

    Attributes:
        of_hazard: Slot of each hazard, (hazards,).
        hazard: Hazard in each slot, or NOTHING, (slots,).
        shape: Rows and columns of maps.
    """

    def __init__(self, plan: FloorPlan, slots: Places | None, shape: Sequence[int] | None):
        """Assign hazards to slots.

        Args:
            plan: The house.
            slots: Numbers of slots for stairwells, candles and, optionally, things on the floor; None for those of the
                house.
            shape: Rows and columns; None for those of the house.

        Raises:
            CaregiverError: The numbers are invalid, above 1,000, or too small for the house.
        """
        needed = places_needed([plan])
        places = _enough(plan, "slots", "stairwells and candles, such as (4, 6)", slots, needed, 2, 3)
        self.shape = _enough(plan, "shape", "rows and columns, such as (18, 18)", shape, plan.shape, 2)
        firsts = itertools.accumulate(places, initial=0)
        self.of_hazard = np.concatenate(
            [first + np.arange(number) for first, number in zip(firsts, needed, strict=False)]
        )
        self.hazard = np.full(sum(places), NOTHING)
        self.hazard[self.of_hazard] = np.arange(len(plan.hazards))

    def __len__(self) -> int:
        return len(self.hazard)

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Return values of hazards (..., hazards) as values of slots (..., slots), 0 for empty slots."""
        spread = np.zeros((*values.shape[:-1], len(self)), np.float32)
        spread[..., self.of_hazard] = values
        return spread

    def targets(self, actions: ArrayLike, batch: int) -> np.ndarray:
        """Return the hazards of actions (B,): NOTHING for 0 and for empty slots.

        Raises:
            CaregiverError: The actions have another shape, or are out of range.
        """
        actions = np.asarray(actions)
        if actions.shape != (batch,):
            raise CaregiverError(f"actions must be {batch} integers, one for each episode, got {actions.tolist()!r}")
        if not np.issubdtype(actions.dtype, np.integer) or ((actions < 0) | (actions > len(self))).any():
            raise CaregiverError(f"an action must be an integer from 0 to {len(self)}, got {actions.tolist()!r}")
        return np.concatenate([[NOTHING], self.hazard])[actions]

    def actions(self, hazards: np.ndarray) -> np.ndarray:
        """Return the inverse of `targets`, (B,)."""
        return np.concatenate([self.of_hazard + 1, [0]])[hazards]  # last: NOTHING


class PlanMap:
    """Draws B worlds with K children each as planes, north up, the house in the upper left corner of `slots.shape`.

    As a graph, its nodes are the cells other than walls, in reading order, with the values of the planes, padded to all
    cells within the border. Edge 4 n + a leads from node n to the target of a child's move a, and back; to n itself
    where there is a wall or a fence.

    Attributes:
        planes: Names of the planes.
        shapes: Shape of each key of an observation of one world.
    """

    def __init__(self, plan: FloorPlan, children: int, slots: Slots, as_graph: bool):
        self._plan, (rows, columns), self._as_graph = plan, slots.shape, as_graph
        self.planes = (
            *_STILL,
            *(f"{kind}_damage" for kind in KINDS),
            *(f"action_{number}" for number in range(1, len(slots) + 1)),
            *(f"{what}_{number}" for what in ("child", "trace") for number in range(1, children + 1)),
            "caregiver",
        )
        self._of_kind = len(_STILL) + np.array([KINDS.index(kind) for kind in plan.hazards.kinds], int)
        self._of_slot = len(_STILL) + len(KINDS) + slots.of_hazard
        self._child = len(_STILL) + len(KINDS) + len(slots) + np.arange(children)

        def places(cells: Sequence[Cell]) -> np.ndarray:
            return np.array(cells, int).reshape(-1, 2) @ np.array([columns, 1])

        self._cell, openings, self._table = map(places, (plan.caregiver_cells, plan.stairwells, plan.tables))
        on_tables, lying = self._table[list(plan.candle_tables)], self._cell[list(plan.floor_cells)]
        self._place = plan.hazards.join(openings, on_tables, lying)
        self._still = np.zeros((len(self.planes), rows * columns), np.float32)
        still = (plan.free_cells, plan.stairwells, tuple(plan.mouths.values()), plan.tables, plan.bins)
        for plane, cells in zip(self._still, still, strict=False):
            plane[places(cells)] = 1.0
        nodes = (rows - 2) * (columns - 2)
        self._nodes = places(plan.cells_of(*LEGEND.keys() - {WALL}))
        cell, action = np.nonzero(plan.graph.moves[1] != Target.WALL)
        n, m = np.searchsorted(self._nodes, [self._cell[cell], self._cell[cell] + places(ACTIONS)[action]])
        self._edges = np.tile(np.arange(nodes).repeat(4), (2, 1))
        self._edges[1, 4 * n + action], self._edges[1, 4 * m + (action + 2) % 4] = m, n
        self.shapes: dict[str, tuple[int, ...]] = {"map": (len(self.planes), rows, columns)}
        if as_graph:
            self.shapes = {"nodes": (nodes, len(self.planes)), "node_mask": (nodes,), "edges": self._edges.shape}

    def observe(self, percept: Percept, trace: Sequence[np.ndarray]) -> dict[str, np.ndarray]:
        """Return the observation of each world, in new arrays; see `Encoder` for the trace."""
        plan, worlds = self._plan, np.arange(len(percept.child_cell))[:, None]
        drawn, worst = np.tile(self._still, (len(worlds), 1, 1)), plan.damage.worst or 1.0
        place = self._hazards(percept)
        world, hazard = np.nonzero(place != NOTHING)
        drawn[world, self._of_kind[hazard], place[world, hazard]] = plan.hazards.damage[hazard] / worst
        drawn[world, self._of_slot[hazard], place[world, hazard]] = 1.0
        world, table = np.nonzero(bare_tables(percept.candle_table, len(plan.tables)))
        drawn[world, len(_STILL) + KINDS.index(TABLE), self._table[table]] = plan.damage[TABLE.name] / worst
        if percept.belief is None:
            drawn[worlds, self._child, self._cell[percept.child_cell]] = 1.0
        else:
            drawn[:, self._child[:, None], self._cell[: len(plan.free_cells)]] = percept.belief.presence.clip(0, 1)
        for age, cells in reversed([*enumerate(trace)]):  # later traces cover earlier ones
            drawn[worlds, self._child + len(self._child), self._cell[cells]] = 1.0 - age / TRACE
        drawn[worlds[:, 0], -1, self._cell[percept.caregiver_cell]] = 1.0
        if not self._as_graph:
            return {"map": drawn.reshape(-1, *self.shapes["map"])}
        nodes, mask = (np.zeros((len(drawn), *self.shapes[key]), np.float32) for key in ("nodes", "node_mask"))
        nodes[:, : len(self._nodes)], mask[:, : len(self._nodes)] = drawn[:, :, self._nodes].transpose(0, 2, 1), 1.0
        return {"nodes": nodes, "node_mask": mask, "edges": np.tile(self._edges, (len(drawn), 1, 1))}

    def _hazards(self, percept: Percept) -> np.ndarray:
        """Return the place of each hazard, NOTHING if shut, gone or carried, (B, hazards)."""
        table, place = percept.candle_table, np.tile(self._place, (len(percept.holding), 1))
        openings, on_table, lying = self._plan.hazards.split(place)
        on_table[:] = np.where(table == NOTHING, NOTHING, self._table[table])
        if percept.candle_cell is not None:
            on_table[:] = np.where(percept.candle_cell == NOTHING, on_table, self._cell[percept.candle_cell])
        for some, left in ((openings, percept.shut), (lying, percept.gone)):
            if left is not None:
                some[left] = NOTHING
        return place

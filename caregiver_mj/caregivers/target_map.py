"""Slots of hazards for actions that choose targets, and observations of a house as a map or a graph."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from caregiver_mj.caregivers.percept import Percept, bare_tables
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import ACTIONS, LEGEND, WALL, Cell, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import KINDS, NOTHING, TABLE

Places = tuple[int, int] | tuple[int, int, int]  # numbers of slots for stairwells, candles, and things on the floor
_MOST = 1_000  # slots of a kind: each takes memory in every observation
TRACE = 8  # novice timesteps for which a child's trace is visible
_STILL = ("floor", "opening", "way_in", "table", "bin")


def places_needed(plans: Sequence[FloorPlan]) -> Places:
    """Return the numbers of slots that some houses need; two numbers if nothing lies on a floor."""
    each = ((len(plan.stairwells), len(plan.candle_tables), len(plan.floor_cells)) for plan in plans)
    stairwells, candles, things = map(max, zip(*each, strict=True))
    return (stairwells, candles, things) if things else (stairwells, candles)


def _enough(plan: FloorPlan, what: str, of: str, given: Any, needed: Sequence[int], *sizes: int) -> Sequence[int]:
    """Return the given numbers if they suffice for a house, or its needs if None is given."""
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
    """So many places for stairwells, then for candles, then for what lies on the floor.

    Those that a house has no hazard for stay empty.

    Attributes:
        of_hazard: Slot of each hazard, (hazards,).
        hazard: Hazard in each slot, or NOTHING, (slots,).
        shape: Rows and columns that a map has place for.
    """

    def __init__(self, plan: FloorPlan, slots: Places | None = None, shape: Sequence[int] | None = None):
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
        return np.concatenate([self.of_hazard + 1, [0]])[hazards]  # the last one is for NOTHING


class PlanMap:
    """Draws B worlds with K children each as planes, north up, the house in the upper left corner of `slots.shape`.

    As a graph, its nodes are the cells other than walls, in reading order, with the values of the planes, padded to all
    cells within the border. Edge 4 n + a leads from node n to the target of a child's move a, and back; to n itself
    where there is a wall or a fence.

    Attributes:
        planes: Names of the planes.
        shapes: Shape of each key of an observation of one world.
    """

    def __init__(self, plan: FloorPlan, children: int, slots: Slots, as_graph: bool = False):
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
        for age, cells in reversed([*enumerate(trace)]):  # later ones cover earlier ones
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

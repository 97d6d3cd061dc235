"""Where the paper's rule is no more than `nearest`, by equations (1) and (2) alone.

With one child the expected danger of hazard o, at d_o moves and of damage D_o, is

    E(o) = (1 - P(safe)) P(reach_o) D_o    and    P(reach_o) = (1 / d_o) / sum of 1 / d over all hazards.

1 - P(safe) and the sum are the same for all hazards, so the rule protects from the one of greatest D_o / d_o, and
`nearest` from the one of greatest 1 / d_o. Among hazards of one kind that is the same one. So all depends on the
nearest stairwell, at s moves, and the nearest candle that is worth moving, at c. What is equal goes to the stairwell,
which comes first in the table of hazards: `nearest` takes it if s <= c, the rule if D_c s <= D_s c.
"""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.percept import bare_tables
from caregiver_mj.plans.floor_plan import FloorPlan


def apart(stairwell: np.ndarray, candle: np.ndarray, stairwell_damage: float, candle_damage: float) -> np.ndarray:
    """Whether the rule and `nearest` protect from different hazards.

    Args:
        stairwell: Moves to the nearest stairwell, of any shape; infinite where there is none.
        candle: Moves to the nearest candle that is worth moving, likewise.
        stairwell_damage: D_s.
        candle_damage: D_c.
    """
    by_nearness = stairwell <= candle
    by_danger = candle_damage * stairwell <= stairwell_damage * candle
    either = np.isfinite(stairwell) & np.isfinite(candle)  # else there is nothing to choose between
    return either & (by_nearness != by_danger)


def cells_apart(plan: FloorPlan, candle_table: np.ndarray | None = None) -> np.ndarray:
    """In which cells a child has the two protect from different hazards, bool (free cells,).

    Args:
        plan: The house, with what a collision costs.
        candle_table: Index of the table on which each candle stands; as in the floor plan if None.
    """
    tables = np.array(plan.candle_tables if candle_table is None else candle_table, int)
    distances = plan.graph.table_distances.astype(float)
    stairwell = plan.graph.stairwell_distances.astype(float).min(axis=1, initial=np.inf)
    farthest = np.where(bare_tables(tables[None], len(plan.tables)), distances, 0.0).max(axis=1, initial=0.0)
    candles = distances[:, tables]
    candle = np.where(candles < farthest[:, None], candles, np.inf).min(axis=1, initial=np.inf)
    return apart(stairwell, candle, plan.damage.stairwell, plan.damage.candle)


def first_apart(stairwell_damage: float, candle_damage: float, farthest: int) -> list[tuple[int, int]]:
    """The distances (candle, stairwell) up to some at which the two are apart, the nearest first."""
    candle, stairwell = np.mgrid[1 : farthest + 1, 1 : farthest + 1]
    found = apart(stairwell, candle, stairwell_damage, candle_damage)
    return [(int(c), int(s)) for c, s in zip(candle[found], stairwell[found], strict=True)]

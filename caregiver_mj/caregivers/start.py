"""How an episode begins, in both worlds alike."""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan


def starting_tables(plan: FloorPlan, caregiver: Caregiver | None, batch: int = 1) -> np.ndarray:
    """Where the candles stand at first: where the floor plan has them, or where the caregiver has put them before.

    Args:
        plan: The house.
        caregiver: Who protects the children; it has been reset for as many episodes. None if nobody does.
        batch: Number of episodes.

    Returns:
        Table indices, (episodes, candles).

    Raises:
        CaregiverError: The caregiver's are none.
    """
    as_planned = np.tile(np.array(plan.candle_tables, int), (batch, 1))
    if caregiver is None:
        return as_planned
    tables = np.asarray(caregiver.prepare(as_planned.copy()))
    who, last = f"{type(caregiver).__name__}.prepare", len(plan.tables) - 1
    if tables.shape != as_planned.shape or not np.issubdtype(tables.dtype, np.integer):
        raise CaregiverError(f"{who} must answer with integers of shape {as_planned.shape}, not {tables!r}")
    if ((tables < 0) | (tables > last)).any() or (np.diff(np.sort(tables, axis=1), axis=1) == 0).any():
        raise CaregiverError(f"{who} must give each candle a table of its own, 0 to {last}, not {tables}")
    return tables

"""Candles as the caregiver plans with them: each on a table of its own."""

from __future__ import annotations

import dataclasses

import numpy as np

from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING


def each_on_a_table(plan: FloorPlan, percept: Percept) -> Percept:
    """The percept in which a candle that lies on the floor, or shares a table, is on the nearest bare one instead.

    That happens in the house only, and seldom. Those in the hand stay there.
    """
    if percept.candle_cell is None:
        return percept
    tables = percept.candle_table.copy()
    places = np.array([plan.position(cell) for cell in plan.tables])
    for world, lying in enumerate(percept.candle_cell):
        first = np.unique(tables[world], return_index=True)[1]
        for candle in range(len(lying)):
            table = tables[world, candle]
            if candle == percept.holding[world] or (table != NOTHING and candle in first):
                continue
            here = plan.position(plan.free_cells[lying[candle]]) if table == NOTHING else places[table]
            distance = np.linalg.norm(places - here, axis=1)
            distance[tables[world][tables[world] != NOTHING]] = np.inf
            tables[world, candle] = distance.argmin()
    return dataclasses.replace(percept, candle_table=tables)

"""The floor: the damage that remains when nothing but bare tables is left."""

from __future__ import annotations

from collections.abc import Sequence

from caregiver_mj.children.family import Family
from caregiver_mj.children.tape import Tape
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING


class FloorWorld(GridWorld):
    """A house without candles whose stairwells are all shut.

    What is left are bumps into tables, all of them bare. A stairwell that is shut blocks a child as a caregiver in it
    does. Nobody is in the children's way; a caregiver could come out a little lower by standing between a child and a
    table, which nothing tells it to do.
    """

    def __init__(self, plan: FloorPlan, family: Family | float | str):
        super().__init__(plan, family, None, stairs_shut=True)

    def reset(self, tapes: Sequence[Sequence[Tape]]) -> None:
        super().reset(tapes)
        self.candle_table[:] = NOTHING

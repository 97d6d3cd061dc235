"""The numbers of the planner's options, in one table and one order, as `Hazards` is for hazards."""

from __future__ import annotations

import itertools

import numpy as np

from caregiver_mj.plans.hazards import NOTHING


class OptionIndex:
    """Which number each option has: those of one kind follow each other, and kinds do in the order below.

    Attributes:
        stairs: To block each stairwell or close its gate, a slice, as all that are several.
        aside: To stand aside.
        stay: To stay.
        relocations: To relocate each candle.
        pick_ups: To pick up each thing on the floor.
        looks: To look from each lookout.
        waits: To wait in each cell.
        stairwells, candles, things, lookouts, cells: How many there are of each.
    """

    def __init__(self, stairwells: int, candles: int, things: int, lookouts: int, cells: int):
        self.stairwells, self.candles, self.things = stairwells, candles, things
        self.lookouts, self.cells = lookouts, cells
        ends = itertools.accumulate((stairwells, 1, 1, candles, things, lookouts, cells), initial=0)
        parts = itertools.starmap(slice, itertools.pairwise(ends))
        self.stairs, aside, stay, self.relocations, self.pick_ups, self.looks, self.waits = parts
        self.aside, self.stay = aside.start, stay.start

    def __len__(self) -> int:
        return self.waits.stop

    def hazard(self, option: np.ndarray) -> np.ndarray:
        """Return the numbers of the hazards that options are about; NOTHING for those about none."""
        idle = self.stay + 1 - self.aside  # options between those of stairwells and those of other hazards
        on_tables_and_floor = np.where((option > self.stay) & (option < self.pick_ups.stop), option - idle, NOTHING)
        return np.where(option < self.aside, option, on_tables_and_floor)

    def of_hazards(self, values: np.ndarray, others: float | bool) -> np.ndarray:
        """Return values of options, (W, options), by those of hazards, (W, hazards), and one for all other options."""
        hazard = self.hazard(np.arange(len(self)))
        return np.where(hazard == NOTHING, others, np.pad(values, ((0, 0), (0, 1)))[:, hazard])

    @staticmethod
    def among(options: slice, option: np.ndarray) -> np.ndarray:
        """Return the numbers of options among some of the slices above; NOTHING for those that are not in it."""
        return np.where((option >= options.start) & (option < options.stop), option - options.start, NOTHING)

"""Numbering of the planner's options."""

from __future__ import annotations

import itertools

import numpy as np

from caregiver_mj.plans.hazards import NOTHING


class OptionIndex:
    """Number of each option. Options of a kind are contiguous; kinds are in the order below.

    Attributes:
        stairs: Block each stairwell or close its gate, a slice, as are all plurals.
        aside: Stand aside.
        stay: Stay.
        relocations: Relocate each candle.
        pick_ups: Pick up each thing from the floor.
        looks: Look from each lookout.
        waits: Wait in each cell.
        stairwells, candles, things, lookouts, cells: Number of each.
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
        """Return the number of each option's hazard, NOTHING for options without one."""
        idle = self.stay + 1 - self.aside  # options between stairwells and other hazards
        on_tables_and_floor = np.where((option > self.stay) & (option < self.pick_ups.stop), option - idle, NOTHING)
        return np.where(option < self.aside, option, on_tables_and_floor)

    def of_hazards(self, values: np.ndarray, others: float | bool) -> np.ndarray:
        """Return values by option, (W, options), from values by hazard, (W, hazards), and one value for all others."""
        hazard = self.hazard(np.arange(len(self)))
        return np.where(hazard == NOTHING, others, np.pad(values, ((0, 0), (0, 1)))[:, hazard])

    @staticmethod
    def among(options: slice, option: np.ndarray) -> np.ndarray:
        """Return the positions of options within a slice, NOTHING for options outside of it."""
        return np.where((option >= options.start) & (option < options.stop), option - options.start, NOTHING)

"""The numbers of the planner's options, in one table and one order, as `Hazards` is for hazards."""

from __future__ import annotations

import dataclasses

import numpy as np

from caregiver_mj.plans.hazards import NOTHING


@dataclasses.dataclass(frozen=True)
class OptionIndex:
    """Which number each option has.

    First to block each stairwell or close its gate, then to stand aside, to stay, to relocate each candle, to pick up
    each thing on the floor, to look from each lookout, to wait in each cell.
    """

    stairwells: int  #: how many stairwells there are, with a gate or without
    candles: int  #: how many things stand on tables
    things: int  #: how many lie on the floor
    lookouts: int  #: from how many cells it may look
    cells: int  #: how many cells the caregiver can stand in

    @property
    def stairs(self) -> slice:
        """The options of blocking each stairwell, or closing its gate."""
        return slice(0, self.stairwells)

    @property
    def aside(self) -> int:
        """The option of standing aside."""
        return self.stairwells

    @property
    def stay(self) -> int:
        """The option of staying where it is."""
        return self.aside + 1

    @property
    def relocations(self) -> slice:
        """The options of relocating each candle."""
        return slice(self.stay + 1, self.stay + 1 + self.candles)

    @property
    def pick_ups(self) -> slice:
        """The options of picking up each thing on the floor."""
        return slice(self.relocations.stop, self.relocations.stop + self.things)

    @property
    def looks(self) -> slice:
        """The options of looking from each lookout."""
        return slice(self.pick_ups.stop, self.pick_ups.stop + self.lookouts)

    @property
    def waits(self) -> slice:
        """The options of waiting in each cell, the last ones."""
        return slice(self.looks.stop, self.looks.stop + self.cells)

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

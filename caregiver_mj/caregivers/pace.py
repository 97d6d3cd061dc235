"""How long a caregiver takes for what it does."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Pace:
    """What the world of a caregiver tells it about its own speed.

    Attributes:
        cells: Cells that it walks in a novice timestep.
        get: Time to take a candle from a table that it stands beside, in that of walking a cell.
        place: Time to put one down there, likewise.
    """

    cells: float = 3.0
    get: float = 1.0
    place: float = 1.0


PAPER = Pace()  # of the caregiver in the paper's grid, which walks three times as fast as the child

"""What a caregiver sees, and the numbers behind what it decides."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from caregiver_mj.plans.hazards import NOTHING

if TYPE_CHECKING:
    from caregiver_mj.caregivers.outlook import Outlook


@dataclasses.dataclass(frozen=True)
class Percept:
    """What the caregiver sees of B worlds with K children each at one moment.

    Attributes:
        child_cell: Index of each child's free cell, (B, K).
        previous_cell: The cell in which it made its last move, (B, K).
        previous_action: That move, an index into `ACTIONS`, or NOTHING before the first one and for a child that made
            none, (B, K).
        caregiver_cell: Index of the caregiver's own cell in `FloorPlan.caregiver_cells`, (B,).
        candle_table: Index of the table on which each candle is, (B, candles), or NOTHING for one that is on none
            (it is in the caregiver's hand, or on the floor).
        holding: Index of the candle in the caregiver's hand, or NOTHING, (B,).
        candle_cell: Index of the free cell on whose floor each candle is, (B, candles), or NOTHING. Left out where
            no candle can be on the floor, as in the grid.
        out_of_reach: Whether a hazard is to be passed over because the caregiver could not get to it lately,
            (B, hazards). Left out if there is none.
        time_left: Share of a novice timestep until the children make their next moves, those of which `child_cell`
            does not know yet, (B,). Left out where all of it is left.
        clock: Novice timesteps since the start of the episode, with their fraction, (B,). Left out where nobody asks.
        under_way: Number of the hazard that the caregiver is about, or NOTHING, (B,). Left out likewise.
        hears: Whether, with a candle in the hand, it takes notice of stairwells, and puts it down the sooner, (B,).
            Left out where it does not.
    """

    child_cell: np.ndarray
    previous_cell: np.ndarray
    previous_action: np.ndarray
    caregiver_cell: np.ndarray
    candle_table: np.ndarray
    holding: np.ndarray
    candle_cell: np.ndarray | None = None
    out_of_reach: np.ndarray | None = None
    time_left: np.ndarray | None = None
    clock: np.ndarray | None = None
    under_way: np.ndarray | None = None
    hears: np.ndarray | None = None


@dataclasses.dataclass(frozen=True)
class Assessment:
    """The numbers behind a decision.

    Attributes:
        safe: P(safe|tau) of every child, (B, K).
        reach: P(reach_o|tau) of every hazard by every child, (B, K, hazards).
        danger: Expected danger of every hazard to every child, equation (2), (B, K, hazards).
        urgency: What decides between the hazards: their dangers, put together over the children and divided by the
            greatest 1 - P(safe) of any child, (B, hazards).
        outlook: What the caregiver believes of the children and what follows from that, if it looks ahead.
    """

    safe: np.ndarray
    reach: np.ndarray
    danger: np.ndarray
    urgency: np.ndarray
    outlook: Outlook | None = None


def bare_tables(candle_table: np.ndarray, tables: int) -> np.ndarray:
    """Which tables bear no candle, bool (B, tables), by the table of each candle, (B, candles)."""
    bare = np.ones((len(candle_table), tables), bool)
    worlds, candles = np.nonzero(candle_table != NOTHING)
    bare[worlds, candle_table[worlds, candles]] = False
    return bare

"""Colours of the display and of the report: those of Okabe and Ito, which stay apart for colour-blind eyes."""

from __future__ import annotations

Colour = tuple[int, int, int]  # red, green, blue, of 255

GROUND = (16, 20, 28)  # of dark cards
WALL, FLOOR, TABLE, BIN = (120, 130, 146), (38, 45, 57), (133, 100, 72), (0, 158, 115)
STAIRWELL, CANDLE = (204, 121, 167), (230, 159, 0)  # reddish purple, orange
TODDLER, ROBOT, DAMAGE = (240, 228, 66), (86, 180, 233), (240, 120, 50)  # yellow, sky blue, vermillion


def mix(colour: Colour, other: Colour, share: float) -> Colour:
    """A colour with a share of another."""
    return tuple(round(a + (b - a) * share) for a, b in zip(colour, other, strict=True))

"""Colours of the display and of the report: those of Okabe and Ito, which stay apart for colour-blind eyes."""

from __future__ import annotations

from caregiver_mj.plans import hazards

Colour = tuple[int, int, int]  # red, green, blue, of 255

GROUND = (16, 20, 28)  # of dark cards
TEXT = (242, 244, 247)  # on them
WALL, FLOOR, BIN = (120, 130, 146), (38, 45, 57), (0, 158, 115)
STAIRWELL, CANDLE, TABLE = (kind.colour for kind in (hazards.STAIRWELL, hazards.CANDLE, hazards.TABLE))
FLAME = (255, 236, 170)  # the bright middle of a candle's
HARM = (222, 30, 96)  # that may be coming: crimson, which no floor or furniture has
TODDLER, ROBOT, DAMAGE = (240, 228, 66), (86, 180, 233), (240, 120, 50)  # yellow, sky blue, vermillion

# Of several children. Chosen to be far, in CIELAB, from one another and from all that they move among, as seen with
# normal eyes and with each of the three dichromacies.
CHILDREN = (TODDLER, (160, 96, 255), (216, 250, 250), (190, 60, 20))


def of_child(number: int) -> Colour:
    """Return the colour of a child, by its number from 0; beyond those there are, colours come again."""
    return CHILDREN[number % len(CHILDREN)]


def mix(colour: Colour, other: Colour, share: float) -> Colour:
    """Return a colour with a share of another."""
    red, green, blue = (round(a + (b - a) * share) for a, b in zip(colour, other, strict=True))
    return red, green, blue


def unit(colour: Colour) -> tuple[float, float, float]:
    """Return a colour in shares of 1, as Matplotlib takes it."""
    red, green, blue = colour
    return red / 255, green / 255, blue / 255

"""Colours of display and report: those of Okabe and Ito, which colour-blind people can tell apart."""

from __future__ import annotations

from caregiver_mj.plans import hazards

Colour = tuple[int, int, int]  # red, green, blue, 0 to 255

GROUND = (16, 20, 28)  # of dark cards
TEXT = (242, 244, 247)  # on dark cards
WALL, FLOOR, BIN = (120, 130, 146), (38, 45, 57), (0, 158, 115)
STAIRWELL, CANDLE, TABLE = (kind.colour for kind in (hazards.STAIRWELL, hazards.CANDLE, hazards.TABLE))
FLAME = (255, 236, 170)  # bright middle of a flame
HARM = (222, 30, 96)  # predicted; crimson, unlike any floor or furniture
TODDLER, ROBOT, DAMAGE = (240, 228, 66), (86, 180, 233), (240, 120, 50)  # yellow, sky blue, vermillion

# Of several children: far in CIELAB from each other and from their surroundings, for normal vision and each of the
# three dichromacies.
CHILDREN = (TODDLER, (160, 96, 255), (216, 250, 250), (190, 60, 20))


def of_child(number: int) -> Colour:
    """Return the colour of a child by its number from 0; colours repeat."""
    return CHILDREN[number % len(CHILDREN)]


def mix(colour: Colour, other: Colour, share: float) -> Colour:
    """Return a mixture of two colours with a share of the second."""
    red, green, blue = (round(a + (b - a) * share) for a, b in zip(colour, other, strict=True))
    return red, green, blue


def unit(colour: Colour) -> tuple[float, float, float]:
    """Return a colour for Matplotlib, with components from 0 to 1."""
    red, green, blue = colour
    return red / 255, green / 255, blue / 255

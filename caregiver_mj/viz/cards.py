"""Drawing tools of display and maps: lengths, text, and cards (dark backgrounds)."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from caregiver_mj.viz.colours import Colour

LABEL, TRACK = (158, 168, 182), (56, 64, 78)  # colours of labels, and of the empty part of a gauge
Box = tuple[int, int, int, int]  # left, top, right, bottom, in pixels
SMALLEST_FONT = 11  # pixels, in any frame
FINE = 3  # scale at which text and plan are drawn before averaging; Pillow does not smooth edges
_DESIGN_HEIGHT = 720  # pixels; height of the frame for which lengths are designed


@functools.lru_cache(maxsize=16)
def mask(size: tuple[int, int], radius: int, opacity: int) -> Image.Image:
    """Return the mask of a card with round corners, with an opacity from 0 to 255. Do not draw on it: it is cached."""
    fine = Image.new("L", (size[0] * FINE, size[1] * FINE))
    ImageDraw.Draw(fine).rounded_rectangle((0, 0, fine.width - 1, fine.height - 1), radius * FINE, fill=opacity)
    return fine.reduce(FINE)


def put(frame: np.ndarray, box: Box, paint: Callable[[Image.Image], None]) -> None:
    """Draw on a part of the frame with `paint`."""
    left, top, right, bottom = box
    region = Image.fromarray(frame[top:bottom, left:right])
    paint(region)
    frame[top:bottom, left:right] = np.asarray(region)


def side(width: int, height: int) -> float:
    """Return the greatest width of an inset at the left or right edge of a frame, pixels."""
    return width * (0.2 if width > 1.5 * height else 0.24)


class Scale:
    """Lengths of the design in pixels of a frame with a height; among them the sizes of three fonts."""

    def __init__(self, height: int):
        self._factor = height / _DESIGN_HEIGHT
        self.small, self.medium, self.large = map(self.font, (13, 17, 24))  # of labels, of values, of the main value

    def px(self, length: float) -> int:
        return max(1, round(length * self._factor))

    def font(self, size: float) -> int:
        return max(SMALLEST_FONT, round(size * self._factor))


@functools.lru_cache(maxsize=2048)
def width_of(text: str, size: int) -> int:
    """Return the width of a line in pixels, rounded up."""
    return math.ceil(_font(size * FINE).getlength(text) / FINE) + 1


def write(
    image: Image.Image,
    at: tuple[float, float],
    text: str,
    size: int,
    colour: Colour,
    align: float = 0.0,
    outline: Colour | None = None,
) -> None:
    """Write a line; its baseline begins (align 0), is centred (0.5) or ends (1) at a point."""
    x, y = round(at[0] - align * width_of(text, size)), round(at[1]) - size
    if outline:
        image.paste(outline, (x - 1, y), _mask(text, size, 1))
    image.paste(colour, (x, y), _mask(text, size))


@functools.lru_cache(maxsize=512)
def fit(texts: tuple[str, ...], size: int, width: int) -> str:
    """Return the first of some texts that fits into a width, or the last one, shortened."""
    for text in texts:
        if width_of(text, size) <= width:
            return text
    while text and width_of(text + "...", size) > width:
        text = text[:-1]
    return text.rstrip() + "..."


@functools.cache
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


@functools.lru_cache(maxsize=2048)
def _mask(text: str, size: int, outline: int = 0) -> Image.Image:
    """Return a text as a mask, drawn large and averaged, which keeps the spacing of small letters.

    The baseline is one font size below the upper edge.
    """
    font = _font(size * FINE)
    width = width_of(text, size) + 2 * outline
    mask = Image.new("L", (width * FINE, (size + size // 2) * FINE))
    stroke = 0.6 + outline * FINE  # bolder letters are more legible in a film
    ImageDraw.Draw(mask).text((outline * FINE, size * FINE), text, 255, font, anchor="ls", stroke_width=stroke)
    return mask.reduce(FINE)

"""Cards: the dark grounds that the display is written on, and where they lie in a frame."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from PIL import Image, ImageDraw

from caregiver_mj.viz.colours import GROUND
from caregiver_mj.viz.hud.text import FINE

LABEL, TRACK = (158, 168, 182), (56, 64, 78)  # fainter letters, and the empty part of a gauge
Box = tuple[int, int, int, int]  # left, top, right, bottom, in pixels


def card(size: tuple[int, int], radius: int, opacity: int) -> tuple[Image.Image, Image.Image]:
    """A dark card with round corners, and its opacity (of 255)."""
    mask = Image.new("L", (size[0] * FINE, size[1] * FINE))
    ImageDraw.Draw(mask).rounded_rectangle((0, 0, mask.width - 1, mask.height - 1), radius * FINE, fill=opacity)
    return Image.new("RGB", size, GROUND), mask.reduce(FINE)


def put(frame: np.ndarray, box: Box, paint: Callable[[Image.Image], None]) -> None:
    """Lets `paint` draw on a part of the frame."""
    left, top, right, bottom = box
    region = Image.fromarray(frame[top:bottom, left:right])
    paint(region)
    frame[top:bottom, left:right] = np.asarray(region)


def side(width: int, height: int) -> float:
    """How wide, in pixels, something at the left or right edge of a frame may be."""
    return width * (0.2 if width > 1.5 * height else 0.24)

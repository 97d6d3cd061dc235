"""Puts the display together."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz.colours import GROUND, TEXT
from caregiver_mj.viz.hud import cards
from caregiver_mj.viz.hud.chart import Chart
from caregiver_mj.viz.hud.legend import Legend
from caregiver_mj.viz.hud.state import HudState
from caregiver_mj.viz.hud.strip import Strip
from caregiver_mj.viz.hud.text import Scale, write

_CELL, _RIM = 8, 40  # pixels, of a cell and of what is around the house, in the smallest picture of the plan alone


def draw(frame: np.ndarray, state: HudState, insets: Sequence[tuple[str, np.ndarray]] = ()) -> np.ndarray:
    """Draws the display on a copy of a frame.

    Args:
        frame: uint8 array (height, width, 3).
        state: What to show.
        insets: Smaller views with their captions, laid along the right edge from the upper corner down;
            `inset_size` says how large they are best.

    Returns:
        An array of the same shape and type.
    """
    height, width = frame.shape[:2]
    drawn = frame.copy()
    strip, chart = _strip(width, height), _chart(state.plan, width, height)
    cards.put(drawn, strip.box, lambda region: strip.draw(region, state))
    cards.put(drawn, chart.box, lambda region: chart.draw(region, state))
    if state.forecast is not None:
        legend = _legend(state.plan, width, height)
        cards.put(drawn, legend.box, lambda region: legend.draw(region, state))
    scale = Scale.of(height)
    top, right = scale.px(12), width - scale.px(12)
    for caption, picture in insets:
        box = (right - picture.shape[1], top, right, top + picture.shape[0])
        cards.put(drawn, box, functools.partial(_draw_inset, caption=caption, picture=picture, scale=scale))
        top = box[3] + scale.px(12)
    return drawn


def draw_plan(state: HudState, width: int, height: int) -> np.ndarray:
    """Draws the floor plan alone, with what moves on it.

    Args:
        state: What to show.
        width: Of the picture, pixels.
        height: Likewise.

    Returns:
        uint8 array (height, width, 3).
    """
    rows, columns = state.plan.shape
    # Drawn so much larger that a cell is wide enough to draw in.
    times = max(1, *(math.ceil((_CELL * n + _RIM) / side) for n, side in ((columns, width), (rows, height))))
    drawn = np.full((times * height, times * width, 3), GROUND, np.uint8)
    chart = _chart(state.plan, times * width, times * height, alone=True)
    cards.put(drawn, chart.box, lambda region: chart.draw(region, state))
    return np.asarray(Image.fromarray(drawn).reduce(times))


def strip_top(width: int, height: int) -> int:
    """The row of pixels below which the card along the lower edge covers a frame of this size."""
    return _strip(width, height).box[1]


def inset_size(width: int, height: int) -> tuple[int, int]:
    """Width and height in pixels of an inset that leaves a frame of this size its middle."""
    inset_width = round(cards.side(width, height))
    return inset_width, round(inset_width * 0.72)


def _draw_inset(image: Image.Image, caption: str, picture: np.ndarray, scale: Scale) -> None:
    image.paste(Image.fromarray(picture))
    size, edge = scale.font(13), scale.px(2)
    ImageDraw.Draw(image).rectangle((0, 0, image.width - 1, image.height - 1), outline=GROUND, width=edge)
    write(image, (scale.px(8), image.height - scale.px(8)), caption, size, TEXT, outline=GROUND)


@functools.lru_cache(maxsize=8)
def _strip(width: int, height: int) -> Strip:
    return Strip(width, height)


@functools.lru_cache(maxsize=8)
def _chart(plan: FloorPlan, width: int, height: int, alone: bool = False) -> Chart:
    return Chart(plan, width, height, alone)


@functools.lru_cache(maxsize=8)
def _legend(plan: FloorPlan, width: int, height: int) -> Legend:
    return Legend(_chart(plan, width, height).box, height)

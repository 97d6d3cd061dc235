"""The whole display, with the legend of the overlay on the floor."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw

from caregiver_mj.caregivers.percept import HORIZON
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import GROUND, TEXT, Colour, mix
from caregiver_mj.viz.hud import cards
from caregiver_mj.viz.hud.cards import Scale, fit, write
from caregiver_mj.viz.hud.chart import Chart
from caregiver_mj.viz.hud.strip import draw_strip, strip_box
from caregiver_mj.viz.moment import SOON, Forecast, HudState

_CELL, _RIM = 8, 40  # pixels; least side of a cell, and rim of the house, in a picture of the plan alone
_OPACITY = 232  # 0 to 255
_PERCENT = (2, 10, 50, 100)  # labels of a scale
_NARROW = 150  # pixels; width of a scale up to which every other label is left out


def draw(
    frame: np.ndarray, state: HudState, insets: Sequence[tuple[str, np.ndarray]] = (), beside: bool = False
) -> np.ndarray:
    """Draw the display on a copy of a frame, uint8 (height, width, 3).

    Args:
        frame: The frame.
        state: The state to show.
        insets: Smaller views with captions, placed along the right edge from the top; `inset_size` is their best size.
        beside: Whether the plan is below the insets, instead of in the upper left corner.
    """
    height, width = frame.shape[:2]
    drawn = frame.copy()
    scale = Scale.of(height)
    chart = _chart(state.plan, width, height)
    left, above, right, below = chart.box
    if beside:
        down = sum(picture.shape[0] + scale.px(12) for _, picture in insets)
        left, above, right, below = width - right, above + down, width - left, below + down
    draw_strip(drawn, state)
    cards.put(drawn, (left, above, right, below), lambda region: chart.draw(region, state))
    if state.forecast is not None:
        _draw_legend(drawn, (left, above, right, below), state, state.forecast)
    top, right = scale.px(12), width - scale.px(12)
    for caption, picture in insets:
        box = (right - picture.shape[1], top, right, top + picture.shape[0])
        cards.put(drawn, box, functools.partial(_draw_inset, caption=caption, picture=picture, scale=scale))
        top = box[3] + scale.px(12)
    return drawn


def draw_plan(state: HudState, width: int, height: int) -> np.ndarray:
    """Return a picture of the floor plan alone with its moving things, uint8 (height, width, 3)."""
    rows, columns = state.plan.shape
    # Drawn larger if cells would be too small.
    times = max(1, *(math.ceil((_CELL * n + _RIM) / side) for n, side in ((columns, width), (rows, height))))
    drawn = np.full((times * height, times * width, 3), GROUND, np.uint8)
    chart = _chart(state.plan, times * width, times * height, alone=True)
    cards.put(drawn, chart.box, lambda region: chart.draw(region, state))
    return np.asarray(Image.fromarray(drawn).reduce(times))


def strip_top(width: int, height: int) -> int:
    """Return the first row of pixels that the card along the lower edge of a frame covers."""
    return strip_box(width, height)[1]


def inset_size(width: int, height: int) -> tuple[int, int]:
    """Return the width and height of an inset that leaves the middle of a frame free, pixels."""
    inset_width = round(cards.side(width, height))
    return inset_width, round(inset_width * 0.72)


def column_inset_size(width: int, height: int, column: int, plan: FloorPlan, legend: bool) -> tuple[int, int]:
    """Return those of an inset in a column beside the house, above the plan and, on request, its legend."""
    scale = Scale.of(height)
    margin = scale.px(12)
    _, top, _, bottom = _chart(plan, width, height).box
    room = strip_top(width, height) - 2 * margin - (bottom - top) - margin
    if legend:
        room -= _legend_height(scale) + scale.px(8)
    inset_height = max(margin, min(room, round(0.9 * (column - 2 * margin))))
    return min(column - 2 * margin, round(1.7 * inset_height)), inset_height


def _draw_inset(image: Image.Image, caption: str, picture: np.ndarray, scale: Scale) -> None:
    image.paste(Image.fromarray(picture))
    size, edge = scale.font(13), scale.px(2)
    ImageDraw.Draw(image).rectangle((0, 0, image.width - 1, image.height - 1), outline=GROUND, width=edge)
    write(image, (scale.px(8), image.height - scale.px(8)), caption, size, TEXT, outline=GROUND)


def _draw_legend(frame: np.ndarray, above: cards.Box, state: HudState, forecast: Forecast) -> None:
    """Draw the card below the chart, equally wide."""
    scale = Scale.of(len(frame))
    px, small, who = scale.px, scale.font(13), "child" if len(state.children) == 1 else "children"
    pad, key = px(10), _key_height(scale)
    left, _, right, bottom = above
    top = bottom + px(8)

    def paint(image: Image.Image) -> None:
        ground, opacity = cards.card(image.size, px(10), _OPACITY)
        card = ground.copy()
        child = f"{who} here within {SOON} timesteps", f"{who} here in {SOON}"
        _draw_key(card, scale, pad, child, colours.of_child(0) if len(state.children) == 1 else TEXT)
        hurt = f"hurt here within {HORIZON} timesteps", f"hurt here in {HORIZON}"
        _draw_key(card, scale, pad + key, hurt, colours.HARM)
        epsilons = ", ".join(f"{epsilon:.2f}" for epsilon in forecast.epsilon)
        wordings = f"it believes in epsilon {epsilons}", f"believed epsilon {epsilons}"
        write(card, (pad, card.height - pad), fit(wordings, small, card.width - 2 * pad), small, TEXT)
        image.paste(card, mask=opacity)

    cards.put(frame, (left, top, right, top + _legend_height(scale)), paint)


def _key_height(scale: Scale) -> int:
    """Return the height of a key with its scale, pixels."""
    return 2 * scale.font(13) + scale.px(24)


def _legend_height(scale: Scale) -> int:
    return 2 * _key_height(scale) + scale.font(13) + scale.px(14) + scale.px(10)


def _draw_key(card: Image.Image, scale: Scale, top: int, wordings: tuple[str, ...], colour: Colour) -> None:
    """Draw the meaning of a colour, with a scale of probability."""
    px, small, pad = scale.px, scale.font(13), scale.px(10)
    width, line = card.width - 2 * pad, top + small
    write(card, (pad, line), fit(wordings, small, width), small, TEXT)
    from_strength = np.linspace(0.0, 1.0, width)[None, :, None]
    ramp = np.array(colours.FLOOR) + (np.array(colour) - np.array(colours.FLOOR)) * from_strength
    ramp = np.broadcast_to(ramp.round().astype(np.uint8), (px(8), width, 3))
    card.paste(Image.fromarray(np.ascontiguousarray(ramp)), (pad, line + px(5)))
    for percent in _PERCENT if width > _NARROW else _PERCENT[1::2]:
        share = (percent / 100) ** 0.5  # as in `moment.strength`
        x, align = pad + share * width, 1.0 if percent == 100 else 0.5
        text = f"{percent} %" if percent == 100 else str(percent)
        ink = mix(TEXT, colours.GROUND, 0.3)
        write(card, (x, line + px(5) + px(8) + small), text, scale.font(11), ink, align)


_chart = functools.lru_cache(maxsize=8)(Chart)  # drawn once for a house and a size of frames

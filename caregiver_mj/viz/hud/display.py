"""Puts the display together, with the card that explains what is laid over the floor."""

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
from caregiver_mj.viz.forecast import SOON
from caregiver_mj.viz.hud import cards
from caregiver_mj.viz.hud.cards import Scale, fit, write
from caregiver_mj.viz.hud.chart import Chart
from caregiver_mj.viz.hud.state import HudState
from caregiver_mj.viz.hud.strip import Strip

_CELL, _RIM = 8, 40  # pixels, of a cell and of what is around the house, in the smallest picture of the plan alone
_OPACITY = 232  # of 255
_PERCENT = (2, 10, 50, 100)  # that are named


def draw(frame: np.ndarray, state: HudState, insets: Sequence[tuple[str, np.ndarray]] = ()) -> np.ndarray:
    """Draw the display on a copy of a frame.

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
    """Draw the floor plan alone, with what moves on it.

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
    """Return the row of pixels below which the card along the lower edge covers a frame of this size."""
    return _strip(width, height).box[1]


def inset_size(width: int, height: int) -> tuple[int, int]:
    """Return the width and height in pixels of an inset that leaves a frame of this size its middle."""
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
def _legend(plan: FloorPlan, width: int, height: int) -> _Legend:
    return _Legend(_chart(plan, width, height).box, height)


class _Legend:
    """The card below that of the house, as wide, in frames of some size.

    Attributes:
        box: Where it lies in the frame.
    """

    def __init__(self, above: cards.Box, height: int):
        self._scale = Scale.of(height)
        px = self._scale.px
        self._small, self._pad = self._scale.font(13), px(10)
        self._key = 2 * self._small + px(24)  # height of a key with its scale
        left, _, right, bottom = above
        size = right - left, 2 * self._key + self._small + px(14) + self._pad
        top = bottom + px(8)
        self.box = (left, top, right, top + size[1])
        self._card, self._opacity = cards.card(size, px(10), _OPACITY)

    def draw(self, image: Image.Image, state: HudState) -> None:
        card = self._card.copy()
        child = colours.of_child(0) if len(state.children) == 1 else TEXT
        who = "child" if len(state.children) == 1 else "children"
        keys = (
            ((f"{who} here within {SOON} timesteps", f"{who} here in {SOON}"), child),
            ((f"hurt here within {HORIZON} timesteps", f"hurt here in {HORIZON}"), colours.HARM),
        )
        for place, (wordings, colour) in enumerate(keys):
            self._draw_key(card, self._pad + place * self._key, wordings, colour)
        assert state.forecast is not None  # else there is no legend of it
        epsilons = ", ".join(f"{epsilon:.2f}" for epsilon in state.forecast.epsilon)
        wordings = f"it believes in epsilon {epsilons}", f"believed epsilon {epsilons}"
        text = fit(wordings, self._small, card.width - 2 * self._pad)
        write(card, (self._pad, card.height - self._pad), text, self._small, TEXT)
        image.paste(card, mask=self._opacity)

    def _draw_key(self, card: Image.Image, top: int, wordings: tuple[str, ...], colour: Colour) -> None:
        """What a colour means, and how strong it is for which probability."""
        px, width = self._scale.px, card.width - 2 * self._pad
        line = top + self._small
        write(card, (self._pad, line), fit(wordings, self._small, width), self._small, TEXT)
        from_strength = np.linspace(0.0, 1.0, width)[None, :, None]
        ramp = np.array(colours.FLOOR) + (np.array(colour) - np.array(colours.FLOOR)) * from_strength
        ramp = np.broadcast_to(ramp.round().astype(np.uint8), (px(8), width, 3))
        card.paste(Image.fromarray(np.ascontiguousarray(ramp)), (self._pad, line + px(5)))
        for percent in _PERCENT:
            share = (percent / 100) ** 0.5  # as in `forecast.strength`
            x, align = self._pad + share * width, 1.0 if percent == 100 else 0.5
            text = f"{percent} %" if percent == 100 else str(percent)
            ink = mix(TEXT, colours.GROUND, 0.3)
            write(card, (x, line + px(5) + px(8) + self._small), text, self._scale.font(11), ink, align)

"""The card along the lower edge: time and P(safe) on the left, expected danger, then deeds and damage on the right."""

from __future__ import annotations

from PIL import Image

from caregiver_mj.viz.hud import cards
from caregiver_mj.viz.hud.area import Area
from caregiver_mj.viz.hud.bars import draw_bars
from caregiver_mj.viz.hud.deeds import draw_deeds
from caregiver_mj.viz.hud.gauges import draw_gauges
from caregiver_mj.viz.hud.state import HudState
from caregiver_mj.viz.hud.text import Scale

_OPACITY = 210  # of 255


class Strip:
    """The card of a frame of some size.

    Attributes:
        box: Where it lies in the frame.
    """

    def __init__(self, width: int, height: int):
        scale = Scale.of(height)
        px = scale.px
        margin, pad, top = px(12), px(16), px(14)
        card_height = 2 * Area(0, 0, 0, 0, scale).row + 2 * top
        self.box = (margin, height - margin - card_height, width - margin, height - margin)
        self._card, self._opacity = cards.card((width - 2 * margin, card_height), px(10), _OPACITY)
        left_width, right_width, gap = px(220), px(290), px(32)
        right = self._card.width - pad
        edges = (
            (pad, pad + left_width),
            (pad + left_width + gap, right - right_width - gap),
            (right - right_width, right),
        )
        self._left, self._middle, self._right = (Area(*edge, top, card_height - top, scale) for edge in edges)

    def draw(self, image: Image.Image, state: HudState) -> None:
        image.paste(self._card, mask=self._opacity)
        draw_gauges(image, self._left, state)
        draw_bars(image, self._middle, state)
        draw_deeds(image, self._right, state)

"""The card that explains what is laid over the floor."""

from __future__ import annotations

import numpy as np
from PIL import Image

from caregiver_mj.caregivers.outlook import HORIZON
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import TEXT, Colour, mix
from caregiver_mj.viz.forecast import SOON
from caregiver_mj.viz.hud import cards
from caregiver_mj.viz.hud.state import HudState
from caregiver_mj.viz.hud.text import Scale, fit, write

_OPACITY = 232  # of 255
_PERCENT = (2, 10, 50, 100)  # that are named


class Legend:
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

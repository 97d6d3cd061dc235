"""Expected danger of every hazard, as bars."""

from __future__ import annotations

import numpy as np
from PIL import Image

from caregiver_mj.plans.hazards import Hazard
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import GROUND, TEXT, mix
from caregiver_mj.viz.hud.area import Area
from caregiver_mj.viz.hud.cards import LABEL, TRACK
from caregiver_mj.viz.hud.state import HudState
from caregiver_mj.viz.hud.text import fit, width_of, write

_FULL_BAR = 1.0  # expected danger of a full bar, unless one is greater


def draw_bars(image: Image.Image, area: Area, state: HudState) -> None:
    """Draws the bars of all hazards, or of the greatest ones if there is not room for all."""
    danger = np.empty(0) if state.danger is None else np.asarray(state.danger, float)
    unsafe = danger if state.unsafe_danger is None else np.asarray(state.unsafe_danger, float)
    shown = _shown(area, unsafe, state.target)
    title = "EXPECTED DANGER" if len(shown) == len(danger) else f"EXPECTED DANGER, {len(shown)} OF {len(danger)}"
    titles = (title,) if state.unsafe_danger is None else (f"{title}   outlined: if surely unsafe", title)
    write(image, (area.left, area.top + area.small), fit(titles, area.small, area.width), area.small, LABEL)
    if not len(danger):
        write(image, (area.left, area.bottom), "not estimated", area.small, TEXT)
        return
    bars = _Bars(image, area, len(shown), full=max(_FULL_BAR, unsafe.max(), danger.max()))
    for place, number in enumerate(shown.tolist()):
        hazard = state.plan.hazards[number]
        bars.draw(place, hazard, danger[number], unsafe[number], is_target=number == state.target)


def _shown(area: Area, unsafe: np.ndarray, target: int) -> np.ndarray:
    """Numbers of the hazards for which there is room."""
    room = area.width // (width_of("C88", area.small) + area.scale.px(8))
    if len(unsafe) <= room:
        return np.arange(len(unsafe))
    rank = np.where(np.arange(len(unsafe)) == target, np.inf, unsafe)  # the target is always in sight
    return np.sort(np.argsort(-rank, kind="stable")[:room])


class _Bars:
    """A row of bars with the names of the hazards below."""

    def __init__(self, image: Image.Image, area: Area, count: int, full: float):
        px = area.scale.px
        self._image, self._area, self._full = image, area, full
        self._base, self._ceiling = area.bottom - area.small - px(6), area.top + 2 * area.small + px(6)
        self._pitch = min(area.width / count, px(84))
        self._width = min(round(self._pitch * 0.62), px(38))

    def draw(self, place: int, hazard: Hazard, danger: float, unsafe: float, is_target: bool) -> None:
        """Draws a bar, and the outline of what it would be if the children were surely unsafe."""
        image, base = self._image, self._base
        colour = colours.HAZARDS[hazard.kind]
        colour = colour if is_target else mix(colour, GROUND, 0.4)
        left = round(self._area.left + self._pitch * place + (self._pitch - self._width) / 2)
        right = left + self._width
        top, outline = (base - round((base - self._ceiling) * value / self._full) for value in (danger, unsafe))
        image.paste(TRACK, (left, base, right, base + 1))
        if outline < base:
            image.paste(colour, (left, outline, right, base))
            image.paste(GROUND, (left + 1, min(outline + 1, base), right - 1, base))
        image.paste(colour, (left, top, right, base))
        middle = left + self._width / 2
        if is_target:
            self._emphasise(middle, min(top, outline), hazard.label, danger)
        ink = GROUND if is_target else LABEL
        write(image, (middle, self._area.bottom), hazard.label, self._area.small, ink, align=0.5)

    def _emphasise(self, middle: float, top: int, name: str, danger: float) -> None:
        """Writes the value above a bar, and makes the ground of its name bright."""
        area, px = self._area, self._area.scale.px
        write(self._image, (middle, top - px(3)), _few_digits(danger), area.small, TEXT, align=0.5)
        half = width_of(name, area.small) // 2 + px(4)
        ground = (round(middle) - half, self._base + px(3), round(middle) + half, area.bottom + px(4))
        self._image.paste(TEXT, ground)


def _few_digits(danger: float) -> str:
    if danger == 0.0:
        return ""  # nobody can bump into a candle in the robot's hand
    return f"{danger:.2f}" if danger >= 0.005 else "< 0.01"

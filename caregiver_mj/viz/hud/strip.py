"""The card along the lower edge: time and P(safe) on the left, expected danger, then deeds and damage on the right."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from PIL import Image

from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.plans.hazards import Hazard
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import GROUND, TEXT, Colour, mix
from caregiver_mj.viz.hud import cards
from caregiver_mj.viz.hud.cards import LABEL, TRACK, Area, Scale, fit, width_of, write
from caregiver_mj.viz.hud.state import ChildState, HudState

_OPACITY = 210  # of 255
_SAFE = "P(SAFE)"
_FULL_BAR = 1.0  # expected danger of a full bar, unless one is greater


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
        _draw_gauges(image, self._left, state)
        _draw_bars(image, self._middle, state)
        _draw_deeds(image, self._right, state)


def _draw_gauges(image: Image.Image, area: Area, state: HudState) -> None:
    """Draw the timestep above P(safe), which is that of each child."""
    elapsed = state.timestep / EPISODE_TIMESTEPS
    _gauge(image, area, area.top, "TIMESTEP", f"{state.timestep} / {EPISODE_TIMESTEPS}", elapsed, LABEL)
    lower = area.top + area.row
    safe = state.children[0].safe
    if all(child.safe is None for child in state.children):
        _gauge(image, area, lower, _SAFE, "not estimated", 0.0, colours.ROBOT)
    elif len(state.children) == 1 and safe is not None:
        _gauge(image, area, lower, _SAFE, f"{safe:.2f}", safe, colours.ROBOT)
    else:
        _gauges(image, area, lower, state.children)


def _gauge(image: Image.Image, area: Area, top: int, label: str, value: str, share: float, colour: Colour) -> None:
    """A label, its value, and below them a bar that is filled to a share."""
    line = top + area.medium
    write(image, (area.left, line), label, area.small, LABEL)
    write(image, (area.right, line), value, area.medium if share else area.small, TEXT, align=1)
    _bar(image, area, line, area.left, area.right, share, colour)


def _gauges(image: Image.Image, area: Area, top: int, children: tuple[ChildState, ...]) -> None:
    """One label, and beside it a narrow gauge for each child: its number, its value if there is room, and its bar."""
    small, gap, line = area.small, area.scale.px(8), top + area.medium
    start, label = area.left, width_of(_SAFE, small) + gap
    if label + len(children) * (width_of("8", small) + gap) <= area.width:
        write(image, (start, line), _SAFE, small, LABEL)
        start += label
    pitch = (area.right - start + gap) / len(children)
    for place, child in enumerate(children):
        left, right = round(start + place * pitch), round(start + (place + 1) * pitch) - gap
        number, colour = str(place + 1), colours.of_child(place)
        write(image, (left, line), number, small, colour)
        value = _value(child.safe, small, right - left - width_of(f"{number} ", small))
        write(image, (right, line), value, small, TEXT, align=1)
        _bar(image, area, line, left, right, child.safe or 0.0, colour)


def _value(safe: float | None, size: int, width: int) -> str:
    """A probability as exactly as there is room for."""
    wordings = () if safe is None else (f"{safe:.2f}", f"{safe:.2f}".lstrip("0"), f"{safe:.1f}".lstrip("0"))
    return next((wording for wording in wordings if width_of(wording, size) <= width), "")


def _bar(image: Image.Image, area: Area, line: int, left: int, right: int, share: float, colour: Colour) -> None:
    """A bar below a line of text."""
    top, filled = line + area.scale.px(8), left + round((right - left) * min(max(share, 0.0), 1.0))
    image.paste(TRACK, (left, top, right, top + area.scale.px(6)))
    image.paste(colour, (left, top, filled, top + area.scale.px(6)))


def _draw_bars(image: Image.Image, area: Area, state: HudState) -> None:
    """Draw the bars of all hazards, or of the greatest ones if there is not room for all."""
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
        """Draw a bar, and the outline of what it would be if the children were surely unsafe."""
        image, base = self._image, self._base
        colour = hazard.kind.colour
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
        """Write the value above a bar, and make the ground of its name bright."""
        area, px = self._area, self._area.scale.px
        write(self._image, (middle, top - px(3)), _few_digits(danger), area.small, TEXT, align=0.5)
        half = width_of(name, area.small) // 2 + px(4)
        ground = (round(middle) - half, self._base + px(3), round(middle) + half, area.bottom + px(4))
        self._image.paste(TEXT, ground)


def _few_digits(danger: float) -> str:
    if danger == 0.0:
        return ""  # nobody can bump into a candle in the robot's hand
    return f"{danger:.2f}" if danger >= 0.005 else "< 0.01"


def _draw_deeds(image: Image.Image, area: Area, state: HudState) -> None:
    """Draw the caregiver's intervention above the damage: the sum, that of each child, and that of each kind."""
    small, medium, px = area.small, area.medium, area.scale.px
    who = "CAREGIVER" if state.robot is not None else "NO CAREGIVER"
    line = area.top + small
    write(image, (area.left, line), who, small, LABEL)
    deed = fit((state.intervention,), medium, area.width)
    write(image, (area.left, line + px(8) + medium), deed, medium, colours.ROBOT)

    write(image, (area.left, area.bottom), "DAMAGE", small, LABEL)
    x = area.left + width_of("DAMAGE", small) + px(8)
    total = f"{state.damage:g}"
    write(image, (x, area.bottom), total, area.large, colours.DAMAGE if state.damage else TEXT)
    x += width_of(total, area.large)
    if len(state.children) > 1:
        x = _write_children(image, area, x + px(10), state)
    if state.damages:
        _write_kinds(image, area, x + px(10), state.damages, len(state.children) > 1)


def _write_children(image: Image.Image, area: Area, x: int, state: HudState) -> int:
    """Write the damage of each child, in its colour; return where that ends."""
    for number, child in enumerate(state.children):
        text = f"{number + 1}: {child.damage:g}"
        if x + width_of(text, area.small) > area.right:
            write(image, (x, area.bottom), "...", area.small, LABEL)
            return area.right
        write(image, (x, area.bottom), text, area.small, colours.of_child(number))
        x += width_of(text, area.small) + area.scale.px(8)
    return x


def _write_kinds(image: Image.Image, area: Area, x: int, damages: Mapping[str, float], several: bool) -> None:
    """Write the damage of each kind from the right: in words, or else by their first letters."""
    wordings = tuple(
        "   ".join(f"{kind[:letters].capitalize()} {value:g}" for kind, value in damages.items()) for letters in (9, 1)
    )
    if several and width_of(wordings[-1], area.small) > area.right - x:
        return  # the children's own figures have taken the room
    text = fit(wordings, area.small, area.right - x)
    write(image, (area.right, area.bottom), text, area.small, LABEL, align=1)

"""The card along the lower edge, from left: timestep and P(safe), expected danger, intervention and damage."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from PIL import Image

from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import GROUND, TEXT, Colour, mix
from caregiver_mj.viz.hud import cards
from caregiver_mj.viz.hud.cards import LABEL, TRACK, Area, Box, Scale, fit, width_of, write
from caregiver_mj.viz.moment import ChildState, HudState

_OPACITY = 210  # 0 to 255
_SAFE = "P(SAFE)"
_FULL_BAR = 1.0  # expected danger of a full bar, unless another is greater


def strip_box(width: int, height: int) -> Box:
    """Return the box of the card in a frame of a size in pixels."""
    scale = Scale.of(height)
    margin, card_height = scale.px(12), 2 * Area(0, 0, 0, 0, scale).row + 2 * scale.px(14)
    return margin, height - margin - card_height, width - margin, height - margin


def draw_strip(frame: np.ndarray, state: HudState) -> None:
    """Draw the card on a frame, uint8 (height, width, 3)."""
    scale = Scale.of(len(frame))
    px = scale.px

    def paint(image: Image.Image) -> None:
        card, opacity = cards.card(image.size, px(10), _OPACITY)
        image.paste(card, mask=opacity)
        left, right, top = px(16), image.width - px(16), px(14)
        for draw, start, end in (
            (_draw_gauges, left, left + px(220)),
            (_draw_bars, left + px(220) + px(32), right - px(290) - px(32)),
            (_draw_deeds, right - px(290), right),
        ):
            draw(image, Area(start, end, top, image.height - top, scale), state)

    cards.put(frame, strip_box(frame.shape[1], len(frame)), paint)


def _draw_gauges(image: Image.Image, area: Area, state: HudState) -> None:
    """Draw the timestep, and below it P(safe) of each child."""
    elapsed = state.timestep / EPISODE_TIMESTEPS
    _gauge(image, area, area.top, "TIMESTEP", f"{state.timestep} / {EPISODE_TIMESTEPS}", elapsed, LABEL)
    lower = area.top + area.row
    safe = state.children[0].safe
    if len(state.children) > 1 and any(child.safe is not None for child in state.children):
        _gauges(image, area, lower, state.children)
    elif safe is not None:
        _gauge(image, area, lower, _SAFE, f"{safe:.2f}", safe, colours.ROBOT)


def _gauge(image: Image.Image, area: Area, top: int, label: str, value: str, share: float, colour: Colour) -> None:
    line = top + area.medium
    write(image, (area.left, line), label, area.small, LABEL)
    write(image, (area.right, line), value, area.medium if share else area.small, TEXT, align=1)
    _bar(image, area, line, area.left, area.right, share, colour)


def _gauges(image: Image.Image, area: Area, top: int, children: tuple[ChildState, ...]) -> None:
    """Draw a label, and beside it a narrow gauge for each child: number, value if there is room, and bar."""
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
    wordings = () if safe is None else (f"{safe:.2f}", f"{safe:.2f}".lstrip("0"), f"{safe:.1f}".lstrip("0"))
    return next((wording for wording in wordings if width_of(wording, size) <= width), "")


def _bar(image: Image.Image, area: Area, line: int, left: int, right: int, share: float, colour: Colour) -> None:
    top, filled = line + area.scale.px(8), left + round((right - left) * min(max(share, 0.0), 1.0))
    image.paste(TRACK, (left, top, right, top + area.scale.px(6)))
    image.paste(colour, (left, top, filled, top + area.scale.px(6)))


def _draw_bars(image: Image.Image, area: Area, state: HudState) -> None:
    """Draw the bars of all hazards, or of the greatest ones if room is scarce; none without an estimate."""
    danger = np.empty(0) if state.danger is None else np.asarray(state.danger, float)
    if not len(danger):
        return
    unsafe = danger if state.unsafe_danger is None else np.asarray(state.unsafe_danger, float)
    shown = _shown(area, unsafe, state.target)
    title = "EXPECTED DANGER" if len(shown) == len(danger) else f"EXPECTED DANGER, {len(shown)} OF {len(danger)}"
    titles = (title,) if state.unsafe_danger is None else (f"{title}   outlined: if surely unsafe", title)
    write(image, (area.left, area.top + area.small), fit(titles, area.small, area.width), area.small, LABEL)
    px, full = area.scale.px, max(_FULL_BAR, unsafe.max(), danger.max())
    base, ceiling = area.bottom - area.small - px(6), area.top + 2 * area.small + px(6)
    pitch = min(area.width / len(shown), px(84))
    width = min(round(pitch * 0.62), px(38))
    for place, number in enumerate(shown.tolist()):
        hazard, is_target = state.plan.hazards[number], number == state.target
        colour = hazard.kind.colour if is_target else mix(hazard.kind.colour, GROUND, 0.4)
        left = round(area.left + pitch * place + (pitch - width) / 2)
        right, middle = left + width, left + width / 2
        top, outline = (base - round((base - ceiling) * value / full) for value in (danger[number], unsafe[number]))
        image.paste(TRACK, (left, base, right, base + 1))
        if outline < base:  # at P(safe) = 0
            image.paste(colour, (left, outline, right, base))
            image.paste(GROUND, (left + 1, min(outline + 1, base), right - 1, base))
        image.paste(colour, (left, top, right, base))
        if is_target:  # with its value above the bar, and its name on a bright ground
            value = _few_digits(danger[number])
            write(image, (middle, min(top, outline) - px(3)), value, area.small, TEXT, align=0.5)
            half = width_of(hazard.label, area.small) // 2 + px(4)
            image.paste(TEXT, (round(middle) - half, base + px(3), round(middle) + half, area.bottom + px(4)))
        ink = GROUND if is_target else LABEL
        write(image, (middle, area.bottom), hazard.label, area.small, ink, align=0.5)


def _shown(area: Area, unsafe: np.ndarray, target: int) -> np.ndarray:
    room = area.width // (width_of("C88", area.small) + area.scale.px(8))
    if len(unsafe) <= room:
        return np.arange(len(unsafe))
    rank = np.where(np.arange(len(unsafe)) == target, np.inf, unsafe)  # the target is always shown
    return np.sort(np.argsort(-rank, kind="stable")[:room])


def _few_digits(danger: float) -> str:
    if danger == 0.0:
        return ""  # as for a candle in the robot's hand
    return f"{danger:.2f}" if danger >= 0.005 else "< 0.01"


def _draw_deeds(image: Image.Image, area: Area, state: HudState) -> None:
    """Draw the caregiver's intervention, and below it the damage: the sum, of each child, and of each kind."""
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
        _write_kinds(image, area, x + px(10), state.damages)


def _write_children(image: Image.Image, area: Area, x: int, state: HudState) -> int:
    """Write the damage of each child in its colour; return the x of its end."""
    for number, child in enumerate(state.children):
        text = f"{number + 1}: {child.damage:g}"
        if x + width_of(text, area.small) > area.right:
            write(image, (x, area.bottom), "...", area.small, LABEL)
            return area.right
        write(image, (x, area.bottom), text, area.small, colours.of_child(number))
        x += width_of(text, area.small) + area.scale.px(8)
    return x


def _write_kinds(image: Image.Image, area: Area, x: int, damages: Mapping[str, float]) -> None:
    """Write the damage of each kind with any, right-aligned, as many as there is room for."""
    done = sorted((item for item in damages.items() if item[1]), key=lambda item: -item[1])
    each = [f"{kind.capitalize()} {value:g}" for kind, value in done]
    texts = ["   ".join(each[:count]) for count in range(len(each), -1, -1)]
    text = next(text for text in texts if not text or width_of(text, area.small) <= area.right - x)
    write(image, (area.right, area.bottom), text, area.small, LABEL, align=1)

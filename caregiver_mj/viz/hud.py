"""The head-up display: the caregiver's knowledge and actions, drawn on a rendered frame.

A card in the upper left corner shows the floor plan. One along the lower edge shows, from the left, timestep and
P(safe), expected danger, intervention and damage.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw

from caregiver_mj.caregivers.percept import HORIZON
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz import colours
from caregiver_mj.viz.chart import (
    CARD_OPACITY,
    LABEL,
    TRACK,
    Box,
    Chart,
    Scale,
    card_mask,
    fit,
    inset_width,
    paint_on,
    width_of,
    write,
)
from caregiver_mj.viz.colours import GROUND, TEXT, Colour, mix
from caregiver_mj.viz.moment import SOON, ChildState, Forecast, HudState

_CELL, _RIM = 8, 40  # pixels; least side of a cell, and rim of the house, in a picture of the plan alone
_PERCENT = (2, 10, 50, 100)  # labels of a scale
_NARROW = 150  # pixels; width of a scale up to which every other label is left out
_STRIP_OPACITY = 210  # 0 to 255
_SAFE = "P(SAFE)"
_FULL_BAR = 1.0  # expected danger of a full bar, unless another is greater
_chart = functools.lru_cache(maxsize=8)(Chart)  # drawn once for a house and a size of frames


class Layout(NamedTuple):
    """Where the parts of the display are in a frame, pixels."""

    plan: Box
    legend: Box  # of the overlay on the floor
    corner: tuple[int, int]  # right and top of the first inset; others are below it
    inset: tuple[int, int]  # best width and height of an inset


def layout(plan: FloorPlan, width: int, height: int, legend: bool, column: int = 0, row: int = 0) -> Layout:
    """Return the layout in a frame of a size, with room for the legend on request.

    The plan is in the upper left corner, with the legend below it; insets are along the right edge, so small that the
    middle stays free. A free column to the right of the house, or a free row below it, takes all three instead: from
    the right side by side if it is wider than high, else one below the other with the plan at the lower end.
    """
    scale, box, lower = Scale(height), _chart(plan, width, height).box, strip_top(width, height)
    margin, gap = scale.px(12), scale.px(8)
    legend_height = 2 * _key_height(scale) + scale.small + scale.px(14) + scale.px(10)
    across, down = box[2] - box[0], box[3] - box[1]
    room = (column, lower) if column else (width, row)
    right, top = width - margin, lower - room[1] + margin
    left = right - across
    if not (column or row):
        left, top, wide = margin, margin, round(inset_width(width, height))
        begin, corner, inset = (left, top + down + gap), (right, top), (wide, round(0.72 * wide))
    elif room[0] > room[1]:
        begin = left - margin - across, top
        corner = (begin[0] if legend else left) - margin, top
        inset = corner[0] - margin - (width - room[0]), room[1] - 2 * margin
    else:
        corner, top = (right, top), lower - margin - (legend_height + gap if legend else 0) - down
        begin, room_across = (left, top + down + gap), room[0] - 2 * margin
        inset_height = max(margin, min(top - 2 * margin, round(0.9 * room_across)))
        inset = min(room_across, round(1.7 * inset_height)), inset_height
    legend_box = *begin, begin[0] + across, begin[1] + legend_height
    return Layout((left, top, left + across, top + down), legend_box, corner, inset)


def draw(
    frame: np.ndarray,
    state: HudState,
    insets: Sequence[tuple[str, np.ndarray]] = (),
    column: int = 0,
    row: int = 0,
) -> np.ndarray:
    """Draw the display on a copy of a frame, uint8 (height, width, 3), in its `layout`.

    Insets are smaller views with captions. The frame has nothing to show in a column to the right, or a row below.
    """
    height, width = frame.shape[:2]
    drawn, places = frame.copy(), layout(state.plan, width, height, state.forecast is not None, column, row)
    scale, chart = Scale(height), _chart(state.plan, width, height)
    _draw_strip(drawn, state)
    paint_on(drawn, places.plan, lambda region: chart.draw(region, state))
    if state.forecast is not None:
        paint_on(drawn, places.legend, functools.partial(_draw_legend, forecast=state.forecast, scale=scale))
    right, top = places.corner
    for caption, picture in insets:
        box = (right - picture.shape[1], top, right, top + picture.shape[0])
        paint_on(drawn, box, functools.partial(_draw_inset, caption=caption, picture=picture, scale=scale))
        top = box[3] + scale.px(12)
    return drawn


def draw_tag(picture: np.ndarray, tip: tuple[float, float] | None, label: str, height: int) -> None:
    """Draw a name in a picture, with a tip that points to a pixel, if any; sized for a frame of a height."""
    if tip is None:
        return
    scale = Scale(height)
    size, pad = scale.small, scale.px(8)
    width, tall = width_of(label, size) + pad, size + pad
    x = min(max(round(tip[0]), width // 2), picture.shape[1] - width // 2 - 1)
    top = max(round(tip[1]) - tall - pad, 0)

    def paint(image: Image.Image) -> None:
        canvas, middle, point = ImageDraw.Draw(image), image.width // 2, image.width // 2 + round(tip[0]) - x
        for colour, rim in ((GROUND, 1), (TEXT, 0)):
            canvas.polygon([(middle - pad, tall), (middle + pad, tall), (point, image.height - 2 + rim)], colour)
            canvas.rectangle((1 - rim, 1 - rim, image.width - 2 + rim, tall - 1 + rim), colour)
        write(image, (middle, tall - pad // 2 - 1), label, size, GROUND, align=0.5)

    paint_on(picture, (x - width // 2, top, x + width // 2 + 1, min(top + tall + pad, len(picture))), paint)


def draw_plan(state: HudState, width: int, height: int) -> np.ndarray:
    """Return a picture of the floor plan alone with its moving things, uint8 (height, width, 3)."""
    rows, columns = state.plan.shape
    # Drawn larger if cells would be too small.
    times = max(1, *(math.ceil((_CELL * n + _RIM) / side) for n, side in ((columns, width), (rows, height))))
    drawn = np.full((times * height, times * width, 3), GROUND, np.uint8)
    chart = _chart(state.plan, times * width, times * height, alone=True)
    paint_on(drawn, chart.box, lambda region: chart.draw(region, state))
    return np.asarray(Image.fromarray(drawn).reduce(times))


def strip_top(width: int, height: int) -> int:
    """Return the first row of pixels that the card along the lower edge of a frame covers."""
    return _strip_box(width, height)[1]


def _draw_inset(image: Image.Image, caption: str, picture: np.ndarray, scale: Scale) -> None:
    image.paste(Image.fromarray(picture))
    size, pad = scale.small, scale.px(8)
    canvas = ImageDraw.Draw(image)
    canvas.rectangle((0, 0, image.width - 1, image.height - 1), outline=GROUND, width=scale.px(2))
    # On a ground of its own, with room for descenders.
    canvas.rectangle((0, image.height - size - pad - 1, width_of(caption, size) + pad, image.height), GROUND)
    write(image, (pad // 2 + 1, image.height - pad), caption, size, TEXT)


# -- The legend of the overlay on the floor ------------------------------------------------------------


def _draw_legend(image: Image.Image, forecast: Forecast, scale: Scale) -> None:
    card, one = Image.new("RGB", image.size, GROUND), len(forecast.epsilon) == 1
    small, pad, who = scale.small, scale.px(10), "child" if one else "children"
    child = f"{who} here within {SOON} timesteps", f"{who}, {SOON} timesteps"
    _draw_key(card, scale, pad, child, colours.of_child(0) if one else TEXT)
    hurt = f"hurt here within {HORIZON} timesteps", f"hurt, {HORIZON} timesteps"
    _draw_key(card, scale, pad + _key_height(scale), hurt, colours.HARM)
    epsilons = ", ".join(f"{epsilon:.2f}" for epsilon in forecast.epsilon)
    wordings = f"it believes in epsilon {epsilons}", f"believed epsilon {epsilons}"
    write(card, (pad, card.height - pad), fit(wordings, small, card.width - 2 * pad), small, TEXT)
    image.paste(card, mask=card_mask(image.size, pad, CARD_OPACITY))


def _key_height(scale: Scale) -> int:
    """Return the height of a key with its scale, pixels."""
    return 2 * scale.small + scale.px(24)


def _draw_key(card: Image.Image, scale: Scale, top: int, wordings: tuple[str, ...], colour: Colour) -> None:
    """Draw the meaning of a colour, with a scale of probability."""
    px, small, pad = scale.px, scale.small, scale.px(10)
    width, line = card.width - 2 * pad, top + small
    write(card, (pad, line), fit(wordings, small, width), small, TEXT)
    ramp = np.linspace(colours.FLOOR, colour, width).round().astype(np.uint8)[None].repeat(px(8), axis=0)
    card.paste(Image.fromarray(ramp), (pad, line + px(5)))
    for percent in _PERCENT if width > _NARROW else _PERCENT[1::2]:
        share = (percent / 100) ** 0.5  # as in `moment`
        text, align = (f"{percent} %", 1.0) if percent == 100 else (str(percent), 0.5)
        below = pad + share * width, line + px(5) + px(8) + small
        write(card, below, text, scale.font(11), mix(TEXT, GROUND, 0.3), align)


# -- The card along the lower edge ---------------------------------------------------------------------


class Area(NamedTuple):
    """An area of two rows of text, in pixels, from the top of the upper one to the baseline of the lower."""

    left: int
    right: int
    top: int
    bottom: int
    scale: Scale

    @property
    def width(self) -> int:
        return self.right - self.left


def _row(scale: Scale) -> int:
    """Return the distance of the two rows."""
    return scale.small + scale.medium + scale.px(14)


def _strip_box(width: int, height: int) -> Box:
    """Return the box of the card in a frame of a size in pixels."""
    scale = Scale(height)
    margin = scale.px(12)
    return margin, height - margin - 2 * _row(scale) - 2 * scale.px(14), width - margin, height - margin


def _draw_strip(frame: np.ndarray, state: HudState) -> None:
    scale = Scale(len(frame))
    px = scale.px

    def paint(image: Image.Image) -> None:
        image.paste(GROUND, mask=card_mask(image.size, px(10), _STRIP_OPACITY))
        left, right, top = px(16), image.width - px(16), px(14)
        for draw, start, end in (
            (_draw_gauges, left, left + px(220)),
            (_draw_bars, left + px(220) + px(32), right - px(290) - px(32)),
            (_draw_deeds, right - px(290), right),
        ):
            draw(image, Area(start, end, top, image.height - top, scale), state)

    paint_on(frame, _strip_box(frame.shape[1], len(frame)), paint)


def _draw_gauges(image: Image.Image, area: Area, state: HudState) -> None:
    """Draw the timestep, and below it P(safe) of each child."""
    elapsed = state.timestep / EPISODE_TIMESTEPS
    _gauge(image, area, area.top, "TIMESTEP", f"{state.timestep} / {EPISODE_TIMESTEPS}", elapsed, LABEL)
    lower = area.top + _row(area.scale)
    safe = state.children[0].safe
    if len(state.children) > 1 and any(child.safe is not None for child in state.children):
        _gauges(image, area, lower, state.children)
    elif safe is not None:
        _gauge(image, area, lower, _SAFE, f"{safe:.2f}", safe, colours.ROBOT)


def _gauge(image: Image.Image, area: Area, top: int, label: str, value: str, share: float, colour: Colour) -> None:
    line = top + area.scale.medium
    write(image, (area.left, line), label, area.scale.small, LABEL)
    write(image, (area.right, line), value, area.scale.medium if share else area.scale.small, TEXT, align=1)
    _bar(image, area, line, area.left, area.right, share, colour)


def _gauges(image: Image.Image, area: Area, top: int, children: tuple[ChildState, ...]) -> None:
    """Draw a label, and beside it a narrow gauge for each child: number, value if there is room, and bar."""
    small, gap, line = area.scale.small, area.scale.px(8), top + area.scale.medium
    start, label = area.left, width_of(_SAFE, small) + gap
    if label + len(children) * (width_of("8", small) + gap) <= area.width:
        write(image, (start, line), _SAFE, small, LABEL)
        start += label
    pitch = (area.right - start + gap) / len(children)
    for place, child in enumerate(children):
        left, right = round(start + place * pitch), round(start + (place + 1) * pitch) - gap
        number, colour = str(place + 1), colours.of_child(place)
        write(image, (left, line), number, small, colour)
        room = right - left - width_of(f"{number} ", small)
        safe, coarse = ("", "") if child.safe is None else (f"{child.safe:.2f}", f"{child.safe:.1f}")
        value = _first_fit((safe, safe.lstrip("0"), coarse.lstrip("0")), small, room)
        write(image, (right, line), value, small, TEXT, align=1)
        _bar(image, area, line, left, right, child.safe or 0.0, colour)


def _first_fit(texts: Iterable[str], size: int, width: int) -> str:
    return next((text for text in texts if width_of(text, size) <= width), "")


def _bar(image: Image.Image, area: Area, line: int, left: int, right: int, share: float, colour: Colour) -> None:
    top, filled = line + area.scale.px(8), left + round((right - left) * min(max(share, 0.0), 1.0))
    image.paste(TRACK, (left, top, right, top + area.scale.px(6)))
    image.paste(colour, (left, top, filled, top + area.scale.px(6)))


def _draw_bars(image: Image.Image, area: Area, state: HudState) -> None:
    """Draw the bars of all hazards, or of the greatest ones if room is scarce; none without an estimate."""
    danger = np.empty(0) if state.danger is None else np.asarray(state.danger, float)
    if not len(danger):
        return
    px, small = area.scale.px, area.scale.small
    unsafe = danger if state.unsafe_danger is None else np.asarray(state.unsafe_danger, float)
    shown = _shown(area, unsafe, state.target)
    title = "EXPECTED DANGER" if len(shown) == len(danger) else f"EXPECTED DANGER, {len(shown)} OF {len(danger)}"
    titles = (title,) if state.unsafe_danger is None else (f"{title}   outlined: if surely unsafe", title)
    write(image, (area.left, area.top + small), fit(titles, small, area.width), small, LABEL)
    full = max(_FULL_BAR, unsafe.max(), danger.max())
    base, ceiling = area.bottom - small - px(6), area.top + 2 * small + px(6)
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
            value = f"{danger[number]:.2f}" if danger[number] >= 0.005 else "< 0.01" if danger[number] else ""
            write(image, (middle, min(top, outline) - px(3)), value, small, TEXT, align=0.5)
            half = width_of(hazard.label, small) // 2 + px(4)
            image.paste(TEXT, (round(middle) - half, base + px(3), round(middle) + half, area.bottom + px(4)))
        ink = GROUND if is_target else LABEL
        write(image, (middle, area.bottom), hazard.label, small, ink, align=0.5)


def _shown(area: Area, unsafe: np.ndarray, target: int) -> np.ndarray:
    room = area.width // (width_of("C88", area.scale.small) + area.scale.px(8))
    rank = np.where(np.arange(len(unsafe)) == target, np.inf, unsafe)  # the target is always shown
    return np.sort(np.argsort(-rank, kind="stable")[:room])


def _draw_deeds(image: Image.Image, area: Area, state: HudState) -> None:
    """Draw the caregiver's intervention, and below it the damage: the sum, of each child, and of each kind."""
    small, medium, px = area.scale.small, area.scale.medium, area.scale.px
    who = "CAREGIVER" if state.robot is not None else "NO CAREGIVER"
    line = area.top + small
    write(image, (area.left, line), who, small, LABEL)
    deed = fit((state.intervention,), medium, area.width)
    write(image, (area.left, line + px(8) + medium), deed, medium, colours.ROBOT)
    write(image, (area.left, area.bottom), "DAMAGE", small, LABEL)
    x = area.left + width_of("DAMAGE", small) + px(8)
    total = f"{state.damage:g}"
    write(image, (x, area.bottom), total, area.scale.large, colours.DAMAGE if state.damage else TEXT)
    x += width_of(total, area.scale.large) + px(10)
    for number, child in enumerate(state.children if len(state.children) > 1 else ()):
        text = f"{number + 1}: {child.damage:g}"
        if x + width_of(text, small) > area.right:
            write(image, (x, area.bottom), "...", small, LABEL)
            return
        write(image, (x, area.bottom), text, small, colours.of_child(number))
        x += width_of(text, small) + px(8)
    _write_kinds(image, area, x + (px(10) if len(state.children) > 1 else 0), state.damages or {})


def _write_kinds(image: Image.Image, area: Area, x: int, damages: Mapping[str, float]) -> None:
    """Write the damage of each kind with any, right-aligned, as many as there is room for; dots stand for others."""
    done = sorted((item for item in damages.items() if item[1]), key=lambda item: -item[1])
    each = [f"{kind.capitalize()} {value:g}" for kind, value in done]
    fewer = ([*each[:count], "..."] for count in range(len(each) - 1, 0, -1))
    text = _first_fit(map("   ".join, [each, *fewer]), area.scale.small, area.right - x)
    write(image, (area.right, area.bottom), text, area.scale.small, LABEL, align=1)

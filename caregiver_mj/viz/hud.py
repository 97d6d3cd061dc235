"""The head-up display: what the caregiver knows and does, drawn on a rendered frame.

A card along the lower edge shows the numbers of the moment, another in the upper left corner the floor plan with the
toddler's trail.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from caregiver_mj.children.novice import EPISODE_TIMESTEPS
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.symbols import BIN, STAIRWELL, WALL
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import GROUND, Colour, mix

_STRIP_OPACITY, _CHART_OPACITY = 210, 232  # of 255
_TEXT, _LABEL, _TRACK = (242, 244, 247), (158, 168, 182), (56, 64, 78)

_DESIGN_HEIGHT = 720  # pixels; lengths below are for a frame this high
_SMALLEST_FONT = 11  # pixels, whatever the frame
_LABELLED_CELL = 16  # pixels; names of candidates would hide what is in smaller cells
_FINE = 3  # the plan is drawn this many times larger and averaged, since Pillow does not smooth edges
_FULL_BAR = 1.0  # expected danger of a full bar, unless one is greater
_TRAIL_WIDTH = 0.14  # cells


@dataclasses.dataclass(frozen=True)
class HudState:
    """What the display shows. Positions are in metres, in the floor plan's frame.

    Attributes:
        plan: The house.
        timestep: Novice timesteps elapsed.
        epsilon: The novice's.
        toddler: Where it is, (2,).
        candles: Where the candles are, (candles, 2) or (candles, 3).
        trail: Where the toddler has been, (k, 2), newest last.
        damage: Damage so far.
        damages: The same by kind, name to damage, shown if given.
        robot: The robot's x, y and yaw in rad, or None if there is none.
        safe: P(safe|tau), or None if nobody estimates it.
        danger: Expected danger of every candidate (stairwells, then candles), or None.
        hazard: What that would be at P(safe|tau) = 0, shown as outlines, or None.
        target: Index of the candidate being protected, or -1.
        intervention: What the caregiver is doing.
    """

    plan: FloorPlan
    timestep: int
    epsilon: float
    toddler: np.ndarray
    candles: np.ndarray
    trail: np.ndarray = dataclasses.field(default_factory=lambda: np.empty((0, 2)))
    damage: float = 0.0
    damages: dict[str, float] | None = None
    robot: np.ndarray | None = None
    safe: float | None = None
    danger: np.ndarray | None = None
    hazard: np.ndarray | None = None
    target: int = -1
    intervention: str = ""


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
    _put(drawn, strip.box, lambda region: strip.draw(region, state))
    _put(drawn, chart.box, lambda region: chart.draw(region, state))
    scale = _scale(height)
    top, right = scale.px(12), width - scale.px(12)
    for caption, picture in insets:
        box = (right - picture.shape[1], top, right, top + picture.shape[0])
        _put(drawn, box, lambda region, c=caption, p=picture: _draw_inset(region, c, p, scale))
        top = box[3] + scale.px(12)
    return drawn


def strip_top(width: int, height: int) -> int:
    """The row of pixels below which the card along the lower edge covers a frame of this size."""
    return _strip(width, height).box[1]


def inset_size(width: int, height: int) -> tuple[int, int]:
    """Width and height in pixels of an inset that leaves a frame of this size its middle."""
    inset_width = round(_side(width, height))
    return inset_width, round(inset_width * 0.72)


def candidate_label(index: int, stairwells: int) -> str:
    """Short name of a candidate: S1, S2, ... for stairwells, then C1, C2, ... for candles."""
    return f"S{index + 1}" if index < stairwells else f"C{index - stairwells + 1}"


# -- Lengths and letters -----------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class _Scale:
    """Turns lengths of the design into pixels of a frame."""

    factor: float

    def px(self, length: float) -> int:
        return max(1, round(length * self.factor))

    def font(self, size: float) -> int:
        return max(_SMALLEST_FONT, round(size * self.factor))


def _scale(height: int) -> _Scale:
    return _Scale(height / _DESIGN_HEIGHT)


def _side(width: int, height: int) -> float:
    """How wide, in pixels, that may be which lies at the left and right of the picture."""
    return width * (0.2 if width > 1.5 * height else 0.24)


@functools.cache
def _font(size: int) -> ImageFont.FreeTypeFont:
    return ImageFont.load_default(size)


@functools.lru_cache(maxsize=2048)
def _text_mask(text: str, size: int, outline: int = 0) -> Image.Image:
    """Text as coverage, drawn large and averaged: small letters keep their spacing that way.

    The baseline lies one font size below the upper edge.
    """
    font = _font(size * _FINE)
    width = _text_width(text, size) + 2 * outline
    mask = Image.new("L", (width * _FINE, (size + size // 2) * _FINE))
    stroke = 0.6 + outline * _FINE  # a little weight makes thin letters stand out on moving pictures
    ImageDraw.Draw(mask).text((outline * _FINE, size * _FINE), text, 255, font, anchor="ls", stroke_width=stroke)
    return mask.reduce(_FINE)


@functools.lru_cache(maxsize=2048)
def _text_width(text: str, size: int) -> int:
    return math.ceil(_font(size * _FINE).getlength(text) / _FINE) + 1


def _write(
    image: Image.Image,
    at: tuple[float, float],
    text: str,
    size: int,
    colour: Colour,
    align: float = 0.0,
    outline: Colour | None = None,
) -> None:
    """Writes a line with its baseline at a point that is its left end (align 0), middle (0.5) or right end (1)."""
    x, y = round(at[0] - align * _text_width(text, size)), round(at[1]) - size
    if outline:
        image.paste(outline, (x - 1, y), _text_mask(text, size, 1))
    image.paste(colour, (x, y), _text_mask(text, size))


@functools.lru_cache(maxsize=512)
def _fit(texts: tuple[str, ...], size: int, width: int) -> str:
    """The first of some texts that fits into a width, or as much of the last as does."""
    for text in texts:
        if _text_width(text, size) <= width:
            return text
    while text and _text_width(text + "...", size) > width:
        text = text[:-1]
    return text.rstrip() + "..."


def _put(frame: np.ndarray, box: tuple[int, int, int, int], paint: Callable[[Image.Image], None]) -> None:
    """Lets `paint` draw on a part of the frame, given as left, top, right, bottom."""
    left, top, right, bottom = box
    region = Image.fromarray(frame[top:bottom, left:right])
    paint(region)
    frame[top:bottom, left:right] = np.asarray(region)


def _card(size: tuple[int, int], radius: int, opacity: int) -> tuple[Image.Image, Image.Image]:
    """A dark card with round corners, and its opacity (of 255)."""
    mask = Image.new("L", (size[0] * _FINE, size[1] * _FINE))
    ImageDraw.Draw(mask).rounded_rectangle((0, 0, mask.width - 1, mask.height - 1), radius * _FINE, fill=opacity)
    return Image.new("RGB", size, GROUND), mask.reduce(_FINE)


def _few_digits(danger: float) -> str:
    if danger == 0.0:
        return ""  # nobody can bump into a candle in the robot's hand
    return f"{danger:.2f}" if danger >= 0.005 else "< 0.01"


def _draw_inset(image: Image.Image, caption: str, picture: np.ndarray, scale: _Scale) -> None:
    image.paste(Image.fromarray(picture))
    size, edge = scale.font(13), scale.px(2)
    ImageDraw.Draw(image).rectangle((0, 0, image.width - 1, image.height - 1), outline=GROUND, width=edge)
    _write(image, (scale.px(8), image.height - scale.px(8)), caption, size, _TEXT, outline=GROUND)


# -- The card along the lower edge -------------------------------------------------------------------


@functools.lru_cache(maxsize=8)
def _strip(width: int, height: int) -> _Strip:
    return _Strip(width, height)


class _Strip:
    """Timestep and P(safe) on the left, expected danger in the middle, deeds and damage on the right."""

    def __init__(self, width: int, height: int):
        self._scale = scale = _scale(height)
        px = scale.px
        self._small, self._medium, self._large = scale.font(13), scale.font(17), scale.font(24)
        self._row = self._small + self._medium + px(14)  # distance of the two rows
        margin, pad, self._top = px(12), px(16), px(14)
        card_height = 2 * self._row + 2 * self._top
        self._bottom = card_height - self._top
        self.box = (margin, height - margin - card_height, width - margin, height - margin)
        self._card, self._opacity = _card((width - 2 * margin, card_height), px(10), _STRIP_OPACITY)
        left_width, right_width, gap = px(220), px(290), px(32)
        right = self._card.width - pad
        self._left = pad, pad + left_width
        self._middle = pad + left_width + gap, right - right_width - gap
        self._right = right - right_width, right

    def draw(self, image: Image.Image, state: HudState) -> None:
        image.paste(self._card, mask=self._opacity)
        elapsed = state.timestep / EPISODE_TIMESTEPS
        self._gauge(image, self._top, "TIMESTEP", f"{state.timestep} / {EPISODE_TIMESTEPS}", elapsed, _LABEL)
        if state.safe is not None:
            self._gauge(image, self._top + self._row, "P(SAFE)", f"{state.safe:.2f}", state.safe, colours.ROBOT)
        else:
            self._gauge(image, self._top + self._row, "P(SAFE)", "not estimated", 0.0, colours.ROBOT)
        self._bars(image, state)
        self._words(image, state)

    def _gauge(self, image: Image.Image, top: int, label: str, value: str, share: float, colour: Colour) -> None:
        """A label, its value, and below them a bar that is filled to a share."""
        (left, right), px = self._left, self._scale.px
        line = top + self._medium
        _write(image, (left, line), label, self._small, _LABEL)
        _write(image, (right, line), value, self._medium if share else self._small, _TEXT, align=1)
        bar, filled = line + px(8), left + round((right - left) * min(max(share, 0.0), 1.0))
        image.paste(_TRACK, (left, bar, right, bar + px(6)))
        image.paste(colour, (left, bar, filled, bar + px(6)))

    def _bars(self, image: Image.Image, state: HudState) -> None:
        """Expected danger of every candidate, or of the greatest ones if there is not room for all."""
        (left, right), px, stairwells = self._middle, self._scale.px, len(state.plan.stairwells)
        danger = np.empty(0) if state.danger is None else np.asarray(state.danger, float)
        hazard = danger if state.hazard is None else np.asarray(state.hazard, float)
        shown = np.arange(len(danger))
        room = (right - left) // (_text_width("C88", self._small) + px(8))
        if len(danger) > room:
            rank = np.where(shown == state.target, np.inf, hazard)  # the target is always in sight
            shown = np.sort(np.argsort(-rank, kind="stable")[:room])
        title = "EXPECTED DANGER" if len(shown) == len(danger) else f"EXPECTED DANGER, {len(shown)} OF {len(danger)}"
        title_line = self._top + self._small
        titles = (title,) if state.hazard is None else (f"{title}   outlined: if surely unsafe", title)
        _write(image, (left, title_line), _fit(titles, self._small, right - left), self._small, _LABEL)
        if not len(danger):
            _write(image, (left, self._bottom), "not estimated", self._small, _TEXT)
            return

        base, ceiling = self._bottom - self._small - px(6), title_line + px(6) + self._small
        full = max(_FULL_BAR, hazard.max(), danger.max())
        pitch = min((right - left) / len(shown), px(84))
        bar_width = min(round(pitch * 0.62), px(38))
        for place, index in enumerate(shown):
            is_target = index == state.target
            colour = colours.STAIRWELL if index < stairwells else colours.CANDLE
            colour = colour if is_target else mix(colour, GROUND, 0.4)
            x = round(left + pitch * place + (pitch - bar_width) / 2)
            middle = x + bar_width / 2
            top, outline = (base - round((base - ceiling) * values[index] / full) for values in (danger, hazard))
            image.paste(_TRACK, (x, base, x + bar_width, base + 1))
            if outline < base:
                image.paste(colour, (x, outline, x + bar_width, base))
                image.paste(GROUND, (x + 1, min(outline + 1, base), x + bar_width - 1, base))
            image.paste(colour, (x, top, x + bar_width, base))
            name = candidate_label(int(index), stairwells)
            if is_target:
                number = _few_digits(danger[index])
                _write(image, (middle, min(top, outline) - px(3)), number, self._small, _TEXT, align=0.5)
                half = _text_width(name, self._small) // 2 + px(4)
                pill = (round(middle) - half, base + px(3), round(middle) + half, self._bottom + px(4))
                image.paste(_TEXT, pill)
            _write(image, (middle, self._bottom), name, self._small, GROUND if is_target else _LABEL, align=0.5)

    def _words(self, image: Image.Image, state: HudState) -> None:
        """What the caregiver does, and the damage so far."""
        (left, right), px = self._right, self._scale.px
        who = "CAREGIVER" if state.robot is not None else "NO CAREGIVER"
        _write(image, (left, self._top + self._small), who, self._small, _LABEL)
        deed = _fit((state.intervention,), self._medium, right - left)
        _write(image, (left, self._top + self._small + px(8) + self._medium), deed, self._medium, colours.ROBOT)
        _write(image, (left, self._bottom), "DAMAGE", self._small, _LABEL)
        x = left + _text_width("DAMAGE", self._small) + px(8)
        number = f"{state.damage:g}"
        _write(image, (x, self._bottom), number, self._large, colours.DAMAGE if state.damage else _TEXT)
        if state.damages:
            x += _text_width(number, self._large)
            wordings = tuple(
                "   ".join(f"{kind[:letters].capitalize()} {value:g}" for kind, value in state.damages.items())
                for letters in (9, 1)
            )
            text = _fit(wordings, self._small, right - x - px(10))
            _write(image, (right, self._bottom), text, self._small, _LABEL, align=1)


# -- The floor plan ----------------------------------------------------------------------------------


@functools.lru_cache(maxsize=8)
def _chart(plan: FloorPlan, width: int, height: int) -> _Chart:
    return _Chart(plan, width, height)


class _Chart:
    """The house from above: what stands still is drawn once, what moves in every frame."""

    def __init__(self, plan: FloorPlan, width: int, height: int):
        self._plan, scale = plan, _scale(height)
        rows, columns = plan.shape
        self._pad, margin = scale.px(8), scale.px(12)
        self._small = scale.font(13)
        room = _side(width, height) - 2 * self._pad, 0.36 * height
        self._cell = max(4, int(min(room[0] / columns, room[1] / rows)))
        caption = self._small + scale.px(10)
        size = columns * self._cell + 2 * self._pad, rows * self._cell + 2 * self._pad + caption
        self.box = (margin, margin, margin + size[0], margin + size[1])
        self._caption = size[1] - scale.px(10)
        card, self._opacity = _card(size, scale.px(10), _CHART_OPACITY)
        self._still = card.resize((size[0] * _FINE, size[1] * _FINE))
        self._draw_still(ImageDraw.Draw(self._still))

    def draw(self, image: Image.Image, state: HudState) -> None:
        fine = self._still.copy()
        canvas = ImageDraw.Draw(fine)
        unit = self._cell * _FINE
        stairwells = len(self._plan.stairwells)
        if 0 <= state.target < stairwells:
            square = self._square(self._plan.stairwells[state.target])
            canvas.rectangle(square, outline=_TEXT, width=max(_FINE, round(0.12 * unit)))
        self._trail(canvas, state)
        for index, position in enumerate(state.candles):
            self._candle(canvas, position, target=state.target == stairwells + index)
        if state.robot is not None:
            self._robot(canvas, state.robot)
        x, y = self._pixel(state.toddler)
        r = 0.34 * unit
        canvas.ellipse((x - r, y - r, x + r, y + r), colours.TODDLER, outline=GROUND, width=_FINE)

        chart = fine.reduce(_FINE)
        names = [self._plan.position(cell) for cell in self._plan.stairwells] + list(state.candles)
        for index, position in enumerate(names if self._cell >= _LABELLED_CELL else []):
            x, y = (coordinate / _FINE for coordinate in self._pixel(position))
            label = candidate_label(index, stairwells)
            at = (x, y + (0.3 if index < stairwells else 0.85) * self._cell)
            _write(chart, at, label, _SMALLEST_FONT, _TEXT, align=0.5, outline=GROUND)
        _write(chart, (self._pad, self._caption), state.plan.name, self._small, _LABEL)
        right = chart.width - self._pad
        _write(chart, (right, self._caption), f"epsilon {state.epsilon:g}", self._small, _LABEL, align=1)
        image.paste(chart, mask=self._opacity)

    def _pixel(self, position: np.ndarray) -> tuple[float, float]:
        """Where a point (2,) in metres lies on the fine drawing."""
        rows, columns = self._plan.shape
        x = float(position[0]) / self._plan.cell_size + columns / 2
        y = rows / 2 - float(position[1]) / self._plan.cell_size
        return (x * self._cell + self._pad) * _FINE, (y * self._cell + self._pad) * _FINE

    def _square(self, cell: Cell) -> tuple[float, float, float, float]:
        x, y = self._pixel(self._plan.position(cell))
        r = self._cell * _FINE / 2
        return x - r, y - r, x + r - 1, y + r - 1

    def _draw_still(self, canvas: ImageDraw.ImageDraw) -> None:
        plan, unit = self._plan, self._cell * _FINE
        for row in range(plan.shape[0]):
            for column in range(plan.shape[1]):
                square = self._square((row, column))
                canvas.rectangle(square, colours.WALL if plan[row, column] == WALL else colours.FLOOR)
                if plan[row, column] == STAIRWELL:
                    self._hatch(canvas, square)
        inner = 0.14 * unit
        for cells, colour in ((plan.tables, colours.TABLE), (plan.cells_of(BIN), colours.BIN)):
            for cell in cells:
                left, top, right, bottom = self._square(cell)
                canvas.rounded_rectangle(
                    (left + inner, top + inner, right - inner, bottom - inner), radius=0.15 * unit, fill=colour
                )

    def _hatch(self, canvas: ImageDraw.ImageDraw, square: tuple[float, float, float, float]) -> None:
        """Treads, seen from above."""
        left, top, right, bottom = square
        canvas.rectangle(square, mix(colours.STAIRWELL, GROUND, 0.6))
        treads = 4
        for tread in range(treads):
            y = top + (bottom - top) * (tread + 0.5) / treads
            canvas.line((left, y, right, y), colours.STAIRWELL, width=max(1, round((bottom - top) / treads * 0.4)))

    def _trail(self, canvas: ImageDraw.ImageDraw, state: HudState) -> None:
        points = [self._pixel(position) for position in state.trail] + [self._pixel(state.toddler)]
        width = max(_FINE, round(_TRAIL_WIDTH * self._cell * _FINE))
        for i, (start, end) in enumerate(itertools.pairwise(points)):
            colour = mix(colours.FLOOR, colours.TODDLER, 0.15 + 0.7 * (i + 1) / len(points))
            canvas.line((*start, *end), colour, width=width)

    def _candle(self, canvas: ImageDraw.ImageDraw, position: np.ndarray, target: bool) -> None:
        """A flame: a drop with its tip up."""
        x, y = self._pixel(position)
        r = 0.21 * self._cell * _FINE
        if target:
            halo = 0.5 * self._cell * _FINE
            canvas.ellipse((x - halo, y - halo, x + halo, y + halo), outline=_TEXT, width=max(_FINE, round(0.4 * r)))
        y += 0.4 * r
        canvas.polygon(((x, y - 2.3 * r), (x + 0.95 * r, y - 0.3 * r), (x - 0.95 * r, y - 0.3 * r)), colours.CANDLE)
        canvas.ellipse((x - r, y - r, x + r, y + r), colours.CANDLE)
        canvas.ellipse((x - 0.45 * r, y - 0.35 * r, x + 0.45 * r, y + 0.55 * r), (255, 236, 170))

    def _robot(self, canvas: ImageDraw.ImageDraw, pose: np.ndarray) -> None:
        """A disc with an arrow head along the heading."""
        x, y = self._pixel(pose)
        r = 0.42 * self._cell * _FINE
        canvas.ellipse((x - r, y - r, x + r, y + r), colours.ROBOT, outline=GROUND, width=_FINE)
        turns = float(pose[2]) + np.array([0.0, 2.5, np.pi, -2.5])
        reach = r * np.array([0.8, 0.75, 0.2, 0.75])
        canvas.polygon([(x + d * np.cos(a), y - d * np.sin(a)) for d, a in zip(reach, turns, strict=True)], GROUND)

"""The chart: the house from above. Fixed things are drawn once, moving ones in every frame.

Before it stand the drawing tools of display and maps: lengths, text, and cards (dark backgrounds).
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import BIN, WALL, Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import Where
from caregiver_mj.robot.geometry import Pose, to_world
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import GROUND, TEXT, Colour, mix
from caregiver_mj.viz.moment import ChildState, HudState, place_of

LABEL, TRACK = (158, 168, 182), (56, 64, 78)  # colours of labels, and of the empty part of a gauge
Box = tuple[int, int, int, int]  # left, top, right, bottom, in pixels
SMALLEST_FONT = 11  # pixels, in any frame
FINE = 3  # scale at which text and plan are drawn before averaging; Pillow does not smooth edges
_DESIGN_HEIGHT = 720  # pixels; height of the frame for which lengths are designed


@functools.lru_cache(maxsize=16)
def card_mask(size: tuple[int, int], radius: int, opacity: int) -> Image.Image:
    """Return the mask of a card with round corners, with an opacity from 0 to 255. Do not draw on it: it is cached."""
    fine = Image.new("L", (size[0] * FINE, size[1] * FINE))
    ImageDraw.Draw(fine).rounded_rectangle((0, 0, fine.width - 1, fine.height - 1), radius * FINE, fill=opacity)
    return fine.reduce(FINE)


def paint_on(frame: np.ndarray, box: Box, paint: Callable[[Image.Image], None]) -> None:
    """Draw on a part of the frame with `paint`."""
    left, top, right, bottom = box
    region = Image.fromarray(frame[top:bottom, left:right])
    paint(region)
    frame[top:bottom, left:right] = np.asarray(region)


def inset_width(width: int, height: int) -> float:
    """Return the greatest width of an inset at the left or right edge of a frame, pixels."""
    return width * (0.2 if width > 1.5 * height else 0.24)


class Scale:
    """Lengths of the design in pixels of a frame with a height; among them the sizes of three fonts."""

    def __init__(self, height: int):
        self._factor = height / _DESIGN_HEIGHT
        self.small, self.medium, self.large = map(self.font, (13, 17, 24))  # of labels, of values, of the main value

    def px(self, length: float) -> int:
        return max(1, round(length * self._factor))

    def font(self, size: float) -> int:
        return max(SMALLEST_FONT, round(size * self._factor))


@functools.lru_cache(maxsize=2048)
def width_of(text: str, size: int) -> int:
    """Return the width of a line in pixels, rounded up."""
    return math.ceil(_font(size * FINE).getlength(text) / FINE) + 1


def write(
    image: Image.Image,
    at: tuple[float, float],
    text: str,
    size: int,
    colour: Colour,
    align: float = 0.0,
    outline: Colour | None = None,
) -> None:
    """Write a line; its baseline begins (align 0), is centred (0.5) or ends (1) at a point."""
    x, y = round(at[0] - align * width_of(text, size)), round(at[1]) - size
    if outline:
        image.paste(outline, (x - 1, y), _mask(text, size, 1))
    image.paste(colour, (x, y), _mask(text, size))


@functools.lru_cache(maxsize=512)
def fit(texts: tuple[str, ...], size: int, width: int) -> str:
    """Return the first of some texts that fits into a width, or the last one, shortened."""
    for text in texts:
        if width_of(text, size) <= width:
            return text
    while text and width_of(text + "...", size) > width:
        text = text[:-1]
    return text.rstrip() + "..."


@functools.cache
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


@functools.lru_cache(maxsize=2048)
def _mask(text: str, size: int, outline: int = 0) -> Image.Image:
    """Return a text as a mask, drawn large and averaged, which keeps the spacing of small letters.

    The baseline is one font size below the upper edge.
    """
    font = _font(size * FINE)
    width = width_of(text, size) + 2 * outline
    mask = Image.new("L", (width * FINE, (size + size // 2) * FINE))
    stroke = 0.6 + outline * FINE  # bolder letters are more legible in a film
    ImageDraw.Draw(mask).text((outline * FINE, size * FINE), text, 255, font, anchor="ls", stroke_width=stroke)
    return mask.reduce(FINE)


CARD_OPACITY = 232  # 0 to 255
_LABELLED_CELL = 16  # pixels; least side of a cell with a name in it
_TRAIL_WIDTH = 0.14  # cells
_CHILD, _ROBOT = 4.5, 5.5  # pixels; least radii
_LABELS = {Where.OPENING: 0.3, Where.ON_TABLE: 0.85, Where.FLOOR: 0.5}  # cells; names' baselines below the places
Square = tuple[float, float, float, float]  # left, top, right, bottom, pixels of the fine drawing
_TREADS = 4  # lines of a stairwell


class Chart:
    """The card with the chart of a house, in a `box` of the frame."""

    def __init__(self, plan: FloorPlan, width: int, height: int, alone: bool = False):
        """Draw the fixed things, for frames of a size in pixels.

        An `alone` chart fills the frame, and has a longer caption.
        """
        scale = Scale(height)
        rows, columns = plan.shape
        self._pad, margin = scale.px(8), scale.px(12)
        self._small = scale.small
        caption, self._alone = self._small + scale.px(10), alone
        room = inset_width(width, height) - 2 * self._pad, 0.36 * height
        if alone:
            room = width - 2 * self._pad, height - 2 * self._pad - caption
        cell = max(4, int(min(room[0] / columns, room[1] / rows)))
        size = columns * cell + 2 * self._pad, rows * cell + 2 * self._pad + caption
        left, top = ((width - size[0]) // 2, (height - size[1]) // 2) if alone else (margin, margin)
        self.box = (left, top, left + size[0], top + size[1])
        self._caption = size[1] - scale.px(10)
        self._mask = card_mask(size, scale.px(10), 255 if alone else CARD_OPACITY)
        self._ground = GroundPlan(plan, cell, self._pad)
        self._still = self._ground.draw(Image.new("RGB", size, GROUND))

    def draw(self, image: Image.Image, state: HudState) -> None:
        fine = self._still.copy()
        self._draw_moving(ImageDraw.Draw(fine), state)
        chart = fine.reduce(FINE)
        if self._ground.cell >= _LABELLED_CELL:
            self._write_names(chart, state)
        self._write_caption(chart, state)
        image.paste(chart, mask=self._mask)

    def _draw_moving(self, canvas: ImageDraw.ImageDraw, state: HudState) -> None:
        self._draw_floor(canvas, state)
        pointed_at, where = state.mark or ("", None)
        if pointed_at == "cell" and isinstance(where, tuple):
            canvas.rectangle(self._ground.square(where), outline=TEXT, width=self._ground.pen(0.12))
        for number, child in enumerate(state.children):
            self._draw_trail(canvas, child, colours.of_child(number))
        for number, hazard in enumerate(state.plan.hazards):
            if hazard.kind.where is Where.FLOOR and number not in state.gone:
                self._ground.draw_disc(canvas, place_of(state.plan, number, state.candles), hazard.kind.colour)
        things = state.plan.hazards.at(Where.ON_TABLE)
        for index, (thing, position) in enumerate(zip(things, state.candles, strict=True)):
            self._ground.draw_candle(canvas, position, thing.kind.colour, halo=(pointed_at, where) == ("candle", index))
        for frame, angle in zip(layout.gate_frames(state.plan), state.gates, strict=True):
            self._draw_gate(canvas, frame, float(angle))
        if state.robot is not None:
            self._draw_robot(canvas, state.robot)
        for number, child in reversed(list(enumerate(state.children))):  # the first one on top
            self._draw_child(canvas, child, colours.of_child(number))

    def _draw_floor(self, canvas: ImageDraw.ImageDraw, state: HudState) -> None:
        """Draw the caregiver's view, if partial; predicted places, hazards, and frames round probable toy bins."""
        plan, ground, forecast = state.plan, self._ground, state.forecast
        for cell in np.flatnonzero(() if state.in_view is None else state.in_view).tolist():
            canvas.rectangle(ground.square(plan.free_cells[cell]), mix(colours.FLOOR, TEXT, 0.2))
        if forecast is None:
            return
        for cell, child, strength in forecast.places():
            shade = mix(colours.FLOOR, colours.of_child(child), strength)
            canvas.rectangle(ground.square(plan.free_cells[cell]), shade)
        for number, strength in forecast.threats():
            x, y = ground.pixel(place_of(plan, number, state.candles))
            r = 0.5 * ground.unit
            shade = mix(colours.FLOOR, colours.HARM, strength)
            canvas.rectangle((x - r, y - r, x + r, y + r), outline=shade, width=ground.pen(0.16))
        for goal, place in enumerate(plan.bins):
            width = round(0.3 * ground.unit * float(forecast.goal[:, goal].max()))
            if width:
                canvas.rectangle(ground.square(place), outline=TEXT, width=width)

    def _draw_child(self, canvas: ImageDraw.ImageDraw, child: ChildState, colour: Colour) -> None:
        """Draw a disc, or a ring for an unseen child."""
        x, y = self._ground.pixel(child.position)
        r = max(0.34 * self._ground.unit, _CHILD * FINE)
        canvas.circle((x, y), r, colour, outline=GROUND, width=FINE)
        if not child.seen:
            r *= 0.5
            canvas.circle((x, y), r, GROUND)

    def _draw_trail(self, canvas: ImageDraw.ImageDraw, child: ChildState, colour: Colour) -> None:
        points = [self._ground.pixel(position) for position in [*child.trail, child.position]]
        width = max(FINE, round(_TRAIL_WIDTH * self._ground.cell * FINE))
        for i, (start, end) in enumerate(itertools.pairwise(points)):
            fresh = mix(colours.FLOOR, colour, 0.15 + 0.7 * (i + 1) / len(points))
            canvas.line((*start, *end), fresh, width=width)

    def _draw_gate(self, canvas: ImageDraw.ImageDraw, frame: Pose, angle: float) -> None:
        """Draw the fences beside a landing, and the gate between them at its angle, rad."""
        (front, side), length, _ = layout.gate()
        end = front + length * math.sin(angle), side - length * math.cos(angle)
        for line in (((front, side), (-front, side)), ((front, -side), (-front, -side)), ((front, side), end)):
            ends = (self._ground.pixel(np.array(to_world(frame, point))) for point in line)
            canvas.line([*itertools.chain.from_iterable(ends)], TEXT, width=self._ground.pen(0.1))

    def _draw_robot(self, canvas: ImageDraw.ImageDraw, pose: np.ndarray) -> None:
        x, y = self._ground.pixel(pose)
        r = max(0.42 * self._ground.unit, _ROBOT * FINE)
        canvas.circle((x, y), r, colours.ROBOT, outline=GROUND, width=FINE)
        if len(pose) == 2:
            return
        turns = float(pose[2]) + np.array([0.0, 2.5, np.pi, -2.5])
        reach = r * np.array([0.8, 0.75, 0.2, 0.75])
        canvas.polygon([(x + d * np.cos(a), y - d * np.sin(a)) for d, a in zip(reach, turns, strict=True)], GROUND)

    def _write_names(self, chart: Image.Image, state: HudState) -> None:
        def write_at(position: np.ndarray, low: float, text: str, ink: Colour, outline: Colour | None) -> None:
            x, y = (coordinate / FINE for coordinate in self._ground.pixel(position))
            write(chart, (x, y + low * self._ground.cell), text, SMALLEST_FONT, ink, 0.5, outline)

        for number, hazard in enumerate(state.plan.hazards):
            if number not in state.gone:
                place = place_of(state.plan, number, state.candles)
                write_at(place, _LABELS[hazard.kind.where], hazard.label, TEXT, GROUND)
        for number, child in enumerate(state.children if len(state.children) > 1 else ()):
            write_at(child.position, 0.25, str(number + 1), GROUND, None)

    def _write_caption(self, chart: Image.Image, state: HudState) -> None:
        """Write the name of the house, shortened if necessary, and the children."""
        small, right, name = self._small, chart.width - self._pad, state.plan.name
        room = right - self._pad
        family = f"{'children' if ':' in state.family else 'epsilon'} {state.family.replace(',', ', ')}"
        share = 2 * room // 3 if self._alone else max(room // 3, room - width_of(f"{name}  ", small))
        family = fit((family, state.family), small, share)
        if self._alone:
            now = f"timestep {state.timestep}   damage {state.damage:g}"
            name = fit((f"{name}   {now}", now, name), small, round(0.7 * room))
        else:
            name = fit((name,), small, room - width_of(f"{family}  ", small))
        write(chart, (self._pad, self._caption), name, small, LABEL)
        write(chart, (right, self._caption), family, small, LABEL, align=1)


class GroundPlan:
    """Draws a house `FINE` times larger than shown, and converts places to pixels of that drawing.

    `cell` and `unit` are the side of a cell in pixels, as shown and in the fine drawing.
    """

    def __init__(self, plan: FloorPlan, cell: int, pad: int):
        """Prepare a drawing with a rim of `pad` pixels, as shown, around the house."""
        self.plan, self.cell, self.unit = plan, cell, cell * FINE
        self._pad = pad

    def pixel(self, position: np.ndarray) -> tuple[float, float]:
        """Return the pixel of a point (2 or more), m, in the fine drawing."""
        rows, columns = self.plan.shape
        x = float(position[0]) / self.plan.cell_size + columns / 2
        y = rows / 2 - float(position[1]) / self.plan.cell_size
        return (x * self.cell + self._pad) * FINE, (y * self.cell + self._pad) * FINE

    def pen(self, share: float) -> int:
        """Return a visible width of lines, a share of a cell, in the fine drawing."""
        return max(FINE, round(share * self.unit))

    def square(self, cell: Cell) -> Square:
        """Return the square of a cell in the fine drawing."""
        x, y = self.pixel(self.plan.position(cell))
        r = self.cell * FINE / 2
        return x - r, y - r, x + r - 1, y + r - 1

    def draw(self, card: Image.Image) -> Image.Image:
        """Return a fine drawing of the house on a card."""
        drawn = card.resize((card.width * FINE, card.height * FINE))
        canvas, plan = ImageDraw.Draw(drawn), self.plan
        for cell in np.ndindex(plan.shape):
            square = self.square(cell)
            canvas.rectangle(square, colours.WALL if plan[cell] == WALL else colours.FLOOR)
        for hazard, cell in zip(plan.hazards.at(Where.OPENING), plan.stairwells, strict=True):
            _draw_stairs(canvas, self.square(cell), hazard.kind.colour)
        inner = 0.14 * self.unit
        for cells, colour in ((plan.tables, colours.TABLE), (plan.cells_of(BIN), colours.BIN)):
            for cell in cells:
                left, top, right, bottom = self.square(cell)
                box = (left + inner, top + inner, right - inner, bottom - inner)
                canvas.rounded_rectangle(box, radius=0.15 * self.unit, fill=colour)
        return drawn

    def draw_candle(self, canvas: ImageDraw.ImageDraw, position: np.ndarray, colour: Colour, halo: bool) -> None:
        """Draw a flame, a drop with its tip up, at a place in m, on request with a halo."""
        x, y = self.pixel(position)
        r = 0.21 * self.unit
        if halo:
            canvas.circle((x, y), 0.5 * self.unit, outline=TEXT, width=max(FINE, round(0.4 * r)))
        y += 0.4 * r
        canvas.polygon(((x, y - 2.3 * r), (x + 0.95 * r, y - 0.3 * r), (x - 0.95 * r, y - 0.3 * r)), colour)
        canvas.circle((x, y), r, colour)
        canvas.ellipse((x - 0.45 * r, y - 0.35 * r, x + 0.45 * r, y + 0.55 * r), colours.FLAME)

    def draw_disc(self, canvas: ImageDraw.ImageDraw, position: np.ndarray, colour: Colour) -> None:
        """Draw a thing on the floor, a disc with a rim, at a place in m."""
        x, y = self.pixel(position)
        r = 0.16 * self.unit
        canvas.circle((x, y), r, colour, outline=mix(colour, GROUND, 0.5), width=FINE)


def _draw_stairs(canvas: ImageDraw.ImageDraw, square: Square, colour: Colour) -> None:
    left, top, right, bottom = square
    canvas.rectangle(square, mix(colour, GROUND, 0.6))
    for tread in range(_TREADS):
        y = top + (bottom - top) * (tread + 0.5) / _TREADS
        canvas.line((left, y, right, y), colour, width=max(1, round((bottom - top) / _TREADS * 0.4)))

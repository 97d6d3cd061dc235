"""Furniture that says what the rooms are: a kitchen, a sofa, beds. It is only to be seen, and the same in every scene.

It stands where nobody can be: in recesses of the outer walls, with its front where the wall's face is, and in corners.
What collides there, and what hides things, is the wall, as if there was no furniture.
"""

from __future__ import annotations

import itertools
import math
import zlib
from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np

from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import DEFAULT_CELL_SIZE
from caregiver_mj.plans.layout import WALL_HEIGHT, Layout, Stretch, largest_rectangle

_DEPTH = 0.5  # metres from the face of a wall to the border of its cell
_PANEL = 0.03  # metres, of the boards behind and beside a recess
_HALL, _NOOK = 3.5, 6  # times as long as wide is a hall; and so is what has fewer cells
_KINDS = "living", "kitchen", "bedroom", "bathroom"  # of rooms, from the largest one on; all others are bedrooms
TILED = "kitchen", "bathroom"
_PIECES = {  # in a room, as far as there is room
    "living": ("sofa", "television", "bookcase"),
    "kitchen": ("counter", "fridge", "stove", "dining"),
    "bedroom": ("bed", "wardrobe", "bookcase"),
    "bathroom": ("bath", "basin", "toilet"),
    "hall": ("wardrobe", "bench"),
}
FABRICS = "rug_blue", "rug_red", "rug_green", "rug_ochre"
_WINDOW_SHARE, _CORNER_SHARE = 0.5, 0.55  # of the places where a window, a lamp or a plant could be
Span = tuple[float, float]  # metres


class Part(NamedTuple):
    """A box of a piece, or a disc."""

    material: str  # "" for the fabric of the piece
    deep: Span  # behind the face of the wall; negative: before it
    across: Span  # along the wall, from the middle of the piece
    up: Span  # above the floor
    is_round: bool = False


class Piece(NamedTuple):
    """A piece of furniture, which fills some cells of a wall."""

    cells: int
    parts: tuple[Part, ...]


def _doors(material: str, count: int, half: float, up: Span) -> Iterator[Part]:
    """Doors side by side, each with a handle."""
    width = 2 * half / count
    for number in range(count):
        left = -half + number * width
        handle = left + (0.05 if number % 2 else width - 0.05)
        yield Part(material, (0.0, 0.03), (left + 0.008, left + width - 0.008), up)
        yield Part("steel", (-0.012, 0.0), (handle - 0.008, handle + 0.008), (up[1] - 0.16, up[1] - 0.06))


def _hob(middle: float) -> Iterator[Part]:
    """An oven under four rings."""
    yield Part("steel", (-0.002, 0.1), (middle - 0.29, middle + 0.29), (0.08, 0.83))
    yield Part("black", (-0.006, 0.1), (middle - 0.23, middle + 0.23), (0.22, 0.58))
    yield Part("white", (-0.03, 0.0), (middle - 0.22, middle + 0.22), (0.62, 0.64))
    yield Part("black", (0.04, 0.46), (middle - 0.27, middle + 0.27), (0.86, 0.874))
    for deep in (0.15, 0.35):
        for across in (-0.13, 0.13):
            ring = (deep - 0.07, deep + 0.07), (middle + across - 0.07, middle + across + 0.07)
            yield Part("ember" if deep > across > 0 else "steel", *ring, (0.87, 0.878), is_round=True)


def _books(half: float, shelves: tuple[float, ...]) -> Iterator[Part]:
    widths = 0.11, 0.07, 0.14, 0.09, 0.12
    for row, floor in enumerate(shelves):
        left = -half
        for number in range(5):
            width = widths[(number + 2 * row) % 5]
            material = (*FABRICS, "white")[(number + row) % 5]
            yield Part(material, (0.08, 0.3), (left, left + width), (floor, floor + 0.17 + 0.3 * width))
            left += width + 0.004


def _legs(material: str, deep: Span, across: Span, height: float) -> Iterator[Part]:
    """Four legs, at the corners."""
    for front, side in itertools.product((deep[0], deep[1] - 0.035), (across[0], across[1] - 0.035)):
        yield Part(material, (front, front + 0.035), (side, side + 0.035), (0, height))


def _chair(side: int) -> Iterator[Part]:
    """A chair on one side of a table, which it faces."""
    near, far, behind = sorted((0.36 * side, 0.66 * side)), 0.66 * side, 0.695 * side
    across = near[0], near[1]
    yield from _legs("dark_wood", (0.08, 0.38), across, 0.33)
    yield Part("wood", (0.08, 0.38), across, (0.33, 0.355))
    yield Part("", (0.10, 0.36), across, (0.355, 0.375))
    for up in (0.33, 0.60), (0.66, 0.74):
        yield Part("wood", (0.08, 0.38), (min(far, behind), max(far, behind)), up)


PIECES = {
    "sofa": Piece(
        2,
        (
            Part("dark_wood", (0.03, 0.46), (-0.70, 0.70), (0, 0.08)),
            Part("", (0.01, 0.46), (-0.72, 0.72), (0.08, 0.28)),
            *(Part("", (0.0, 0.36), (a, a + 0.57), (0.28, 0.38)) for a in (-0.575, 0.005)),
            *(Part("", (0.32, 0.46), (a, a + 0.57), (0.36, 0.74)) for a in (-0.575, 0.005)),
            *(Part("", (0.0, 0.46), (a, a + 0.15), (0.08, 0.52)) for a in (-0.735, 0.585)),
            Part("rug_border", (0.20, 0.31), (-0.50, -0.22), (0.38, 0.62)),
        ),
    ),
    "television": Piece(
        2,
        (
            Part("dark_wood", (0.05, 0.46), (-0.72, 0.72), (0, 0.36)),
            *_doors("wood", 4, 0.70, (0.05, 0.34)),
            Part("black", (0.26, 0.36), (-0.15, 0.15), (0.36, 0.40)),
            Part("black", (0.30, 0.34), (-0.48, 0.48), (0.40, 0.94)),
            Part("screen", (0.295, 0.30), (-0.46, 0.46), (0.42, 0.92)),
        ),
    ),
    "bookcase": Piece(
        1,
        (
            Part("dark_wood", (0.32, 0.36), (-0.34, 0.34), (0, 1.2)),
            *(Part("wood", (0.0, 0.34), (a, a + 0.03), (0, 1.2)) for a in (-0.345, 0.315)),
            *(Part("wood", (0.01, 0.34), (-0.33, 0.33), (z, z + 0.025)) for z in (0.03, 0.33, 0.62, 0.91, 1.185)),
            *_books(0.30, (0.055, 0.355, 0.645, 0.935)),
        ),
    ),
    "counter": Piece(
        3,
        (
            Part("black", (0.05, 0.46), (-1.1, 1.1), (0, 0.08)),
            Part("white", (0.03, 0.46), (-1.1, 1.1), (0.08, 0.83)),
            *_doors("white", 5, 1.1, (0.10, 0.81)),
            Part("wood", (-0.01, 0.46), (-1.1, 1.1), (0.83, 0.865)),
            *_hob(0.66),
            Part("steel", (0.08, 0.40), (-0.78, -0.22), (0.86, 0.872)),
            Part("screen", (0.11, 0.37), (-0.74, -0.36), (0.86, 0.874)),
            Part("steel", (0.40, 0.42), (-0.56, -0.54), (0.86, 1.06)),
            Part("steel", (0.28, 0.42), (-0.56, -0.54), (1.04, 1.06)),
        ),
    ),
    "stove": Piece(1, (Part("white", (0.0, 0.46), (-0.30, 0.30), (0.03, 0.865)), *_hob(0.0))),
    "fridge": Piece(
        1,
        (
            Part("black", (0.05, 0.46), (-0.31, 0.31), (0, 0.06)),
            Part("white", (0.0, 0.46), (-0.33, 0.33), (0.06, 1.45)),
            Part("steel", (-0.004, 0.1), (-0.33, 0.33), (0.93, 0.94)),
            Part("steel", (-0.03, 0.0), (-0.27, -0.25), (0.62, 0.88)),
            Part("steel", (-0.03, 0.0), (-0.27, -0.25), (1.00, 1.20)),
        ),
    ),
    "bench": Piece(
        2,
        (
            *(Part("dark_wood", (0.05, 0.42), (a, a + 0.06), (0, 0.34)) for a in (-0.66, 0.60)),
            Part("wood", (0.0, 0.44), (-0.72, 0.72), (0.34, 0.38)),
            Part("wood", (0.42, 0.46), (-0.72, 0.72), (0.38, 0.78)),
            *(Part("", (0.03, 0.40), (a, a + 0.44), (0.38, 0.43)) for a in (-0.68, -0.22, 0.24)),
        ),
    ),
    "dining": Piece(
        2,
        (
            *_legs("dark_wood", (0.04, 0.44), (-0.30, 0.30), 0.54),
            Part("wood", (0.01, 0.47), (-0.34, 0.34), (0.54, 0.57)),
            Part("", (0.06, 0.42), (-0.08, 0.08), (0.57, 0.573)),
            *(Part("white", (0.14, 0.32), (a - 0.09, a + 0.09), (0.57, 0.578), is_round=True) for a in (-0.22, 0.22)),
            *itertools.chain(_chair(-1), _chair(1)),
        ),
    ),
    "bed": Piece(
        2,
        (
            Part("wood", (0.0, 0.47), (-0.73, 0.73), (0.0, 0.24)),
            Part("wood", (0.0, 0.47), (-0.74, -0.70), (0.0, 0.72)),
            Part("wood", (0.0, 0.47), (0.70, 0.74), (0.0, 0.46)),
            Part("white", (0.02, 0.46), (-0.70, 0.70), (0.24, 0.38)),
            Part("", (0.005, 0.465), (-0.28, 0.69), (0.30, 0.415)),
            Part("white", (0.005, 0.466), (-0.36, -0.26), (0.31, 0.42)),
            Part("rug_border", (0.07, 0.41), (-0.67, -0.40), (0.38, 0.46)),
        ),
    ),
    "wardrobe": Piece(
        1, (Part("dark_wood", (0.02, 0.46), (-0.345, 0.345), (0, 1.55)), *_doors("wood", 2, 0.335, (0.06, 1.52)))
    ),
    "bath": Piece(
        2,
        (
            Part("white", (0.0, 0.46), (-0.73, 0.73), (0, 0.44)),
            Part("screen", (0.07, 0.40), (-0.63, 0.60), (0.40, 0.444)),
            Part("steel", (0.20, 0.24), (0.62, 0.66), (0.44, 0.56)),
            Part("", (-0.01, 0.02), (-0.45, -0.10), (0.16, 0.452)),
        ),
    ),
    "basin": Piece(
        1,
        (
            Part("wood", (0.03, 0.46), (-0.32, 0.32), (0, 0.60)),
            *_doors("wood", 2, 0.31, (0.05, 0.58)),
            Part("white", (0.0, 0.46), (-0.34, 0.34), (0.60, 0.68)),
            Part("screen", (0.08, 0.36), (-0.20, 0.20), (0.64, 0.684), is_round=True),
            Part("steel", (0.38, 0.41), (-0.015, 0.015), (0.68, 0.80)),
            Part("screen", (0.455, 0.462), (-0.26, 0.26), (0.80, 1.25)),
        ),
    ),
    "toilet": Piece(
        1,
        (
            Part("white", (0.06, 0.34), (-0.10, 0.10), (0, 0.22)),
            Part("white", (0.0, 0.36), (-0.17, 0.17), (0.20, 0.32), is_round=True),
            Part("rug_border", (0.02, 0.34), (-0.155, 0.155), (0.30, 0.335), is_round=True),
            Part("white", (0.32, 0.46), (-0.19, 0.19), (0.26, 0.66)),
            Part("steel", (0.37, 0.41), (-0.02, 0.02), (0.65, 0.67), is_round=True),
        ),
    ),
}
_WINDOW = Piece(
    1,
    (
        Part("skirting", (-0.012, 0.0), (-0.26, 0.26), (0.34, 0.80)),
        Part("glass", (-0.014, 0.0), (-0.22, 0.22), (0.38, 0.76)),
        Part("skirting", (-0.018, 0.0), (-0.012, 0.012), (0.36, 0.78)),
        Part("skirting", (-0.04, 0.0), (-0.29, 0.29), (0.31, 0.34)),
        *(Part("", (-0.03, 0.0), (a, a + 0.10), (0.26, 0.84)) for a in (-0.33, 0.23)),
        Part("dark_wood", (-0.04, 0.0), (-0.35, 0.35), (0.84, 0.86)),
    ),
)
_LAMP = Piece(
    1,
    (
        Part("steel", (-0.17, -0.03), (-0.07, 0.07), (0, 0.02), is_round=True),
        Part("steel", (-0.11, -0.09), (-0.01, 0.01), (0.02, 1.0), is_round=True),
        Part("lampshade", (-0.19, -0.01), (-0.09, 0.09), (0.92, 1.14), is_round=True),
    ),
)


class Furnishing(NamedTuple):
    """The furniture of a house.

    A place is a point (2,) in metres at the foot of a wall's face, and the yaw that faces the room.
    """

    kinds: tuple[str, ...]  # of the rooms, in the order of `Layout.rooms`
    pieces: tuple[tuple[str, Stretch], ...]  # and the wall's cells that each replaces
    windows: tuple[Stretch, ...]
    corners: tuple[tuple[str, np.ndarray, float], ...]  # a "lamp" or a "plant", and its place

    @property
    def recesses(self) -> frozenset[Cell]:
        """The wall's cells that furniture stands in."""
        return frozenset(cell for _, stretch in self.pieces for cell in stretch.cells)


def furnish(layout: Layout) -> Furnishing:
    """Furnish a house, always the same way; one of cells of another size only with lamps and plants."""
    plan = layout.plan
    random = np.random.default_rng(zlib.crc32("\n".join(plan.rows).encode()))
    kinds = _kinds(layout, random)
    free = list(layout.stretches) if plan.cell_size == DEFAULT_CELL_SIZE else []
    pieces: list[tuple[str, Stretch]] = []
    for room, kind in enumerate(kinds):
        for name in _PIECES[kind]:
            if name == "stove" and ("counter", room) in [(other, stretch.room) for other, stretch in pieces]:
                continue  # it has one
            fits = [stretch for stretch in free if stretch.room == room and len(stretch.cells) >= PIECES[name].cells]
            if fits:
                stretch = fits[random.integers(len(fits))]
                free.remove(stretch)
                before, taken, after = stretch.split(PIECES[name].cells, random)
                pieces.append((name, taken))
                free += [rest for rest in (before, after) if rest.cells]
    windows = [
        stretch._replace(cells=(cell,))
        for stretch in free
        for cell in stretch.cells
        if kinds[stretch.room] != "bathroom" and random.random() < _WINDOW_SHARE
    ]
    corners = [
        (("lamp", "plant")[random.integers(2)], *place) for place in layout.corners() if random.random() < _CORNER_SHARE
    ]
    return Furnishing(kinds, tuple(pieces), tuple(windows), tuple(corners))


def _kinds(layout: Layout, random: np.random.Generator) -> tuple[str, ...]:
    """Return the kind of each room, by size; a coin decides which of the two largest is the kitchen."""
    found = ["hall"] * len(layout.rooms)
    sizes = {}
    for i, room in enumerate(layout.rooms):
        (top, left), (bottom, right) = largest_rectangle(room)
        sides = sorted((bottom - top + 1, right - left + 1))
        if (sides[1] < _HALL * sides[0] and room.sum() >= _NOOK) or len(layout.rooms) == 1:
            sizes[i] = int(room.sum())
    kinds = list(_KINDS)
    kinds[:2] = kinds[:2][:: random.choice((1, -1))] if len(sizes) > 1 else kinds[:2]
    for rank, i in enumerate(sorted(sizes, key=lambda i: -sizes[i])):
        found[i] = kinds[rank] if rank < len(kinds) else "bedroom"
    return tuple(found)


def add_furniture(spec: mujoco.MjSpec, layout: Layout, furnishing: Furnishing) -> None:
    """Add all that stands in recesses, and windows and lamps; plants are models of their own."""
    for number, (name, stretch) in enumerate(furnishing.pieces):
        place, yaw = layout.face(stretch)
        fabric = FABRICS[number % len(FABRICS)]
        _add(spec, f"{name}_{number}", (*_recess(PIECES[name].cells), *PIECES[name].parts), place, yaw, fabric)
    for number, stretch in enumerate(furnishing.windows):
        _add(spec, f"window_{number}", _WINDOW.parts, *layout.face(stretch), FABRICS[stretch.room % len(FABRICS)])
    for number, (name, place, yaw) in enumerate(furnishing.corners):
        if name == "lamp":
            _add(spec, f"lamp_{number}", _LAMP.parts, place, yaw, "")


def _recess(cells: int) -> Iterator[Part]:
    """The boards around a recess: behind and beside it, as high as the wall, each under the wall's cap."""
    half, thin = cells * DEFAULT_CELL_SIZE / 2, _PANEL
    yield Part("planks", (0.0, _DEPTH), (-half, half), (-0.02, 0.0005))
    for deep, across in (
        ((_DEPTH - thin, _DEPTH), (-half, half)),
        *(((0.0, _DEPTH), (a - thin / 2, a + thin / 2)) for a in (thin / 2 - half, half - thin / 2)),
    ):
        yield Part("paint", deep, across, (0, WALL_HEIGHT))
        yield Part("cap", deep, across, (WALL_HEIGHT, WALL_HEIGHT + 0.03))


def _add(spec: mujoco.MjSpec, name: str, parts: tuple[Part, ...], place: np.ndarray, yaw: float, fabric: str) -> None:
    """Add parts at a place; with a yaw of quarter turns but for what is round."""
    (x, y), cosine, sine = place.tolist(), math.cos(yaw), math.sin(yaw)
    turn, visual = [math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)], spec.find_default("house_visual")
    for number, part in enumerate(parts):
        spans = part.deep, part.across, part.up
        deep, across, up = [(first + last) / 2 for first, last in spans]
        half = [abs(last - first) / 2 for first, last in spans]
        spec.worldbody.add_geom(
            visual,
            name=f"{name}_{number}",
            type=mujoco.mjtGeom.mjGEOM_CYLINDER if part.is_round else mujoco.mjtGeom.mjGEOM_BOX,
            material=part.material or fabric,
            pos=[x - deep * cosine - across * sine, y - deep * sine + across * cosine, up],
            size=[half[0], half[2], 0] if part.is_round else half,
            quat=turn,
        )

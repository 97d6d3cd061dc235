"""Furniture that shows the use of rooms: a kitchen, a sofa, beds. For display only, and the same in every scene.

It stands in recesses of the outer walls, flush with the wall's face, and in corners, where nobody can be. The wall
collides and hides things as if there was no furniture.
"""

from __future__ import annotations

import functools
import importlib.resources
import math
import zlib
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import mujoco
import numpy as np

from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import DEFAULT_CELL_SIZE
from caregiver_mj.plans.layout import WALL_HEIGHT, Layout, Stretch, largest_rectangle

_DEPTH = 0.5  # m from the face of a wall to the border of its cell
_PANEL = 0.03  # m; thickness of the boards around a recess
_HALL, _NOOK = 3.5, 6  # ratio of length to width of a hall; rooms with fewer cells are halls, too
_KINDS = "living", "kitchen", "bedroom", "bathroom"  # of rooms, largest first; further ones are bedrooms
TILED = "kitchen", "bathroom"
_PIECES = {  # by room, as far as they fit
    "living": ("sofa", "television", "bookcase"),
    "kitchen": ("counter", "fridge", "stove", "dining"),
    "bedroom": ("bed", "wardrobe", "bookcase"),
    "bathroom": ("bath", "basin", "toilet"),
    "hall": ("wardrobe", "bench"),
}
FABRICS = "rug_blue", "rug_red", "rug_green", "rug_ochre"
_WINDOW_SHARE, _CORNER_SHARE = 0.5, 0.55  # shares of possible places for windows, and for lamps or plants


class Part(NamedTuple):
    """A box or disc of a piece."""

    material: str  # "fabric" for the piece's own
    spans: np.ndarray  # m, intervals behind the wall's face, along the wall, above the floor, (3, 2)
    is_round: bool = False


@functools.cache
def pieces() -> dict[str, tuple[Part, ...]]:
    """Return the parts of every piece of `models/furniture.txt`, including windows and lamps."""
    found: dict[str, tuple[Part, ...]] = {}
    file = importlib.resources.files("caregiver_mj.models") / "furniture.txt"
    for line in file.read_text(encoding="utf-8").splitlines():
        words = line.partition("#")[0].split()
        if len(words) == 1:
            found[name := words[0]] = ()
        elif words:
            found[name] += (Part(words[0], np.array(words[1:7], float).reshape(3, 2), words[7:] == ["round"]),)
    return found


def _cells(name: str) -> int:
    """Return the number of wall cells that a piece fills."""
    return math.ceil(2 * max(np.abs(part.spans[1]).max() for part in pieces()[name]) / DEFAULT_CELL_SIZE)


class Furnishing(NamedTuple):
    """The furniture of a house. A place is a wall's foot, (2,), m, and the yaw that faces the room."""

    kinds: tuple[str, ...]  # of rooms, in the order of `Layout.rooms`
    pieces: tuple[tuple[str, Stretch], ...]  # name, wall cells that it replaces
    windows: tuple[Stretch, ...]
    corners: tuple[tuple[str, np.ndarray, float], ...]  # "lamp" or "plant", place

    @property
    def recesses(self) -> frozenset[Cell]:
        """Wall cells with furniture."""
        return frozenset(cell for _, stretch in self.pieces for cell in stretch.cells)


def furnish(layout: Layout) -> Furnishing:
    """Furnish a house deterministically; with another cell size only with lamps and plants."""
    plan = layout.plan
    random = np.random.default_rng(zlib.crc32("\n".join(plan.rows).encode()))
    kinds = _kinds(layout, random)
    free = list(layout.stretches) if plan.cell_size == DEFAULT_CELL_SIZE else []
    pieces: list[tuple[str, Stretch]] = []
    for room, kind in enumerate(kinds):
        for name in _PIECES[kind]:
            if name == "stove" and ("counter", room) in [(other, stretch.room) for other, stretch in pieces]:
                continue  # the counter has one
            fits = [stretch for stretch in free if stretch.room == room and len(stretch.cells) >= _cells(name)]
            if fits:
                stretch = fits[random.integers(len(fits))]
                free.remove(stretch)
                before, taken, after = stretch.split(_cells(name), random)
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
    """Return the kind of each room, by size; a random draw decides which of the two largest is the kitchen."""
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
    """Add recesses with their pieces, windows and lamps; plants are models of their own."""
    for number, (name, stretch) in enumerate(furnishing.pieces):
        place, yaw = layout.face(stretch)
        fabric = FABRICS[number % len(FABRICS)]
        _add(spec, f"{name}_{number}", (*_recess(_cells(name)), *pieces()[name]), place, yaw, fabric)
    for number, stretch in enumerate(furnishing.windows):
        _add(spec, f"window_{number}", pieces()["window"], *layout.face(stretch), FABRICS[stretch.room % len(FABRICS)])
    for number, (name, place, yaw) in enumerate(furnishing.corners):
        if name == "lamp":
            _add(spec, f"lamp_{number}", pieces()["lamp"], place, yaw, "")


def _recess(cells: int) -> Iterator[Part]:
    """Yield the boards around a recess: behind and beside it, as high as the wall, under the wall's cap."""
    half, thin = cells * DEFAULT_CELL_SIZE / 2, _PANEL
    yield Part("planks", np.array([(0.0, _DEPTH), (-half, half), (-0.02, 0.0005)]))
    for deep, across in (
        ((_DEPTH - thin, _DEPTH), (-half, half)),
        *(((0.0, _DEPTH), (a - thin / 2, a + thin / 2)) for a in (thin / 2 - half, half - thin / 2)),
    ):
        yield Part("paint", np.array([deep, across, (0, WALL_HEIGHT)]))
        yield Part("cap", np.array([deep, across, (WALL_HEIGHT, WALL_HEIGHT + 0.03)]))


def _add(spec: mujoco.MjSpec, name: str, parts: Iterable[Part], place: np.ndarray, yaw: float, fabric: str) -> None:
    """Add parts at a place; unless they are round, yaw must be a multiple of a quarter turn."""
    (x, y), cosine, sine = place.tolist(), math.cos(yaw), math.sin(yaw)
    turn, visual = [math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)], spec.find_default("house_visual")
    for number, part in enumerate(parts):
        (deep, across, up), half = part.spans.mean(axis=1).tolist(), (np.ptp(part.spans, axis=1) / 2).tolist()
        spec.worldbody.add_geom(
            visual,
            name=f"{name}_{number}",
            type=mujoco.mjtGeom.mjGEOM_CYLINDER if part.is_round else mujoco.mjtGeom.mjGEOM_BOX,
            material=fabric if part.material == "fabric" else part.material,
            pos=[x - deep * cosine - across * sine, y - deep * sine + across * cosine, up],
            size=[half[0], half[2], 0] if part.is_round else half,
            quat=turn,
        )

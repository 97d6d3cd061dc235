"""Tiles: what pictures show on the floor that is no part of the house."""

from __future__ import annotations

import caregiver_mj.house.rendering  # noqa: F401 (comes before dm_control)

# isort: split
import dataclasses
from collections.abc import Sequence

import mujoco
import numpy as np
from dm_control.mujoco import engine, wrapper


@dataclasses.dataclass(frozen=True)
class Tile:
    """A translucent block on the floor.

    Attributes:
        centre: x and y of its middle, metres.
        half: Half of its side, metres.
        height: Metres.
        colour: Red, green, blue, of 255.
        opacity: Share of 1.
    """

    centre: tuple[float, float]
    half: float
    height: float
    colour: tuple[int, int, int]
    opacity: float


class TileLayer:
    """Lays tiles over the pictures of a camera, behind whatever hides them.

    MuJoCo's own translucent things take the sun from what is below them; so the tiles are drawn apart, as a mask.
    """

    def __init__(self, physics: engine.Physics, name: str, width: int, height: int):
        self._tiles: Sequence[Tile] = ()
        self._mask = engine.Camera(physics, height, width, name, scene_callback=self._add_tiles)

    def lay(self, picture: np.ndarray, tiles: Sequence[Tile]) -> None:
        """Lays tiles over a picture, (height, width, 3), of the present moment."""
        self._tiles = tiles
        if not tiles:
            return
        number, kind = np.moveaxis(self._mask.render(segmentation=True), 2, 0)
        seen = kind == mujoco.mjtObj.mjOBJ_UNKNOWN  # what is beside the house has number and kind -1
        which = number[seen]
        opacity = np.array([tile.opacity for tile in tiles])[which, None]
        colour = np.array([tile.colour for tile in tiles])[which]
        picture[seen] = (picture[seen] * (1.0 - opacity) + colour * opacity).round()

    def _add_tiles(self, physics: engine.Physics, made: wrapper.MjvScene) -> None:
        """Puts the tiles into a scene that has just been made, as objects of no kind, by their numbers."""
        draw_tiles(made.ptr, self._tiles, solid=True)


def draw_tiles(scene: mujoco.MjvScene, tiles: Sequence[Tile], solid: bool = False) -> None:
    """Adds tiles to what a scene has, as objects of no kind, by their numbers; those for which there is room.

    Args:
        scene: The scene.
        tiles: The tiles.
        solid: Whether to leave their colours and opacities out.
    """
    first = scene.ngeom
    scene.ngeom += min(len(tiles), scene.maxgeom - first)
    for number, (tile, geom) in enumerate(zip(tiles, scene.geoms[first:], strict=False)):
        sides, middle = (tile.half, tile.half, tile.height / 2), (*tile.centre, tile.height / 2)
        rgba = np.ones(4) if solid else np.array([*(part / 255 for part in tile.colour), tile.opacity])
        mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_BOX, sides, middle, np.eye(3).ravel(), rgba)
        geom.objtype, geom.objid, geom.segid = mujoco.mjtObj.mjOBJ_UNKNOWN, number, first + number

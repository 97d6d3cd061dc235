"""Tiles: what pictures show on the floor that is no part of the house."""

from __future__ import annotations

import caregiver_mj.house.rendering  # noqa: F401 (comes before dm_control)

# isort: split
from collections.abc import Sequence

import mujoco
import numpy as np
from dm_control.mujoco import engine

from caregiver_mj.viz.forecast import Tile
from caregiver_mj.viz.still_camera import StillCamera

_FIRST = 1 << 16  # the number of the first tile in a mask, beyond those of all else


class TileLayer(StillCamera):
    """Lays tiles over the pictures of a camera, behind whatever hides them.

    MuJoCo's own translucent things take the sun from what is below them; so the tiles are drawn apart, as a mask: a
    picture in which the colour of everything is its number.
    """

    def __init__(self, physics: engine.Physics, name: str, width: int, height: int, still: bool = True):
        """Sets the camera up.

        Args:
            physics: The house.
            name: Name of the camera.
            width: Width of its pictures, pixels.
            height: Their height.
            still: Whether it does not move.
        """
        super().__init__(physics, name, width, height, shadows=False)
        self._tiles: Sequence[Tile] = ()
        self._still = still
        flags, flag = self.view.scene.flags, mujoco.mjtRndFlag
        flags[flag.mjRND_SEGMENT] = flags[flag.mjRND_IDCOLOR] = True
        flags[flag.mjRND_SKYBOX] = flags[flag.mjRND_REFLECTION] = False

    def lay(self, picture: np.ndarray, tiles: Sequence[Tile]) -> None:
        """Lays tiles over a picture, (height, width, 3), of the present moment."""
        if list(tiles) != list(self._tiles) or not self._still:
            self.forget()
        self._tiles = tiles
        if not tiles:
            return
        mask = self.render()
        seen = mask[..., 2] >= _FIRST >> 16
        which = (mask[seen].astype(np.int32) << (0, 8, 16)).sum(axis=1) - 1 - _FIRST
        opacity = np.array([tile.opacity for tile in tiles])[which, None]
        colour = np.array([tile.colour for tile in tiles])[which]
        picture[seen] = (picture[seen] * (1.0 - opacity) + colour * opacity).round()

    def set_scene(self) -> None:
        """Makes the scene that is drawn, with the tiles."""
        super().set_scene()
        draw_tiles(self.view.scene.ptr, self._tiles, first=_FIRST)


def draw_tiles(scene: mujoco.MjvScene, tiles: Sequence[Tile], first: int | None = None) -> None:
    """Adds tiles to what a scene has; those for which there is room.

    Args:
        scene: The scene.
        tiles: The tiles.
        first: Number of the first in a mask, for which they are solid; None if it is a picture.
    """
    begin = scene.ngeom
    scene.ngeom += min(len(tiles), scene.maxgeom - begin)
    for number, (tile, geom) in enumerate(zip(tiles, scene.geoms[begin:], strict=False)):
        sides, middle = (tile.half, tile.half, tile.height / 2), (*tile.centre, tile.height / 2)
        rgba = np.array([*(part / 255 for part in tile.colour), tile.opacity]) if first is None else np.ones(4)
        mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_BOX, sides, middle, np.eye(3).ravel(), rgba)
        geom.objtype = mujoco.mjtObj.mjOBJ_UNKNOWN
        geom.segid = begin + number if first is None else first + number

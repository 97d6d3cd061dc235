"""What the floor and the ground look like."""

from __future__ import annotations

import functools
import itertools

import mujoco
import numpy as np
from scipy import ndimage

from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan

FLOOR = "planks"  # the geom that shows the floor

_GROUND_MARGIN = 40.0  # metres of ground around the house
_WOOD_LENGTH = 2.4  # metres that the picture of the wooden floor covers
_GROUND_LENGTH = 6.0  # metres


def add_ground(spec: mujoco.MjSpec, plan: FloorPlan) -> None:
    """Adds what the floor and the ground look like; what candles fall on is the plane of `scene.xml`."""
    _add_texture(spec, FLOOR, _planks())
    _add_texture(spec, "grass", _grass())
    _add_surface(spec, FLOOR, layout.floor_rectangles(plan), _WOOD_LENGTH)
    _add_surface(spec, "grass", layout.ground_rectangles(plan, _GROUND_MARGIN), _GROUND_LENGTH)


def _add_surface(spec: mujoco.MjSpec, name: str, rectangles: np.ndarray, length: float) -> None:
    """Adds a horizontal surface with holes, at height 0, as a mesh under one seamless picture.

    Args:
        spec: The scene, with a material and a texture of that name.
        name: Name of the geom, its mesh and its material.
        rectangles: Disjoint rectangles that make up the surface, (n, 4).
        length: Metres that the picture covers before it repeats.
    """
    centre, half = rectangles[:, None, :2], rectangles[:, None, 2:]
    corners = (centre + half * [[-1, -1], [1, -1], [1, 1], [-1, 1]]).reshape(-1, 2)  # (4 n, 2)
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    faces = (4 * np.arange(len(rectangles))[:, None, None] + triangles).reshape(-1, 3)  # (2 n, 3)
    mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    mesh.uservert = np.pad(corners, ((0, 0), (0, 1))).ravel()
    mesh.usertexcoord = (corners / length).ravel()
    mesh.userface = faces.ravel()
    spec.worldbody.add_geom(
        spec.find_default("house_visual"), name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, material=name
    )


def _add_texture(spec: mujoco.MjSpec, name: str, picture: np.ndarray) -> None:
    """Adds a texture from a picture (height, width, 3) of bytes, and its material."""
    height, width, channels = picture.shape
    texture = spec.add_texture(name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height)
    texture.nchannel = channels
    texture.data = picture.tobytes()
    material = spec.add_material(name=name, specular=0.1, shininess=0.1)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name


@functools.cache
def _planks(size: int = 1024, courses: int = 20) -> np.ndarray:
    """A picture (size, size, 3) of floorboards, in courses with staggered joints; it repeats without a seam."""
    random = np.random.default_rng(0)
    picture = np.empty((size, size, 3))
    borders = np.linspace(0, size, courses + 1).astype(int)
    for top, bottom in itertools.pairwise(borders):
        grain = ndimage.gaussian_filter(random.standard_normal((bottom - top, size)), (0.8, 24), mode="wrap")
        shade = 1 + 0.035 * grain / grain.std()
        joint = random.integers(size)
        for start, end in ((0, size // 2), (size // 2, size)):
            board = np.arange(start, end)
            shade[:, board] *= random.uniform(0.86, 1.06)
            shade[:, board[:2]] *= 0.72
        shade[:2] *= 0.72
        picture[top:bottom] = np.roll(shade, joint, axis=1)[..., None]
    return (picture * [196, 150, 104]).clip(0, 255).astype(np.uint8)


@functools.cache
def _grass(size: int = 512) -> np.ndarray:
    """A picture (size, size, 3) of a lawn; it repeats without a seam."""
    random = np.random.default_rng(0)
    shade = np.ones((size, size))
    for blur, strength in ((1, 0.035), (6, 0.03), (40, 0.03)):
        noise = ndimage.gaussian_filter(random.standard_normal((size, size)), blur, mode="wrap")
        shade += strength * noise / noise.std()
    return (shade[..., None] * [150, 172, 118]).clip(0, 255).astype(np.uint8)

"""Walls, ground, decor and cameras of the house. All but walls and stairs are for display only."""

from __future__ import annotations

import functools
import importlib.resources
import itertools
import math

import mujoco
import numpy as np

from caregiver_mj.house.furniture import FABRICS, TILED, Furnishing, add_furniture, furnish
from caregiver_mj.plans import layout as sizes
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import TABLE
from caregiver_mj.plans.layout import WALL_HEIGHT, Layout, largest_rectangle

_CAP_HEIGHT = 0.03  # m; thickness of the board on top of a wall
_SKIRTING_HEIGHT, _SKIRTING_DEPTH = 0.07, 0.012  # m
_JAMB_WIDTH, _JAMB_HEIGHT = 0.035, 0.94  # m; just above the board on top of the walls
_RUG_LARGEST, _RUG_GAP = 2.6, 0.35  # m; longest side of a rug, and its distance from the walls' cells
# Decorations stand before walls, at most 0.2 m deep, in the part of a wall's cell that the thin wall leaves.
_DECORATIONS = "bookshelf", "picture", "plant", "sideboard"
_FLAT = ("picture",)  # children bump into walls from the free cells before them
_DECORATED_SHARE = 0.25  # share of possible places
FLOOR = "planks"  # geom of the visible floor
OPAQUE = 1  # group of geoms that hide things without collisions
_GROUND_MARGIN = 40.0  # m of ground around the house
_WOOD_LENGTH = 2.4  # m covered by the picture of the wooden floor
_GROUND_LENGTH, _TILES_LENGTH = 6.0, 1.0  # m covered by the others
_TILES_HEIGHT = 0.0015  # m; below the rugs
_TO_THE_BOARD = ("leg_ne", "leg_nw", "leg_sw", "leg_se", "top")  # parts of a table up to its board
_LOOK = "look"  # name of a body with only the visible parts of its parent
# The overview camera looks north and down, and shows the whole house in pictures of at least 4:3.
_OVERVIEW_ELEVATION = np.radians(60.0)
_OVERVIEW_FOVY = 30.0  # degrees; a long lens, so that near walls do not hide rooms
_OVERVIEW_ASPECT = 4 / 3
_OVERVIEW_MARGIN = 1.04  # size of the picture relative to that of the house
_FOLLOW_OFFSET = (0.0, -1.75, 2.3)  # m from the first child; the line of sight passes over walls
_FOLLOW_FOVY = 50.0  # degrees
_NEAREST = 0.02  # m; nearest distance drawn, small for the gripper's camera
# m; MuJoCo's margin against speckled shadows is a tiny fraction of this: enough for door frames a centimetre deep
_FARTHEST = 32000.0


def add_walls(spec: mujoco.MjSpec, layout: Layout) -> None:
    """Add the walls for collisions."""
    height = WALL_HEIGHT
    for i, wall in enumerate(layout.walls):
        # Geoms of the world body, so that MuJoCo's midphase culls among them.
        spec.worldbody.add_geom(
            spec.find_default("house_collision"),
            name=f"wall_{i}",
            pos=[wall[0], wall[1], height / 2],
            size=[wall[2], wall[3], height / 2],
        )


def add_visuals(spec: mujoco.MjSpec, layout: Layout) -> None:
    """Add everything that is for display only."""
    furnishing = furnish(layout)
    for i, wall in enumerate(layout.walls_without(furnishing.recesses)):
        add_box(spec, f"paint_{i}", "paint", wall, 0, WALL_HEIGHT)
        add_box(spec, f"cap_{i}", "cap", wall, WALL_HEIGHT, WALL_HEIGHT + _CAP_HEIGHT)
        add_box(spec, f"skirting_{i}", "skirting", wall, 0, _SKIRTING_HEIGHT, margin=_SKIRTING_DEPTH)
    _add_ground(spec, layout, furnishing)
    _add_doorways(spec, layout)
    _add_rugs(spec, layout, furnishing)
    add_furniture(spec, layout, furnishing)
    _add_decorations(spec, layout, furnishing)


def _add_doorways(spec: mujoco.MjSpec, layout: Layout) -> None:
    plan, half_wall = layout.plan, layout.wall_thickness / 2
    half_width = plan.cell_size - half_wall
    for i, (cell, (down, _)) in enumerate(layout.doorways):
        # Half sides across and along the doorway, in the order x, y.
        order = [0, 1] if down else [1, 0]
        centre, across = plan.position(cell), np.array([1, 0])[order]
        sill = np.array([half_width, half_wall])[order]
        jamb = np.array([_JAMB_WIDTH / 2, half_wall + _SKIRTING_DEPTH])[order]
        add_box(spec, f"threshold_{i}", "threshold", np.array([*centre, *sill]), 0, 0.004)
        for side, sign in (("a", -1), ("b", 1)):
            middle = centre + sign * (half_width - _JAMB_WIDTH / 2) * across
            add_box(spec, f"jamb_{i}{side}", "jamb", np.array([*middle, *jamb]), 0, _JAMB_HEIGHT)


def _add_rugs(spec: mujoco.MjSpec, layout: Layout, furnishing: Furnishing) -> None:
    """Add a rug to every room with enough space and no tiles."""
    plan = layout.plan
    landing = np.zeros(plan.shape, bool)
    for cell in plan.stairwells:
        landing[cell] = True
    for i, room in enumerate(layout.rooms):
        first, last = largest_rectangle(room & ~landing)
        corners = plan.position(first), plan.position(last)
        half = np.abs(corners[1] - corners[0]) / 2 + plan.cell_size / 2 - _RUG_GAP
        half = half.clip(max=[_RUG_LARGEST / 2, _RUG_LARGEST / 2])
        if half.min() < 0.3 or furnishing.kinds[i] in TILED:
            continue
        rug = np.array([*(corners[0] + corners[1]) / 2, *half])
        for layer, (material, inset) in enumerate((("rug_border", 0.0), (FABRICS[i % len(FABRICS)], 0.06))):
            add_box(spec, f"rug_{i}_{layer}", material, rug, 0, 0.003 + 0.002 * layer, margin=-inset)


def _add_decorations(spec: mujoco.MjSpec, layout: Layout, furnishing: Furnishing) -> None:
    """Put decorations at walls, out of the children's way, and plants into corners."""
    plan, random = layout.plan, np.random.default_rng(0)
    taken = {cell for stretch in furnishing.windows for cell in stretch.cells} | furnishing.recesses
    plants = [corner for corner in furnishing.corners if corner[0] == "plant"]
    placed = [(name, f"corner_{i}", place, yaw) for i, (name, place, yaw) in enumerate(plants)]
    for i, (position, yaw) in enumerate(layout.wall_places()):
        behind = position - layout.wall_thickness / 2 * np.array([np.cos(yaw), np.sin(yaw)])
        before = position + plan.cell_size / 2 * np.array([np.cos(yaw), np.sin(yaw)])
        if random.random() < _DECORATED_SHARE and plan.cell_at(behind) not in taken:
            known = _FLAT if plan.cell_at(before) in plan.cell_index else _DECORATIONS
            placed.append((known[random.integers(len(known))], str(i), position, yaw))
    # The time to attach grows with the scene, so they are gathered in small scenes first.
    size = 1 + math.isqrt(len(placed))
    for first in range(0, len(placed), size):
        some = mujoco.MjSpec()
        for model, name, position, yaw in placed[first : first + size]:
            place_model(some, read_model(model), name, position, yaw)
        spec.attach(some, prefix="decoration_", frame=spec.worldbody.add_frame())


def _add_ground(spec: mujoco.MjSpec, layout: Layout, furnishing: Furnishing) -> None:
    """Add the appearance of floor and ground; candles fall on the plane of `scene.xml`."""
    _add_surface(spec, FLOOR, layout.floor, _WOOD_LENGTH)
    _add_surface(spec, "grass", layout.ground(_GROUND_MARGIN), _GROUND_LENGTH)
    tiled = [layout.room_floor(i) for i, kind in enumerate(furnishing.kinds) if kind in TILED]
    if tiled:
        _add_texture(spec, "tiles", _tiles())
        _add_surface(spec, "tiles", np.concatenate(tiled), _TILES_LENGTH, _TILES_HEIGHT)


def _add_surface(spec: mujoco.MjSpec, name: str, rectangles: np.ndarray, length: float, height: float = 0.0) -> None:
    """Add a horizontal surface with holes at a height, m, as a mesh of disjoint rectangles (n, 4).

    Its material of the same name has a seamless picture that repeats after `length` metres.
    """
    centre, half = rectangles[:, None, :2], rectangles[:, None, 2:]
    corners = (centre + half * [[-1, -1], [1, -1], [1, 1], [-1, 1]]).reshape(-1, 2)  # (4 n, 2)
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    faces = (4 * np.arange(len(rectangles))[:, None, None] + triangles).reshape(-1, 3)  # (2 n, 3)
    mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    mesh.uservert = np.pad(corners, ((0, 0), (0, 1)), constant_values=height).ravel()
    mesh.usertexcoord = (corners / length).ravel()
    mesh.userface = faces.ravel()
    spec.worldbody.add_geom(
        spec.find_default("house_visual"), name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, material=name
    )


def _add_texture(spec: mujoco.MjSpec, name: str, picture: np.ndarray) -> None:
    """Add a texture from a picture (height, width, 3), uint8, and its material."""
    height, width, channels = picture.shape
    texture = spec.add_texture(name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height)
    texture.nchannel = channels
    texture.data = picture.tobytes()
    material = spec.add_material(name=name, specular=0.1, shininess=0.1)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name


@functools.cache
def _planks(size: int = 1024, courses: int = 20) -> np.ndarray:
    """Return a seamless picture (size, size, 3) of floorboards, in courses with staggered joints."""
    random = np.random.default_rng(0)
    picture = np.empty((size, size, 1))
    borders = np.linspace(0, size, courses + 1).astype(int)
    for top, bottom in itertools.pairwise(borders):
        shade = 1 + 0.035 * _soft_noise(random, (bottom - top, size), (0.8, 24))
        joint = random.integers(size)
        for start, end in ((0, size // 2), (size // 2, size)):
            board = np.arange(start, end)
            shade[:, board] *= random.uniform(0.86, 1.06)
            shade[:, board[:2]] *= 0.72
        shade[:2] *= 0.72
        picture[top:bottom] = np.roll(shade, joint, axis=1)[..., None]
    return (picture * [196, 150, 104]).clip(0, 255).astype(np.uint8)


@functools.cache
def _tiles(size: int = 256, count: int = 4) -> np.ndarray:
    """Return a picture (size, size, 3) of tiles with joints, alternately light and dark."""
    place = np.arange(size)
    joint = place % (size // count) < 3
    dark = (place[:, None] * count // size + place * count // size) % 2
    shade = np.where(joint[:, None] | joint, 0.80, 1.0 - 0.09 * dark)
    return (shade[..., None] * [226, 229, 228]).astype(np.uint8)


@functools.cache
def _grass(size: int = 512) -> np.ndarray:
    """Return a seamless picture (size, size, 3) of a lawn."""
    random = np.random.default_rng(0)
    shade = np.ones((size, size))
    for blur, strength in ((1, 0.035), (6, 0.03), (40, 0.03)):
        shade += strength * _soft_noise(random, (size, size), (blur, blur))
    return (shade[..., None] * [150, 172, 118]).clip(0, 255).astype(np.uint8)


def _soft_noise(random: np.random.Generator, shape: tuple[int, int], blur: tuple[float, float]) -> np.ndarray:
    """Return seamless blurred noise of deviation 1, by its spectrum: several times faster than a wide filter."""
    spectrum = np.fft.rfft2(random.standard_normal(shape))
    across, along = (np.exp(-2 * (np.pi * blur[i] * np.fft.fftfreq(shape[i])) ** 2) for i in (0, 1))
    noise = np.fft.irfft2(spectrum * across[:, None] * along[: spectrum.shape[1]], shape)
    return np.asarray(noise / noise.std())


def read_model(name: str, visuals: bool = True) -> mujoco.MjSpec:
    """Read a model of the package; visuals are removed here, which is faster than in a scene."""
    return _parsed(name, visuals).copy()  # ten times as fast as parsing


@functools.cache
def _parsed(name: str, visuals: bool) -> mujoco.MjSpec:
    file = importlib.resources.files("caregiver_mj.models") / f"{name}.xml"
    model = mujoco.MjSpec.from_string(file.read_text(encoding="utf-8"))
    if not visuals:
        remove_visuals(model)
    elif name == "scene":  # here, because copying pictures is faster than attaching them
        _add_texture(model, FLOOR, _planks())
        _add_texture(model, "grass", _grass())
    return model


def table_model(height: float, visuals: bool = True) -> mujoco.MjSpec:
    """Return the model of a table whose top is at a height, m."""
    model = read_model(TABLE.model, visuals)
    higher = height - sizes.TABLE_HEIGHT
    for geom in model.geoms if higher else ():
        if geom.name in _TO_THE_BOARD:
            geom.pos[2] += higher / 2
            geom.size[2] += higher / 2
        elif geom.name != "shelf":  # the shelf stays in place
            geom.pos[2] += higher
    return model


def place_model(spec: mujoco.MjSpec, model: mujoco.MjSpec, name: str, position: np.ndarray, yaw: float = 0.0) -> None:
    """Add a fixed model at a position (2,), m, turned by yaw, rad.

    It becomes part of the world body. MuJoCo first searches pairs of bodies, going through the geoms of all but that
    one; within a body it finds geoms by a tree.
    """
    quaternion = [np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]
    spec.attach(model, prefix=f"{name}/", frame=spec.worldbody.add_frame(pos=[*position, 0], quat=quaternion))


def remove_visuals(spec: mujoco.MjSpec) -> None:
    """Remove from a scene everything for display only. The simulation stays exactly the same, and is faster.

    Geoms that have mass or hide things from a robot's eye stay.
    """
    for body in [body for body in spec.bodies if body.name.rpartition("/")[2] == _LOOK]:
        spec.delete(body)
    for geom in spec.geoms:
        weightless = geom.mass == 0 or geom.parent.name == "world"
        if weightless and not (geom.contype or geom.conaffinity or geom.group == OPAQUE):
            spec.delete(geom)


def add_box(
    spec: mujoco.MjSpec, name: str, material: str, rectangle: np.ndarray, bottom: float, top: float, margin: float = 0.0
) -> None:
    """Add a box for display over a rectangle (4,) with a margin, between two heights, m."""
    x, y, half_x, half_y = rectangle
    spec.worldbody.add_geom(
        spec.find_default("house_visual"),
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        material=material,
        pos=[x, y, (top + bottom) / 2],
        size=[half_x + margin, half_y + margin, (top - bottom) / 2],
    )


def add_cameras(spec: mujoco.MjSpec, plan: FloorPlan) -> None:
    """Add the cameras, and set extent, clipping and the sun's position."""
    half_y, half_x = np.array(plan.shape) * plan.cell_size / 2
    extent = max(half_x, half_y)
    spec.stat.center = [0, 0, WALL_HEIGHT / 2]
    spec.stat.extent = extent
    spec.visual.map.znear = _NEAREST / extent
    spec.visual.map.zfar = _FARTHEST / extent

    radius = np.hypot(half_x, half_y) + WALL_HEIGHT
    spec.visual.map.shadowclip = radius / extent
    sun = spec.light("sun")
    sun.pos = -2 * radius * sun.dir / np.linalg.norm(sun.dir)

    corners = np.array(np.meshgrid([-half_x, half_x], [-half_y, half_y], [0, WALL_HEIGHT])).reshape(3, -1).T
    cosine, sine = np.cos(_OVERVIEW_ELEVATION), np.sin(_OVERVIEW_ELEVATION)
    axes = np.array([[1, 0, 0], [0, -sine, cosine], [0, -cosine, -sine]])
    high = np.tan(np.radians(_OVERVIEW_FOVY) / 2) / _OVERVIEW_MARGIN
    eye = nearest_eye(corners, axes, (high * _OVERVIEW_ASPECT, high * _OVERVIEW_ASPECT), high)
    _add_camera(spec.worldbody, "overview", eye, axes[:, 2], _OVERVIEW_FOVY)

    offset = np.array(_FOLLOW_OFFSET)
    follow = _add_camera(spec.body("toddler/toddler"), "follow", offset, -offset, _FOLLOW_FOVY)
    follow.mode = mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM


def _add_camera(
    body: mujoco.MjsBody, name: str, position: np.ndarray, forward: np.ndarray, fovy: float
) -> mujoco.MjsCamera:
    """Add a camera that looks along a direction in the y-z plane, with x to the right."""
    pitch = np.arctan2(forward[1], -forward[2])  # from straight down
    return body.add_camera(name=name, pos=position, quat=[np.cos(pitch / 2), np.sin(pitch / 2), 0, 0], fovy=fovy)


def nearest_eye(corners: np.ndarray, axes: np.ndarray, wide: tuple[float, float], high: float) -> np.ndarray:
    """Return the nearest position (3,), m, from which a camera has all corners (n, 3) in its picture.

    A corner that is u to the right and f ahead of the origin is in the picture of a camera that is d behind and s to
    the right of it if -left <= (u - s) / (f + d) <= right. Both bounds are linear in d and s; so are those of the
    height.

    Args:
        corners: Corners, m.
        axes: Axes of the picture to the right, down, and ahead, (3, 3), a column each.
        wide: Extent of the picture to the left and right at a distance of 1 m, m.
        high: Extent of the picture up and down at that distance, m.
    """
    u, v, f = (corners @ axes).T

    def bounds(along: np.ndarray, before: float, after: float) -> tuple[float, float]:
        return float((-along - before * f).max()), float((along - after * f).max())

    (left_most, right_most), (top_most, bottom_most) = bounds(u, *wide), bounds(v, high, high)
    distance = max((left_most + right_most) / sum(wide), (top_most + bottom_most) / (2 * high))
    aside = (right_most - wide[1] * distance + wide[0] * distance - left_most) / 2
    below = (bottom_most - top_most) / 2
    eye: np.ndarray = axes @ [aside, below, -distance]
    return eye

"""The house as a MuJoCo scene, built from a floor plan and the files in `models/`.

Names: what stands several times in the house is numbered in the order of the floor plan and its elements are
prefixed, as `table_0/top`, `candle_2/wax`, `bin_1/box`, `stairwell_0/trigger`; the rest are `toddler/...`,
`robot/...` and, for the house itself, `floor`, `wall_0` and so on. Cameras: `overview`, `follow`.
"""

from __future__ import annotations

import importlib.resources

import mujoco
import numpy as np

from caregiver_mj import layout
from caregiver_mj.floor_plan import FloorPlan


# The overview camera looks north and down, and shows the whole house in pictures of 4:3 and anything wider.
_OVERVIEW_ELEVATION = np.radians(60.0)
_OVERVIEW_FOVY = 30.0  # degrees; a long lens, so that near walls do not hide the rooms behind them
_OVERVIEW_ASPECT = 4 / 3
_OVERVIEW_MARGIN = 1.04  # size of the picture relative to that of the house

_FOLLOW_OFFSET = (0.0, -1.75, 2.3)  # metres from the toddler; the line of sight passes over walls
_FOLLOW_FOVY = 50.0  # degrees

_NEAREST = 0.02  # metres; nothing nearer to a camera is drawn, and the gripper's camera is very near
_FARTHEST = 200.0  # metres


def build_house(plan: FloorPlan, robot: bool = True) -> mujoco.MjSpec:
    """Builds the scene of a house.

    Args:
        plan: The floor plan.
        robot: Whether the robot is in it; its base joints have their zero at the house's origin.

    Returns:
        A specification to compile. The toddler's joints have their zero at the house's origin too.
    """
    spec = _model("scene")
    _add_walls(spec, plan)
    for i, cell in enumerate(plan.tables):
        _place(spec, "table", f"table_{i}", plan.position(cell))
    for i, cell in enumerate(plan.bins):
        _place(spec, "toy_bin", f"bin_{i}", plan.position(cell))
    for i, table in enumerate(plan.candle_tables):
        frame = spec.worldbody.add_frame(pos=[*plan.position(plan.tables[table]), layout.TABLE_HEIGHT])
        spec.attach(_model("candle"), prefix=f"candle_{i}/", frame=frame)
    _add_stairwells(spec, plan)
    spec.attach(_model("toddler"), prefix="toddler/", frame=spec.worldbody.add_frame())
    _add_cameras(spec, plan)
    if robot:
        spec.attach(_model("robot"), prefix="robot/", frame=spec.worldbody.add_frame())
    return spec


def _model(name: str) -> mujoco.MjSpec:
    """Reads a model of the package."""
    file = importlib.resources.files("caregiver_mj.models") / f"{name}.xml"
    return mujoco.MjSpec.from_string(file.read_text(encoding="utf-8"))


def _place(spec: mujoco.MjSpec, model: str, name: str, position: np.ndarray, yaw: float = 0.0) -> mujoco.MjsBody:
    """Adds a static body that holds a model's geoms, at a position (2,) in metres, turned by yaw in radians."""
    quaternion = [np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]
    body = spec.worldbody.add_body(name=name, pos=[*position, 0], quat=quaternion)
    spec.attach(_model(model), prefix=f"{name}/", frame=body.add_frame())
    return body


def _add_walls(spec: mujoco.MjSpec, plan: FloorPlan) -> None:
    collision = spec.find_default("house_collision")
    visual = spec.find_default("house_visual")
    half_height = layout.WALL_HEIGHT / 2
    for i, (x, y, half_x, half_y) in enumerate(layout.wall_rectangles(plan)):
        box = {"pos": [x, y, half_height], "size": [half_x, half_y, half_height]}
        # Collision geoms of the world itself, so that MuJoCo's midphase culls among them.
        spec.worldbody.add_geom(collision, name=f"wall_{i}", **box)
        spec.worldbody.add_geom(visual, name=f"paint_{i}", type=mujoco.mjtGeom.mjGEOM_BOX, material="paint", **box)


def _add_stairwells(spec: mujoco.MjSpec, plan: FloorPlan) -> None:
    for i, (cell, step) in enumerate(zip(plan.stairwells, layout.stair_directions(plan), strict=True)):
        if step is None:
            _place(spec, "hatch", f"stairwell_{i}", plan.position(cell))
        else:
            down, right = step
            _place(spec, "stairwell", f"stairwell_{i}", plan.position(cell), yaw=np.arctan2(-down, right))


def _add_cameras(spec: mujoco.MjSpec, plan: FloorPlan) -> None:
    half_y, half_x = np.array(plan.shape) * plan.cell_size / 2
    extent = max(half_x, half_y)
    spec.stat.center = [0, 0, layout.WALL_HEIGHT / 2]
    spec.stat.extent = extent
    spec.visual.map.znear = _NEAREST / extent
    spec.visual.map.zfar = _FARTHEST / extent

    corners = np.array(np.meshgrid([-half_x, half_x], [-half_y, half_y], [0, layout.WALL_HEIGHT])).reshape(3, -1).T
    forward = np.array([0, np.cos(_OVERVIEW_ELEVATION), -np.sin(_OVERVIEW_ELEVATION)])
    _add_camera(spec.worldbody, "overview", _overview_position(corners, forward), forward, _OVERVIEW_FOVY)

    offset = np.array(_FOLLOW_OFFSET)
    follow = _add_camera(spec.body("toddler/toddler"), "follow", offset, -offset, _FOLLOW_FOVY)
    follow.mode = mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM


def _add_camera(
    body: mujoco.MjsBody, name: str, position: np.ndarray, forward: np.ndarray, fovy: float
) -> mujoco.MjsCamera:
    """Adds a camera that looks along a direction in the plane of y and z, with x to the right."""
    pitch = np.arctan2(forward[1], -forward[2])  # from straight down
    return body.add_camera(name=name, pos=position, quat=[np.cos(pitch / 2), np.sin(pitch / 2), 0, 0], fovy=fovy)


def _overview_position(corners: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """The nearest position from which a camera sees all corners.

    A corner at height v and depth f in camera coordinates is in the picture if |v - s| <= t (f + d), where t is the
    tangent of half the vertical field of view, d the camera's distance behind and s its shift above the origin.
    Both bounds are linear in d and s, so the narrowest fit of top and bottom has a closed form; the width adds
    |u| <= t_x (f + d).

    Args:
        corners: Points that must be seen, (n, 3).
        forward: Direction of view, (3,), in the plane of y and z.

    Returns:
        Position (3,).
    """
    right = np.array([1.0, 0, 0])
    up = np.cross(right, forward)
    u, v, f = corners @ right, corners @ up, corners @ forward
    tangent = np.tan(np.radians(_OVERVIEW_FOVY) / 2) / _OVERVIEW_MARGIN
    top, bottom = (v / tangent - f).max(), (-v / tangent - f).max()
    width = (np.abs(u) / (tangent * _OVERVIEW_ASPECT) - f).max()
    distance = max((top + bottom) / 2, width)
    return up * tangent * (top - bottom) / 2 - forward * distance

"""The house as a MuJoCo scene, built from a floor plan and the files in `models/`.

Names: repeated things are numbered in the order of the floor plan and prefix their elements: `table_0/top`,
`candle_2/wax`, `bin_1/box`, `stairwell_0/trigger`. The robot's elements are `robot/...`, the children's `toddler/...`,
`toddler_1/...`, `toddler_2/...` and so on, the house's own `floor`, `wall_0` and so on. Cameras have no prefix:
`overview`, `follow`, and those of the robot, such as `wrist`.
"""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.house import fittings
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import DEFAULT_CELL_SIZE, FloorPlan
from caregiver_mj.plans.hazards import Where
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.robot_model import add_tray, read_spec

# Clothes that distinguish further children, in turn; the first has those of its model.
_CLOTHES = (
    {"shirt": (0.55, 0.78, 0.60, 1.0), "dungarees": (0.62, 0.30, 0.36, 1.0), "hair": (0.20, 0.14, 0.10, 1.0)},
    {"shirt": (0.86, 0.52, 0.62, 1.0), "dungarees": (0.33, 0.45, 0.38, 1.0), "hair": (0.80, 0.62, 0.34, 1.0)},
    {"shirt": (0.55, 0.72, 0.90, 1.0), "dungarees": (0.85, 0.60, 0.30, 1.0), "hair": (0.60, 0.30, 0.16, 1.0)},
)
# Colours of further tables and toy bins, in turn.
_TABLES: tuple[Mapping[str, tuple[float, ...]], ...] = (
    {},
    {"wood": (0.93, 0.92, 0.89, 1.0), "frame": (0.86, 0.85, 0.82, 1.0), "runner": (0.62, 0.73, 0.80, 1.0)},
    {"wood": (0.38, 0.25, 0.17, 1.0), "frame": (0.32, 0.21, 0.15, 1.0), "runner": (0.83, 0.42, 0.34, 1.0)},
)
_BINS: tuple[Mapping[str, tuple[float, ...]], ...] = (
    {},
    {"panel": (0.86, 0.48, 0.42, 1.0), "inside": (0.55, 0.28, 0.25, 1.0)},
    {"panel": (0.86, 0.71, 0.47, 1.0), "inside": (0.56, 0.44, 0.28, 1.0), "star": (0.45, 0.66, 0.50, 1.0)},
)


def build_house(
    plan: FloorPlan,
    robot: bool | str | Embodiment = True,
    table_positions: np.ndarray | None = None,
    children: int = 1,
    visuals: bool = True,
    table_heights: np.ndarray | None = None,
) -> mujoco.MjSpec:
    """Build the scene of a house, at whose origin the joints of the robot's base and of the children are zero.

    Args:
        plan: The floor plan.
        robot: The robot or its name; True for the default one, False for none.
        table_positions: Centres of the tables, (tables, 2), m, if not those of their cells.
        children: Number of children, who do not collide with each other.
        visuals: Whether to add elements for display only, which slow the simulation down without changing it.
        table_heights: Heights of the tables' tops, (tables,), m, if not the model's.

    Raises:
        CaregiverError: It has gates, which have a fixed size, with another cell size; or things on the floor, for which
            the robot has no tray.
    """
    spec = fittings.read_model("scene", visuals)
    shapes = layout.Layout(plan)
    fittings.add_walls(spec, shapes)
    if table_positions is None:
        table_positions = shapes.tables[:, :2]
    if table_heights is None:
        table_heights = np.full(len(plan.tables), layout.TABLE_HEIGHT)
    for i, (position, height) in enumerate(zip(table_positions, table_heights, strict=True)):
        table = _painted(fittings.table_model(height, visuals), _TABLES[i % len(_TABLES)])
        fittings.place_model(spec, table, f"table_{i}", position)
    for i, cell in enumerate(plan.bins):
        toy_bin = _painted(fittings.read_model("toy_bin", visuals), _BINS[i % len(_BINS)])
        fittings.place_model(spec, toy_bin, f"bin_{i}", plan.position(cell))
    on_tables = [(*table_positions[table], table_heights[table]) for table in plan.candle_tables]
    on_floor = [(*plan.position(plan.free_cells[cell]), 0.0) for cell in plan.floor_cells]
    movable = plan.hazards.at(Where.ON_TABLE) + plan.hazards.at(Where.FLOOR)
    for hazard, place in zip(movable, on_tables + on_floor, strict=True):
        frame = spec.worldbody.add_frame(pos=place)
        spec.attach(fittings.read_model(hazard.kind.model, visuals), prefix=f"{hazard.element}/", frame=frame)
    _add_stairwells(spec, plan, visuals)
    for k in range(children):
        child = _painted(fittings.read_model("toddler", visuals), _CLOTHES[(k - 1) % len(_CLOTHES)] if k else {})
        spec.attach(child, prefix=child_prefix(k), frame=spec.worldbody.add_frame())
    if robot is not False:
        _add_robot(spec, find_embodiment(None if robot is True else robot), has_tray=bool(plan.floor_cells))
    if visuals:  # last: the time to attach a model grows with the scene
        fittings.add_visuals(spec, shapes)
    fittings.add_cameras(spec, plan)
    _shorten_camera_names(spec)
    if not visuals:
        fittings.remove_visuals(spec)
    return spec


def child_prefix(child: int) -> str:
    """Return the prefix of the names of a child's elements."""
    return f"toddler_{child}/" if child else "toddler/"


def child_joints(child: int) -> tuple[str, ...]:
    """Return the names of a child's joints: x, y and yaw."""
    return tuple(child_prefix(child) + joint for joint in ("x", "y", "yaw"))


def _painted(model: mujoco.MjSpec, colours: Mapping[str, tuple[float, ...]]) -> mujoco.MjSpec:
    """Return a model with other colours of some materials."""
    for material, rgba in colours.items():
        model.material(material).rgba = rgba
    return model


def _add_robot(spec: mujoco.MjSpec, robot: Embodiment, has_tray: bool) -> None:
    spec.attach(read_spec(robot.model), prefix="robot/", frame=spec.worldbody.add_frame())
    if has_tray:
        if robot.tray is None:
            raise CaregiverError(f"a robot must have a tray where things lie on the floor, and '{robot.name}' has none")
        add_tray(spec, "robot/")


def _shorten_camera_names(spec: mujoco.MjSpec) -> None:
    """Remove the prefix of cameras, unless the short name is taken."""
    for camera in spec.cameras:
        name = camera.name.rpartition("/")[2]
        if spec.camera(name) is None:
            camera.name = name


def _add_stairwells(spec: mujoco.MjSpec, plan: FloorPlan, visuals: bool) -> None:
    if plan.mouths and plan.cell_size != DEFAULT_CELL_SIZE:
        raise CaregiverError(f"cells must be of {DEFAULT_CELL_SIZE} m in a house with gates, got {plan.cell_size:g}")
    hazards = plan.hazards.at(Where.OPENING)
    for hazard, cell, step in zip(hazards, plan.stairwells, plan.stair_directions, strict=True):
        kind = hazard.kind
        name = "hatch" if step is None else "stairwell" if kind.fenced else kind.model
        model = fittings.read_model(name, visuals)
        for geom in model.geoms:
            if geom.name != "trigger":  # visible parts fill the cell, whatever its size
                stretch = plan.cell_size / DEFAULT_CELL_SIZE
                geom.pos[:2] *= stretch
                geom.size[:2] *= stretch
        down, right = step or (0, 1)
        yaw = np.arctan2(-down, right)
        fittings.place_model(spec, model, hazard.element, plan.position(cell), yaw)
        if kind.fenced:
            turn = [np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]
            frame = spec.worldbody.add_frame(pos=[*plan.position(cell), 0], quat=turn)
            spec.attach(fittings.read_model(kind.model, visuals), prefix=f"{hazard.element}/", frame=frame)

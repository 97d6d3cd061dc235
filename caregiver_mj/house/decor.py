"""Walls and decor: doorways, rugs, and what stands and hangs at the walls. Only the walls are more than to be seen."""

from __future__ import annotations

import mujoco
import numpy as np

from caregiver_mj.house.parts import add_box, place_model, read_model
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan

_CAP_HEIGHT = 0.03  # metres, of the board on top of a wall
_SKIRTING_HEIGHT, _SKIRTING_DEPTH = 0.07, 0.012  # metres
_JAMB_WIDTH, _JAMB_HEIGHT = 0.035, 0.94  # metres; just above the board on top of the walls
_RUG_LARGEST, _RUG_GAP = 2.6, 0.35  # metres: its longest side, and its distance to the walls' cells
_RUGS = ("rug_blue", "rug_red", "rug_green", "rug_ochre")

# Decorations stand in front of walls, at most 0.2 m deep: in the part of a wall's cell that the thin wall leaves over.
_DECORATIONS = ("bookshelf", "picture", "plant", "sideboard")
_DECORATED_SHARE = 0.25  # of the places where one could be


def add_walls(spec: mujoco.MjSpec, plan: FloorPlan) -> None:
    """Adds the walls, to collide with and to look at."""
    height = layout.WALL_HEIGHT
    for i, wall in enumerate(layout.wall_rectangles(plan)):
        # Collision geoms of the world itself, so that MuJoCo's midphase culls among them.
        spec.worldbody.add_geom(
            spec.find_default("house_collision"),
            name=f"wall_{i}",
            pos=[wall[0], wall[1], height / 2],
            size=[wall[2], wall[3], height / 2],
        )
        add_box(spec, f"paint_{i}", "paint", wall, 0, height)
        add_box(spec, f"cap_{i}", "cap", wall, height, height + _CAP_HEIGHT)
        add_box(spec, f"skirting_{i}", "skirting", wall, 0, _SKIRTING_HEIGHT, margin=_SKIRTING_DEPTH)


def add_doorways(spec: mujoco.MjSpec, plan: FloorPlan) -> None:
    """Adds thresholds and jambs."""
    half_wall = layout.wall_thickness(plan) / 2
    half_width = plan.cell_size - half_wall
    for i, (cell, (down, _)) in enumerate(layout.doorways(plan)):
        # The box's half sides across and along the way through, put into the order of x and y.
        order = [0, 1] if down else [1, 0]
        centre, across = plan.position(cell), np.array([1, 0])[order]
        sill = np.array([half_width, half_wall])[order]
        jamb = np.array([_JAMB_WIDTH / 2, half_wall + _SKIRTING_DEPTH])[order]
        add_box(spec, f"threshold_{i}", "threshold", np.array([*centre, *sill]), 0, 0.004)
        for side, sign in (("a", -1), ("b", 1)):
            middle = centre + sign * (half_width - _JAMB_WIDTH / 2) * across
            add_box(spec, f"jamb_{i}{side}", "jamb", np.array([*middle, *jamb]), 0, _JAMB_HEIGHT)


def add_rugs(spec: mujoco.MjSpec, plan: FloorPlan) -> None:
    """Adds a rug to every room that has the space."""
    landing = np.zeros(plan.shape, bool)
    for cell in plan.stairwells:
        landing[cell] = True
    for i, room in enumerate(layout.rooms(plan)):
        first, last = layout.largest_rectangle(room & ~landing)
        corners = plan.position(first), plan.position(last)
        half = np.abs(corners[1] - corners[0]) / 2 + plan.cell_size / 2 - _RUG_GAP
        half = half.clip(max=[_RUG_LARGEST / 2, _RUG_LARGEST / 2])
        if half.min() < 0.3:
            continue
        rug = np.array([*(corners[0] + corners[1]) / 2, *half])
        for layer, (material, inset) in enumerate((("rug_border", 0.0), (_RUGS[i % len(_RUGS)], 0.06))):
            add_box(spec, f"rug_{i}_{layer}", material, rug, 0, 0.003 + 0.002 * layer, margin=-inset)


def add_decorations(spec: mujoco.MjSpec, plan: FloorPlan) -> None:
    """Puts decorations at walls, the same ones in every scene of a plan."""
    random = np.random.default_rng(0)
    for i, (position, yaw) in enumerate(layout.wall_places(plan)):
        if random.random() < _DECORATED_SHARE:
            place_model(
                spec, read_model(_DECORATIONS[random.integers(len(_DECORATIONS))]), f"decoration_{i}", position, yaw
            )

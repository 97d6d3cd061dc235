"""Parts of a scene: models from files, and boxes that are only to be seen."""

from __future__ import annotations

import importlib.resources

import mujoco
import numpy as np

# What makes a geom collide as it does; its look does not matter, for it is not drawn.
_GEOM_ATTRIBUTES: tuple[str, ...] = ("type", "size", "group", "rgba", "contype", "conaffinity")
_GEOM_ATTRIBUTES += ("condim", "friction", "solref", "solimp", "margin", "gap")

_REACHES_FARTHEST = "/glow"  # of a candle


def read_model(name: str) -> mujoco.MjSpec:
    """Reads a model of the package."""
    file = importlib.resources.files("caregiver_mj.models") / f"{name}.xml"
    return mujoco.MjSpec.from_string(file.read_text(encoding="utf-8"))


def place_model(spec: mujoco.MjSpec, model: mujoco.MjSpec, name: str, position: np.ndarray, yaw: float = 0.0) -> None:
    """Adds a static body that shows a model, at a position (2,) in metres, turned by yaw in radians.

    What there is to collide with goes into the world's own body. MuJoCo looks for pairs of bodies first and finds
    geoms within a body by a tree: one body with all obstacles costs much less at each step than one for each piece.
    """
    quaternion = np.array([np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)])
    body = spec.worldbody.add_body(name=name, pos=[*position, 0], quat=quaternion)
    spec.attach(model, prefix=f"{name}/", frame=body.add_frame())
    for geom in body.geoms:
        if not (geom.contype or geom.conaffinity):
            continue
        place, turn = np.empty(3), np.empty(4)
        mujoco.mju_rotVecQuat(place, geom.pos, quaternion)
        mujoco.mju_mulQuat(turn, quaternion, geom.quat)
        attributes = {key: getattr(geom, key) for key in _GEOM_ATTRIBUTES}
        attributes |= {"name": geom.name, "pos": place + np.array([*position, 0]), "quat": turn}
        spec.delete(geom)
        spec.worldbody.add_geom(**attributes)


def remove_visuals(spec: mujoco.MjSpec) -> None:
    """Takes out of a scene what is only to be seen. What happens in it stays exactly the same, and is computed faster.

    It leaves what weighs something, and of a candle what reaches farthest: that tells MuJoCo how still the candle must
    be to fall asleep.
    """
    for body in spec.worldbody.bodies:
        if not body.find_all("joint"):  # one of `place_model`, which does no more than show the model
            spec.delete(body)
    for geom in spec.geoms:
        weightless = geom.mass == 0 or geom.parent.name == "world"
        if weightless and not (geom.contype or geom.conaffinity or geom.name.endswith(_REACHES_FARTHEST)):
            spec.delete(geom)


def add_box(
    spec: mujoco.MjSpec, name: str, material: str, rectangle: np.ndarray, bottom: float, top: float, margin: float = 0.0
) -> None:
    """Adds a box that is only to be seen, over a rectangle (4,) with a margin and between two heights, in metres."""
    x, y, half_x, half_y = rectangle
    spec.worldbody.add_geom(
        spec.find_default("house_visual"),
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        material=material,
        pos=[x, y, (top + bottom) / 2],
        size=[half_x + margin, half_y + margin, (top - bottom) / 2],
    )

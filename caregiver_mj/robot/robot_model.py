"""Properties of a robot read from its model file."""

from __future__ import annotations

import importlib.resources
import math
from collections.abc import Sequence
from importlib.resources.abc import Traversable
from typing import Any

import mujoco
import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.robot.embodiment import CommandLayout, Embodiment, Names, Tray, Wheels


def own_model(name: str) -> Traversable:
    """Return the model file of one of the package's robots."""
    return importlib.resources.files("caregiver_mj.models") / "robots" / f"{name}.xml"


def read_spec(file: Traversable) -> mujoco.MjSpec:
    """Read a model file, which may include others beside it."""
    with importlib.resources.as_file(file) as path:
        return mujoco.MjSpec.from_file(str(path))


def add_tray(spec: mujoco.MjSpec, prefix: str = "") -> None:
    """Add the tray for small things to a base with a site for it; its names get a prefix."""
    if site := spec.site(f"{prefix}tray"):
        spec.attach(read_spec(own_model("tray")), prefix=f"{prefix}tray/", site=site)


class RobotModel:
    """A robot's model, as the source of numbers that need not be given again."""

    def __init__(self, file: Traversable, names: Names):
        """Read the model, or raise CaregiverError if it lacks a named part."""
        spec = read_spec(file)
        add_tray(spec)
        self._model, self._names, self._file = spec.compile(), names, file
        joints = [self._model.joint(i).name for i in range(self._model.njnt)]
        missing = [name for name in (*names.base, *names.arm, *names.fingers, *names.wheels) if name not in joints]
        if missing:
            raise CaregiverError(f"robot {file.name} must have joint {', '.join(missing)}, got {', '.join(joints)}")

    def robot(self, **own: Any) -> Embodiment:
        """Return the robot, named after its file, from the model and its `own` fields."""
        return Embodiment(
            name=self._file.name.removesuffix(".xml"),
            model=self._file,
            names=self._names,
            layout=self.action(),
            actuators=self.actuators(),
            footprint=self.footprint(),
            wheels=self.wheels(),
            torque=self.torque(),
            sides=self.sides(),
            fingertip=self.fingertip(),
            tray=self.tray(),
            **own,
        )

    def actuators(self) -> CommandLayout:
        """Return the layout of the actuators."""
        names = self._names
        base, arm, fingers = (self._driven(joints) for joints in (names.base, names.arm, names.fingers))
        return CommandLayout(base, arm, fingers, size=self._model.nu)

    def action(self) -> CommandLayout:
        """Return the layout of actions: like the actuators', but the fingers share one number."""
        actuators = self.actuators()
        gripper = slice(actuators.gripper.start, actuators.gripper.start + 1)
        return CommandLayout(actuators.base, actuators.arm, gripper, size=gripper.stop)

    def footprint(self) -> float:
        """Return the radius of the circle about the base's centre that contains its hull, m."""
        hull = self._model.geom("base_hull")
        x, y = np.abs(hull.pos[:2])
        if mujoco.mjtGeom(int(hull.type[0])) in (mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_CAPSULE):
            return float(math.hypot(x, y) + hull.size[0])
        return float(math.hypot(x + hull.size[0], y + hull.size[1]))

    def sides(self) -> tuple[float, float]:
        """Return half of the length and width of a box-shaped base about its centre, m; (0, 0) for a round one."""
        hull = self._model.geom("base_hull")
        if mujoco.mjtGeom(int(hull.type[0])) != mujoco.mjtGeom.mjGEOM_BOX:
            return 0.0, 0.0
        x, y = (np.abs(hull.pos[:2]) + hull.size[:2]).tolist()
        return x, y

    def wheels(self) -> Wheels:
        """Return the wheels."""
        bodies = (self._model.body(int(self._model.joint(name).bodyid[0])) for name in self._names.wheels)
        return Wheels(tuple(tuple(body.pos[:2].tolist()) for body in bodies))

    def fingertip(self) -> float:
        """Return the extent of the fingers' pads beyond the pinch point, m."""
        data = self._at_zero()
        pinch, pad = data.site("pinch"), data.geom("finger_left_pad")
        ahead = pinch.xmat.reshape(3, 3)[:, 2]
        return float(ahead @ (pad.xpos - pinch.xpos) + self._model.geom("finger_left_pad").size[2])

    def tray(self) -> Tray | None:
        """Return the tray on its base; None without a site for it."""
        if mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_SITE, "tray") < 0:
            return None
        inside = self._at_zero().site("tray/inside")
        half = np.abs(inside.xmat.reshape(3, 3)) @ self._model.site("tray/inside").size
        return Tray(tuple(inside.xpos.tolist()), tuple(half.tolist()))

    def _at_zero(self) -> mujoco.MjData:
        data = mujoco.MjData(self._model)
        mujoco.mj_kinematics(self._model, data)
        return data

    def torque(self) -> np.ndarray:
        """Return the greatest torque of each arm joint, (joints,), N m."""
        return self._model.jnt_actfrcrange[[self._model.joint(name).id for name in self._names.arm], 1]

    def lag(self, joint: str, arm: np.ndarray) -> float:
        """Return the lag of a joint's velocity servo, mass or inertia over gain, s, with the arm at joint positions."""
        model = self._model
        data = mujoco.MjData(model)
        data.qpos[[model.joint(name).qposadr[0] for name in self._names.arm]] = arm
        mujoco.mj_forward(model, data)
        mass = np.empty((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        dof = model.joint(joint).dofadr[0]
        return float(mass[dof, dof] / model.actuator_gainprm[self._driven([joint]).start, 0])

    def _driven(self, joints: Sequence[str]) -> slice:
        model = self._model
        driven = [model.joint(int(i)).name for i in model.actuator_trnid[:, 0]]
        first = driven.index(joints[0]) if joints[0] in driven else 0
        if driven[first : first + len(joints)] != list(joints):
            raise CaregiverError(
                f"actuators of robot {self._file.name} must be in the order of {', '.join(joints)}, "
                f"got {', '.join(driven)}"
            )
        return slice(first, first + len(joints))

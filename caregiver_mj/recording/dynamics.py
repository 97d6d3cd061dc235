"""How the robot moved in a physics step, and with which forces: measured, whatever was commanded."""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np

if TYPE_CHECKING:
    from caregiver_mj.robot.embodiment import Names


class Dynamics:
    """Measures the robot in a simulation; call `measure` right after a physics step."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, names: Names):
        self._model, self._data = model, data
        base, arm, fingers = ([model.joint(f"robot/{name}") for name in part]
                              for part in (names.base, names.arm, names.fingers))  # fmt: skip
        self._base = [joint.dofadr[0] for joint in base]
        self._arm, self._arm_positions = ([getattr(joint, adr)[0] for joint in arm] for adr in ("dofadr", "qposadr"))
        self._fingers = [joint.dofadr[0] for joint in fingers]
        self._body = int(base[-1].bodyid[0])
        self._inertial = np.empty(model.nv)

    def measure(self) -> dict[str, np.ndarray]:
        """Columns of an `EpisodeLog`, of the last physics step."""
        data = self._data
        return {
            "base_velocity": data.qvel[self._base],
            "arm_position": data.qpos[self._arm_positions],
            "arm_velocity": data.qvel[self._arm],
            "arm_torque": self._torque(),
            "finger_velocity": data.qvel[self._fingers],
            "pressure_centre": self._pressure_centre(),
        }

    def _torque(self) -> np.ndarray:
        """What the motors did in the step: whatever moved the joints that was not gravity, gears or contacts.

        Compensation of the arm's weight is the motors' work too, however the model has it. What the simulation calls
        the actuators' force is from the step's beginning; they have damping, and over the step it changes.
        """
        data = self._data
        mujoco.mj_mulM(self._model, data, self._inertial, data.qacc)
        others = data.qfrc_constraint + data.qfrc_spring + data.qfrc_damper - data.qfrc_bias
        return (self._inertial - others)[self._arm]

    def _pressure_centre(self) -> np.ndarray:
        """Where the force from the ground would have to act to move all of the robot as it moved.

        The base's three joints take up any force and torque; what they do instead of the wheels, and what contacts do
        to the robot, is in the wrench between base and world.
        """
        data, body = self._data, self._body
        mujoco.mj_rnePostConstraint(self._model, data)
        tx, ty, _, fx, fy, fz = data.cfrc_int[body]  # about the robot's centre of mass
        x, y, height = data.subtree_com[body]
        # About the centre of pressure, on the floor, there is no torque but about the vertical.
        place = np.array([x - (ty + height * fx) / fz, y + (tx - height * fy) / fz])
        turned = data.xmat[body].reshape(3, 3)[:2, :2]
        return (place - data.xpos[body, :2]) @ turned

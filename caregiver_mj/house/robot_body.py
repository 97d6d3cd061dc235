"""The robot in the simulation of the house: its joints and actuators."""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from dm_env import specs

from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.kinematics import arm_of

RampState = tuple[np.ndarray, int, int]


class RobotBody:
    """The robot's joints and actuators, as views of the simulation's state.

    Attributes:
        base: Positions x, y (m) and yaw (rad) of the base, and their rates, (3,) each.
        arm: Positions and velocities of the arm's joints, (joints,) each, rad.
        fingers: Distances of the fingers from the middle, m, and their rates, m/s, (2,) each.
        wheels: Headings of the wheels in the base, and their rates, (4,) each, rad.
        base_drives: Commanded velocities of the base, (3,), m/s and rad/s.
        pinch: Middle between the fingertips, (3,), m.
    """

    def __init__(self, embodiment: Embodiment, model: mujoco.MjModel, data: mujoco.MjData):
        self.embodiment = embodiment
        names = embodiment.names
        self.base, self.arm, self.fingers, self.wheels = (
            joint_views(model, data, [f"robot/{joint}" for joint in joints])
            for joints in (names.base, names.arm, names.fingers, names.wheels)
        )
        self.pinch = data.site_xpos[model.site("robot/pinch").id]
        self._model, self._ctrl = model, data.ctrl
        self.base_drives = data.ctrl[embodiment.actuators.base]
        self.base_body = int(model.joint(f"robot/{names.base[-1]}").bodyid[0])
        self._lowest, self._highest = model.actuator_ctrlrange.T.copy()
        self._targets, self.ramp = np.empty_like(data.ctrl), TargetRamp(data.ctrl)
        self._source = np.empty(embodiment.actuators.size, int)  # index into an action for each actuator
        for part in ("base", "arm", "gripper"):
            self._source[getattr(embodiment.actuators, part)] = np.r_[getattr(embodiment.layout, part)]

    def action_spec(self) -> specs.BoundedArray:
        """Return the specification of base velocities (m/s, rad/s), arm joint (rad) and gripper targets (m)."""
        layout, actuators = self.embodiment.layout, self.embodiment.actuators
        driven = np.empty(layout.size, int)  # actuator of each number of an action; the left finger for the gripper
        driven[layout.base], driven[layout.arm] = np.r_[actuators.base], np.r_[actuators.arm]
        driven[layout.gripper] = actuators.gripper.start
        names = [self._model.actuator(int(i)).name.removeprefix("robot/") for i in driven]
        names[layout.gripper.start] = "gripper"
        low, high = self._model.actuator_ctrlrange[driven].T
        return specs.BoundedArray((layout.size,), float, low, high, name="\t".join(names))

    def set_action(self, action: np.ndarray, steps: int = 1) -> None:
        """Set the actuators' targets, reached in some physics steps (`TargetRamp`); both fingers get the gripper's."""
        action.take(self._source, out=self._targets, mode="clip")  # the default mode would copy
        # The simulation would clamp the controls, but the ramp needs clamped targets.
        np.maximum(self._targets, self._lowest, out=self._targets)
        np.minimum(self._targets, self._highest, out=self._targets)
        self.ramp.lead_to(self._targets, steps)
        # The wheels bear no load; they turn to the direction of motion.
        x, y, turn = self.base[1].tolist()
        yaw = self.base[0].item(2)
        c, s = math.cos(yaw), math.sin(yaw)
        headings, rates = self.wheels
        rates[:] = self.embodiment.wheels.steer(headings.tolist(), c * x + s * y, c * y - s * x, turn)

    def place(self, base: np.ndarray, arm: np.ndarray | None = None) -> None:
        """Place the robot with an open hand: base pose (3,) and arm joints (joints,), tucked by default."""
        self.base[0][:], self.fingers[0][:] = base, self.embodiment.grasp.open
        self.arm[0][:] = arm_of(self.embodiment).tucked if arm is None else arm
        actuators = self.embodiment.actuators
        self._ctrl[actuators.base], self._ctrl[actuators.gripper] = 0.0, self.embodiment.grasp.open
        self._ctrl[actuators.arm] = self.arm[0]
        self.ramp.rest()


def joint_views(model: mujoco.MjModel, data: mujoco.MjData, joints: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and velocities of consecutive scalar joints, as views of the simulation's state."""
    first = model.joint(joints[0])
    q, v = int(first.qposadr[0]), int(first.dofadr[0])
    return data.qpos[q : q + len(joints)], data.qvel[v : v + len(joints)]


class TargetRamp:
    """Interpolates commands at every physics step between rarer targets, like the controllers of real drives.

    Straight lines between targets have corners, at which a servo jolts. The ramp is their moving average over the steps
    between two targets, so that its slope changes linearly. With n steps between targets it lags by (n - 1) / 2 steps,
    and reaches the last target after n more.
    """

    def __init__(self, controls: np.ndarray):
        self._controls = controls  # present commands, (actuators,): the simulation's own array
        self._last, self._next, self._way, self._slope, self._bend = np.zeros((5, len(controls)))
        self.rest()

    def rest(self) -> None:
        """Restart at the present commands."""
        self._last[:] = self._next[:] = self._controls
        self._way[:] = 0.0
        self._steps, self._left = 1, 0

    @property
    def state(self) -> RampState:
        """Its state besides the controls, for a copy."""
        return np.array([self._last, self._next, self._way, self._slope, self._bend]), self._steps, self._left

    @state.setter
    def state(self, state: RampState) -> None:
        rows, self._steps, self._left = state
        self._last[:], self._next[:], self._way[:], self._slope[:], self._bend[:] = rows

    def lead_to(self, targets: np.ndarray, steps: int) -> None:
        """Set the next targets, (actuators,), for a number of steps; for one step they apply at once."""
        if steps == 1:
            self._controls[:] = targets
            self.rest()
            return
        self._last, self._next = self._next, self._last
        self._next[:] = targets
        self._begin(steps)

    def advance(self) -> None:
        """Advance; call before every physics step."""
        if self._left == 0:
            if not self._way.any():
                return
            self._last[:] = self._next  # no new targets: finish
            self._begin(self._steps)
        self._left -= 1
        np.add(self._slope, self._bend, self._slope)
        np.add(self._controls, self._slope, self._controls)

    def _begin(self, steps: int) -> None:
        self._steps = self._left = steps
        count = np.array(float(steps))  # an array: plain numbers take twice the time
        # The mean at the end of the previous line, computed exactly so that rounding does not accumulate.
        np.multiply(self._way, np.array(-(steps - 1) / (2 * steps)), self._controls)
        np.add(self._controls, self._last, self._controls)
        np.divide(self._way, count, self._slope)
        np.subtract(self._next, self._last, self._way)
        np.divide(self._way, count, self._bend)
        np.subtract(self._bend, self._slope, self._bend)
        np.divide(self._bend, count, self._bend)

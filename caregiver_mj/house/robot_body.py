"""The robot in the simulation of the house: where its joints are, and what its actuators are told."""

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
        embodiment: Which robot it is.
        base: Positions x, y (m) and yaw (rad) of the base, and their rates, (3,) each.
        arm: Positions and velocities of the arm's joints, (joints,) each, rad.
        fingers: How far each finger stands off the middle, and how fast that changes, (2,) each, m.
        wheels: Headings of the wheels in the base, and their rates, (4,) each, rad.
        base_body: Number of the base's body.
        base_drives: Velocities that the base's actuators are told, (3,), m/s and rad/s.
        ramp: What its actuators are told from physics step to physics step.
        pinch: Where the middle between the fingertips is, (3,), m.
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
        self._source = np.empty(embodiment.actuators.size, int)  # of each actuator: which number of an action it gets
        for part in ("base", "arm", "gripper"):
            self._source[getattr(embodiment.actuators, part)] = np.r_[getattr(embodiment.layout, part)]

    def action_spec(self) -> specs.BoundedArray:
        """Return the specification of base velocities (m/s, rad/s), arm joint (rad) and gripper targets (m)."""
        layout, actuators = self.embodiment.layout, self.embodiment.actuators
        driven = np.empty(layout.size, int)  # by each number of an action; of the two fingers the left one
        driven[layout.base], driven[layout.arm] = np.r_[actuators.base], np.r_[actuators.arm]
        driven[layout.gripper] = actuators.gripper.start
        names = [self._model.actuator(int(i)).name.removeprefix("robot/") for i in driven]
        names[layout.gripper.start] = "gripper"
        low, high = self._model.actuator_ctrlrange[driven].T
        return specs.BoundedArray((layout.size,), float, low, high, name="\t".join(names))

    def set_action(self, action: np.ndarray, steps: int = 1) -> None:
        """Set the actuators' targets by an action laid out as the robot's; both fingers get the gripper's value.

        They are reached in some physics steps, see `TargetRamp`.
        """
        action.take(self._source, out=self._targets, mode="clip")  # without a mode it would take a copy first
        # The simulation would clamp them as well, but only after the way to them.
        np.maximum(self._targets, self._lowest, out=self._targets)
        np.minimum(self._targets, self._highest, out=self._targets)
        self.ramp.lead_to(self._targets, steps)
        # The wheels turn to where the base moves. They bear no load.
        x, y, turn = self.base[1].tolist()
        yaw = float(self.base[0][2])
        c, s = math.cos(yaw), math.sin(yaw)
        headings = self.wheels[0].tolist()
        self.wheels[1][:] = self.embodiment.wheels.steer(headings, c * x + s * y, c * y - s * x, turn)

    def place(self, base: np.ndarray, arm: np.ndarray | None = None) -> None:
        """Put the robot somewhere, its hand open: base pose (3,) and arm joints (joints,), tucked if not given."""
        self.base[0][:], self.fingers[0][:] = base, self.embodiment.grasp.open
        self.arm[0][:] = arm_of(self.embodiment).tucked if arm is None else arm
        actuators = self.embodiment.actuators
        self._ctrl[actuators.base], self._ctrl[actuators.gripper] = 0.0, self.embodiment.grasp.open
        self._ctrl[actuators.arm] = self.arm[0]
        self.ramp.rest()


def joint_views(model: mujoco.MjModel, data: mujoco.MjData, joints: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and velocities of scalar joints that follow one another, as views of the simulation's state."""
    first = model.joint(joints[0])
    q, v = int(first.qposadr[0]), int(first.dofadr[0])
    return data.qpos[q : q + len(joints)], data.qvel[v : v + len(joints)]


class TargetRamp:
    """What actuators are told at every physics step, from targets that come more seldom.

    As the controllers of real drives do, which interpolate between the positions that they are sent. A straight line
    from one target to the next has corners, and a servo jolts at each; so the line is averaged over as many steps as
    there are between two targets, and its slope changes evenly. That is later than the line by half as many steps but
    one half, and after the last step the targets are reached in as many more.
    """

    def __init__(self, controls: np.ndarray):
        self._controls = controls  # what they are told now, (actuators,): the simulation's own array, which it writes
        self._last, self._next, self._way, self._slope, self._bend = np.zeros((5, len(controls)))
        self.rest()

    def rest(self) -> None:
        """Begin anew, with what the actuators are told now."""
        self._last[:] = self._next[:] = self._controls
        self._way[:] = 0.0
        self._steps, self._left = 1, 0

    @property
    def state(self) -> RampState:
        """All that it goes on from, besides the controls: for a copy of it, which is set to the same."""
        return np.array([self._last, self._next, self._way, self._slope, self._bend]), self._steps, self._left

    @state.setter
    def state(self, state: RampState) -> None:
        rows, self._steps, self._left = state
        self._last[:], self._next[:], self._way[:], self._slope[:], self._bend[:] = rows

    def lead_to(self, targets: np.ndarray, steps: int) -> None:
        """Set the next targets, (actuators,), to be in force for so many steps; at once for one."""
        if steps == 1:
            self._controls[:] = targets
            self.rest()
            return
        self._last, self._next = self._next, self._last
        self._next[:] = targets
        self._begin(steps)

    def advance(self) -> None:
        """Go on by one physics step: call before every one."""
        if self._left == 0:
            if not self._way.any():
                return
            self._last[:] = self._next  # nothing new has come: get there
            self._begin(self._steps)
        self._left -= 1
        self._slope += self._bend
        self._controls += self._slope

    def _begin(self, steps: int) -> None:
        """Begin the line from the last targets to the next ones."""
        self._steps = self._left = steps
        # Where the mean has got to on the line before; not from where it is, so that no rounding adds up.
        np.multiply(self._way, -(steps - 1) / (2 * steps), out=self._controls)
        self._controls += self._last
        np.divide(self._way, steps, out=self._slope)
        np.subtract(self._next, self._last, out=self._way)
        np.divide(self._way, steps, out=self._bend)
        self._bend -= self._slope
        self._bend /= steps

"""Where the robot itself is now, from where it was a moment ago and from what it has been told to do since."""

from __future__ import annotations

import collections
import math

import numpy as np

from caregiver_mj.house.sensing import Blur
from caregiver_mj.robot.motion import RobotMotion

Posture = tuple[np.ndarray, np.ndarray]  # pose of the base (3,), joint positions (joints,)

_JUMP = 0.05  # metres that a reference moves within a control timestep only if it is set anew
_STEADY = 0.002, 0.004  # metres and radians: as far as the base gets off its reference between control timesteps
_SLOWEST = 0.08  # share of a new measurement that counts at least


def gain(noise: float, change: float, least: float = _SLOWEST) -> float:
    """What share of a measurement counts whose white error is so large, of what changes by so much in between."""
    return max(least, change / (change + noise))


def remaining(noise: float, share: float) -> float:
    """What is left of a white error, one sigma, in an estimate in which a measurement counts by a share."""
    return noise * math.sqrt(share / (2.0 - share))


def base_error(blur: Blur) -> float:
    """White error of where the base is taken to be, one sigma, metres."""
    return remaining(blur.noise, gain(blur.noise, _STEADY[0]))


def base_jumps(blur: Blur) -> float:
    """By how much that changes from one control timestep to the next, one sigma, metres."""
    return blur.noise * gain(blur.noise, _STEADY[0])


def turn_error(blur: Blur) -> float:
    """White error of how the base is taken to be turned, one sigma, radians."""
    return remaining(blur.turn_noise, gain(blur.turn_noise, _STEADY[1]))


class SelfEstimate:
    """The robot follows its references closely: what is measured is how far it is off them."""

    def __init__(self, blur: Blur, robot: RobotMotion, delay_steps: int):
        self._robot, self._blur = robot, blur
        place, turn = _STEADY
        self._gains = np.array([gain(blur.noise, place)] * 2 + [gain(blur.turn_noise, turn)])
        self._path = np.zeros(3)  # of the base's reference, without the jumps
        self._before: np.ndarray | None = None
        self._off: np.ndarray | None = None
        self._seen: np.ndarray | None = None
        self._history: collections.deque[Posture] = collections.deque(maxlen=delay_steps + 1)

    def update(self, base: np.ndarray, arm: np.ndarray) -> tuple[Posture, Posture]:
        """Takes in what has been measured.

        Args:
            base: Pose (3,) of the base, as late as observations are.
            arm: Joint positions (joints,), likewise.

        Returns:
            The posture in which the robot was when that was measured, and that in which it is now.
        """
        self._history.append(self._reference())
        (path_then, arm_then), (path_now, arm_now) = self._history[0], self._history[-1]
        if self._off is None:
            self._off = base - path_then
        elif self._seen is None or not (self._blur.dropout and np.array_equal(base, self._seen)):  # or not seen anew
            self._off = self._off + self._gains * (base - path_then - self._off)
        self._seen = base
        return (path_then + self._off, arm), (path_now + self._off, arm + (arm_now - arm_then))

    def _reference(self) -> Posture:
        """What the robot has been told up to now."""
        robot = self._robot
        here = np.array([*robot.base_reference()[0], robot.yaw])
        if self._before is not None and math.dist(here[:2], self._before[:2]) < _JUMP:
            self._path = self._path + (here - self._before)
        self._before = here
        return self._path, robot.reach_path.joints(robot.reached)

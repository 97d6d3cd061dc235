"""What is there now, by what is observed: late, with errors and gaps, as the sensing says.

Where observations are exact they are taken as they are. Else what the robot does itself is known from its references,
a candle that nobody touches is known not to move, one in the hand to move with it, and children to go on as they do.
"""

from __future__ import annotations

import math

import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.house.sensing import Sensing
from caregiver_mj.policy.candle_estimates import CandleEstimates, candle_error
from caregiver_mj.policy.child_estimates import ChildEstimates, child_error
from caregiver_mj.policy.self_estimate import SelfEstimate, base_error, turn_error
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.view import CANDLE_RADIUS

_SIGMAS = 2.0  # of errors that count
_SIGMAS_BESIDE = 2.5  # of errors for which there is room beside a candle in the open hand
_STRAYS = 0.62  # m/s by which a child may be elsewhere than was foretold: it has stopped, or turned

Observation = dict[str, np.ndarray]


def hand_error(sensing: Sensing, robot: Embodiment) -> float:
    """By how much the hand may be off a candle, one sigma along each axis, metres; 0 if observations are exact.

    Raises:
        CaregiverError: It is too much to take a candle in the hand.
    """
    candle, base = sensing.candle, sensing.base
    turn = robot.postures.reach * math.hypot(base.turn_bias, turn_error(base))
    error = math.hypot(candle.bias, candle_error(candle), base.bias, base_error(base), turn)
    most = (robot.grasp.open - CANDLE_RADIUS) / _SIGMAS_BESIDE
    if error > most:
        raise CaregiverError(
            f"sensing must show {robot.name} a candle within {1e3 * most:.1f} mm (one sigma) of where it is "
            f"beside the hand, got {1e3 * error:.1f} mm"
        )
    return error


class Senses:
    """Estimates, from observation to observation, in one episode after the other."""

    def __init__(self, sensing: Sensing, robot: RobotMotion, control_timestep: float):
        """Prepares them.

        Args:
            sensing: How well observations show what there is.
            robot: The robot's references.
            control_timestep: Seconds between observations.
        """
        self._sensing, self._robot, self._timestep = sensing, robot, control_timestep
        self._steps, self._exact = sensing.delay_steps(control_timestep), sensing.is_exact

    @property
    def age(self) -> float:
        """Seconds by which observations are late."""
        return self._steps * self._timestep

    @property
    def unsure(self) -> float:
        """Metres by which a child may be nearer to the robot than it seems; 0 if observations are exact."""
        child, base = self._sensing.child, self._sensing.base
        late = self.age + sum(self._timestep * blur.dropout / (1.0 - blur.dropout) for blur in (child, base))
        lasting = math.hypot(child.bias, base.bias)
        return late * _STRAYS + _SIGMAS * math.hypot(lasting, child_error(child), base_error(base))

    def reset(self) -> None:
        """Begins an episode, when the robot's references have begun it."""
        if self._exact:
            return
        self._self = SelfEstimate(self._sensing.base, self._robot, self._steps)
        self._candles = CandleEstimates(self._sensing.candle, self._robot.robot)
        self._children = ChildEstimates(self._sensing.child, self._timestep, self.age)

    def now(self, observation: Observation) -> Observation:
        """What an observation would be if it were exact and of this moment, as well as that is known."""
        if self._exact:
            return observation
        then, now = self._self.update(observation["base_position"], observation["arm_position"])
        estimate = dict(observation)
        estimate["base_position"], estimate["arm_position"] = now
        position, velocity = self._children.update(observation["toddler_position"], observation["toddler_velocity"])
        estimate["toddler_position"], estimate["toddler_velocity"] = position, velocity
        if "candle_position" in observation:
            fingers = float(observation["finger_position"].sum())
            poses = observation["candle_position"], observation["candle_orientation"]
            estimate["candle_position"], estimate["candle_orientation"] = self._candles.update(
                *poses, fingers, then, now
            )
        return estimate

"""Jerk-limited trajectories of ruckig, within limits."""

from __future__ import annotations

import math
from typing import Any

from ruckig import InputParameter, Result, Ruckig, RuckigError, Trajectory

from caregiver_mj.robot.limits import Limits

NOTHING = 1e-9  # ruckig refuses targets that are closer than rounding; so near, hold
_NEARLY = 1.0 - 1e-6  # of the jerk that was asked for
SAMPLES = 60  # of a trajectory, to see how far and how fast it gets


# What is asked of ruckig here.
_ASKED = (
    *("current_position", "current_velocity", "current_acceleration", "target_position", "target_velocity"),
    *("max_velocity", "max_acceleration", "max_jerk", "control_interface", "synchronization"),
)


class PathError(Exception):
    """A path cannot be entered from the present motion."""


def parameters(
    position: list[float], velocity: list[float], acceleration: list[float], limits: Limits
) -> InputParameter:
    """A state to start from, and limits that hold along every axis."""
    asked = InputParameter(len(position))
    asked.current_position = position
    asked.current_velocity = velocity
    asked.current_acceleration = acceleration
    # A state that overshoots a limit by rounding must not be an error.
    asked.max_velocity = [max(limits.velocity, abs(v)) for v in velocity]
    asked.max_acceleration = [limits.acceleration] * len(position)
    asked.max_jerk = [limits.jerk] * len(position)
    return asked


class Solution(Trajectory):
    """A trajectory that can be pickled, which ruckig's cannot: it is solved again from what was asked."""

    asked: InputParameter

    def __reduce__(self) -> tuple[Any, ...]:
        return _solve_again, (self.degrees_of_freedom, {name: getattr(self.asked, name) for name in _ASKED})


def solve(solver: Ruckig, asked: InputParameter) -> Solution:
    """The quickest trajectory.

    Raises:
        PathError: There is none.
    """
    solution = Solution(solver.degrees_of_freedom)
    try:
        try:
            result = solver.calculate(asked, solution)
        except RuckigError:  # as for 0.06 m with jerk 30, acceleration 3, and for no jerk beside that
            asked.max_jerk = [_NEARLY * jerk for jerk in asked.max_jerk]
            result = solver.calculate(asked, solution)
    except RuckigError as error:
        raise PathError(str(error)) from None
    if result not in (Result.Working, Result.Finished):
        raise PathError(f"ruckig found no trajectory: {result}")
    solution.asked = asked
    return solution


def _solve_again(axes: int, asked: dict[str, Any]) -> Solution:
    again = InputParameter(axes)
    for name, value in asked.items():
        setattr(again, name, value)
    return solve(Ruckig(axes), again)


def extremes(trajectory: Trajectory) -> tuple[float, float]:
    """The highest speed of a trajectory in two dimensions and its farthest first coordinate, from samples."""
    states = [trajectory.at_time(trajectory.duration * i / SAMPLES) for i in range(SAMPLES + 1)]
    return max(math.hypot(*velocity) for _, velocity, _ in states), max(position[0] for position, _, _ in states)

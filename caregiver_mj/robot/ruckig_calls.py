"""Jerk-limited trajectories of ruckig, within limits."""

from __future__ import annotations

import math

from ruckig import InputParameter, Result, Ruckig, RuckigError, Trajectory

from caregiver_mj.robot.limits import Limits

NOTHING = 1e-9  # ruckig refuses targets that are closer than rounding; so near, hold
SAMPLES = 60  # of a trajectory, to see how far and how fast it gets


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


def solve(solver: Ruckig, asked: InputParameter) -> Trajectory:
    """The quickest trajectory.

    Raises:
        PathError: There is none.
    """
    trajectory = Trajectory(solver.degrees_of_freedom)
    try:
        result = solver.calculate(asked, trajectory)
    except RuckigError as error:
        raise PathError(str(error)) from None
    if result not in (Result.Working, Result.Finished):
        raise PathError(f"ruckig found no trajectory: {result}")
    return trajectory


def extremes(trajectory: Trajectory) -> tuple[float, float]:
    """The highest speed of a trajectory in two dimensions and its farthest first coordinate, from samples."""
    states = [trajectory.at_time(trajectory.duration * i / SAMPLES) for i in range(SAMPLES + 1)]
    return max(math.hypot(*velocity) for _, velocity, _ in states), max(position[0] for position, _, _ in states)

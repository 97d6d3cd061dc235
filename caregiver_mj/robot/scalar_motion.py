"""References of single quantities: heading, gripper, the hand's place on its path, the rate of the base.

They are functions of time; a new goal continues the present state.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from ruckig import ControlInterface, InputParameter, Result, Ruckig, RuckigError, Trajectory

from caregiver_mj.robot.limits import Limits

_ROUNDING = 1.01  # multiple of a limit below which an excess is rounding
NOTHING = 1e-9  # distance of a target below which to hold: ruckig refuses targets within rounding
_NEARLY = 1.0 - 1e-6  # share of the jerk for another try
SAMPLES = 60  # steps of a trajectory at which extremes are sought


class ScalarMotion:
    """A quantity that moves to a position, or at a velocity, within limits; it begins at rest.

    With `brakes` it slows down to a lowered limit of velocity; else it keeps its velocity.
    """

    def __init__(self, limits: Limits, position: float, brakes: bool = False):
        self._brakes = brakes
        self.target = position
        self._start = 0.0
        self._rest: float | None = position  # position at rest; None on a trajectory
        self._sampled_at: float
        self._highest: float | None
        self.limits = limits

    def set_limits(self, limits: Limits, now: float = math.inf) -> None:
        """Change the limits; the present motion keeps the old ones until its next goal.

        Given the present time, a motion to a position takes the new ones at once.
        """
        self.limits = limits
        if self._rest is None and self._ends and now < self.arrival:
            self._solve(now, self.at(now), ControlInterface.Position)

    def at(self, now: float) -> tuple[float, float, float]:
        """Return the position, velocity and acceleration at a time, not before the last goal was set."""
        if self._rest is not None:
            return self._rest, 0.0, 0.0
        if now != self._sampled_at:  # many callers use the same time
            self._sampled_at, self._sample = now, self._state_at(now - self._start)
        return self._sample

    def move_to(self, target: float, now: float) -> None:
        """Move to rest at a position."""
        if target == self.target and (self._rest is not None or self._ends):
            return
        state = self.at(now)
        self.target = target
        if abs(target - state[0]) < NOTHING and abs(state[1]) < NOTHING and abs(state[2]) < NOTHING:
            self._rest = target
            return
        self._solve(now, state, ControlInterface.Position)

    def run_at(self, velocity: float, now: float, at_once: bool = False) -> None:
        """Change to a velocity within the limits, or at once, and keep it."""
        position, present, acceleration = self.at(now)
        state = (position, velocity, 0.0) if at_once else (position, present, acceleration)
        self.target = velocity
        self._solve(now, state, ControlInterface.Velocity)

    def begin_anew(self, now: float) -> None:
        """Count the position of a motion at a velocity from zero; the motion goes on."""
        _, velocity, acceleration = self.at(now)
        self._solve(now, (0.0, velocity, acceleration), ControlInterface.Velocity)

    def stop(self, now: float) -> None:
        """Come to rest as soon as possible, and set `target` to the position there."""
        if self._rest is None:
            self.run_at(0.0, now)
            self.target = self._state_at(self._duration)[0]

    def rests_at(self, position: float, now: float) -> bool:
        """Return whether the quantity rests at a position, also after the motion to it."""
        if self._rest is not None:
            return self._rest == position
        return self._ends and self.target == position and now >= self.arrival

    def highest(self) -> float:
        """Return the highest position of the present motion, which may overshoot before it turns back."""
        if self._rest is not None:
            return self._rest
        if self._highest is None:
            times = (self._duration * i / SAMPLES for i in range(SAMPLES + 1))
            self._highest = max(self._trajectory.at_time(time)[0][0] for time in times)
        return self._highest

    @property
    def stops(self) -> bool:
        """Whether the last goal was to stop at no given position."""
        return self._rest is None and not self._ends and self.target == 0.0

    @property
    def arrival(self) -> float:
        """Time at which the present motion ends, s; a past one at rest."""
        return self._start if self._rest is not None else self._start + self._duration

    def _state_at(self, time: float) -> tuple[float, float, float]:
        """Return position, velocity and acceleration at a time since the start of the trajectory, s."""
        if self._ends and time >= self._duration:
            return self.target, 0.0, 0.0
        (position,), (velocity,), (acceleration,) = self._trajectory.at_time(time)
        return position, velocity, acceleration

    def _solve(self, now: float, state: tuple[float, float, float], control: ControlInterface) -> None:
        asked = parameters([state[0]], [state[1]], [state[2]], self.limits)
        asked.control_interface = control
        if self._brakes and abs(state[1]) > _ROUNDING * self.limits.velocity:
            asked.max_velocity = [self.limits.velocity]
        self._ends = control == ControlInterface.Position
        if self._ends:
            asked.target_position = [self.target]
        else:
            asked.target_velocity = [self.target]
        self._trajectory = solve(asked)
        self._duration = self._trajectory.duration
        self._start, self._rest = now, None
        self._sampled_at, self._highest = math.nan, None  # samples of the old trajectory are void


class PathError(Exception):
    """A path cannot be entered from the present motion."""


class Solved(Trajectory):
    """A trajectory that is never changed, so that copies of a robot's motion can share it."""

    def __deepcopy__(self, memo: dict[int, Any]) -> Solved:
        return self


def parameters(
    position: list[float], velocity: list[float], acceleration: list[float], limits: Limits
) -> InputParameter:
    """Return an input of ruckig with a start state, and limits along every axis."""
    asked = InputParameter(len(position))
    asked.current_position = position
    asked.current_velocity = velocity
    asked.current_acceleration = acceleration
    # A state that overshoots a limit by rounding must not be an error.
    asked.max_velocity = [max(limits.velocity, abs(v)) for v in velocity]
    asked.max_acceleration = [limits.acceleration] * len(position)
    asked.max_jerk = [limits.jerk] * len(position)
    return asked


def solve(asked: InputParameter) -> Trajectory:
    """Return the quickest trajectory.

    Raises:
        PathError: There is none.
    """
    solver, trajectory = Ruckig(asked.degrees_of_freedom), Solved(asked.degrees_of_freedom)
    try:
        try:
            result = solver.calculate(asked, trajectory)
        except RuckigError:  # such as for 0.06 m with jerk 30 and acceleration 3, but no other jerk
            asked.max_jerk = [_NEARLY * jerk for jerk in asked.max_jerk]
            result = solver.calculate(asked, trajectory)
    except RuckigError as error:
        raise PathError(str(error)) from None
    if result not in (Result.Working, Result.Finished):
        raise PathError(f"ruckig found no trajectory: {result}")
    return trajectory


def highest(fits: Callable[[float], bool], low: float, high: float, halvings: int = 30) -> float:
    """Return the highest value that fits, by halving between `low`, which fits, and `high`, which does not."""
    for _ in range(halvings):
        middle = (low + high) / 2
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


def extremes(trajectory: Trajectory) -> tuple[float, float]:
    """Return the greatest speed and first coordinate of a trajectory in two dimensions, from samples."""
    states = [trajectory.at_time(trajectory.duration * i / SAMPLES) for i in range(SAMPLES + 1)]
    return max(math.hypot(*velocity) for _, velocity, _ in states), max(position[0] for position, _, _ in states)

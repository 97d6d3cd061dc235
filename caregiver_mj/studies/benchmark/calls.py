"""Inverse kinematics and trajectories on their own."""

from __future__ import annotations

import functools
import statistics

import mink
import numpy as np
from rich.console import Console
from ruckig import ControlInterface, InputParameter, Ruckig, Synchronization, Trajectory

from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.kinematics import Arm
from caregiver_mj.studies.benchmark.clock import Clock, seconds_of
from caregiver_mj.studies.benchmark.effort import Effort
from caregiver_mj.studies.benchmark.prototype import PLAN, SAMPLE, SOLVE, prototype
from caregiver_mj.studies.display import make_table

_AHEAD, _HEIGHT = (0.5, 0.62), (0.7, 0.9)  # metres: where the poses that are solved for lie


def parts(effort: Effort, console: Console) -> dict[str, float]:
    """Medians in microseconds."""
    found = _solving(effort.calls) | _planning(effort.calls)
    medians = {name: 1e6 * statistics.median(seconds) for name, seconds in found.items()}
    table = make_table("Parts", "call", "us", "prototype")
    for name, microseconds in medians.items():
        table.add_row(name, f"{microseconds:.1f}", prototype(name))
    console.print(table)
    return medians


def _solving(calls: int) -> dict[str, list[float]]:
    """Seconds of every call of inverse kinematics."""
    robot, random, iterations = find_embodiment(), np.random.default_rng(0), Clock()
    arm = Arm(robot)
    start = arm.solve(*robot.postures.carry)
    with iterations.of(mink, "solve_ik"):
        nearest, farthest = np.array([_AHEAD, _HEIGHT]).T
        places = random.uniform(nearest, farthest, size=(calls, 2))
        solves = [seconds_of(functools.partial(arm.solve, x, z, guess=start)) for x, z in places]
    return {"mink: inverse kinematics of a pose": solves, SOLVE: iterations.times}


def _planning(calls: int) -> dict[str, list[float]]:
    """Seconds of every call of the trajectories' solver, with the base's limits."""

    def inputs(axes: int) -> InputParameter:
        base, parameters = find_embodiment().limits.base, InputParameter(axes)
        parameters.max_velocity = [base.velocity] * axes
        parameters.max_acceleration, parameters.max_jerk = [base.acceleration] * axes, [base.jerk] * axes
        return parameters

    straight, corner = inputs(1), inputs(2)
    straight.target_position = [3.0]
    corner.control_interface, corner.synchronization = ControlInterface.Velocity, Synchronization.Phase
    corner.current_velocity, corner.target_velocity = [1.0, 0.0], [0.0, 1.0]
    trajectory, solver = Trajectory(1), Ruckig(1)
    functions = {
        PLAN: lambda: Ruckig(1).calculate(straight, trajectory),
        "ruckig: plan again with the same solver": lambda: solver.calculate(straight, trajectory),
        "ruckig: plan, corner of 2 axes": lambda: Ruckig(2).calculate(corner, Trajectory(2)),
        SAMPLE: lambda: trajectory.at_time(1.0),
    }
    return {name: [seconds_of(function) for _ in range(calls)] for name, function in functions.items()}

"""The governor: applies all bounds of the robot's speed near children.

`robot.separation` computes the bounds. At every control step, after the skill has set its goals, `govern` applies
them to the references and returns the action.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from caregiver_mj.robot import separation
from caregiver_mj.robot.clearance import Clearance
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.view import View


def bound_base(view: View, robot: RobotMotion) -> None:
    """Bound the base's rate of turns, and its rate on the path that the skill wants to drive."""
    turning, rate = math.inf, 1.0
    if not separation.is_alone(view, robot.robot):
        turning = separation.allowed_turning(view, robot.robot, robot.base_reference()[1], robot.turning)
        rate = path_rate(view, robot)
    robot.bound_turning(turning)
    robot.set_rate(min(robot.drives, rate))


def path_rate(view: View, robot: RobotMotion) -> float:
    """Return the greatest share of the planned velocity at which the base may follow its path."""
    if not robot.is_driving:
        return 1.0
    return separation.allowed_rate(view, robot.robot, *robot.planned(), robot.base_reference()[1], robot.limits)


def govern(view: View, robot: RobotMotion, clearance: Clearance, control_timestep: float) -> np.ndarray:
    """Return the action for the coming control step, within the bounds for children.

    Args:
        view: The robot's view.
        robot: The robot's references, with the skill's goals.
        clearance: Room in the house.
        control_timestep: Time until the next action, s.
    """
    bound_base(view, robot)
    if separation.is_alone(view, robot.robot, separation.FREE + view.unsure):
        robot.giving_way.yields, robot.catch_up = False, math.inf
        return robot.action(view.base, view.arm)
    _, velocity, acceleration = motion = robot.base_reference()
    if not robot.stops and separation.must_stop(view, robot.robot, velocity, acceleration, robot.limits):
        robot.let_go(*motion)
    at_hand = separation.is_child_at_hand(view, robot.robot, robot.reached)
    robot.giving_way.yields = at_hand
    near = 0.0 if at_hand else separation.gap(view, robot.robot) - view.unsure
    robot.catch_up = separation.catch_up_speed(near)
    if view.unseen:
        unseen = separation.gap(view, robot.robot, view.unseen)
        robot.catch_up = min(robot.catch_up, separation.catch_up_speed(unseen, separation.ADDED))
    restrain = None
    if not separation.is_alone(view, robot.robot, separation.GENTLE_GAP + view.unsure):
        restrain = functools.partial(separation.restrain, view, robot.robot, clearance, control_timestep, robot.closes)
    return robot.action(view.base, view.arm, restrain)

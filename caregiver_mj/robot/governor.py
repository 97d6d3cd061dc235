"""The governor: all that bounds how fast the robot may be beside a child, applied in one place.

How fast that is `robot.separation` works out. When the skill has set its goals, `govern` bounds what comes of them and
makes the action, at every control timestep.
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
    """Bound how fast the base turns, and how fast it drives where its skill wants it to."""
    rate = math.inf
    if not separation.is_alone(view, robot.robot):
        rate = separation.allowed_turning(view, robot.robot, robot.base_reference()[1], robot.turning)
    robot.bound_turning(rate)
    robot.set_rate(min(robot.drives, path_rate(view, robot)))


def path_rate(view: View, robot: RobotMotion) -> float:
    """Return the share of its planned velocity at which the base may drive along its path."""
    if not robot.is_driving or separation.is_alone(view, robot.robot):
        return 1.0
    return separation.allowed_rate(view, robot.robot, *robot.planned(), robot.base_reference()[1], robot.limits)


def govern(view: View, robot: RobotMotion, clearance: Clearance, control_timestep: float) -> np.ndarray:
    """Return the action for the coming control timestep, bounded for the sake of the children.

    Args:
        view: What is seen.
        robot: The robot's references, as the skill has left them.
        clearance: How much room there is.
        control_timestep: Seconds until the next action.
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
        robot.catch_up = min(robot.catch_up, separation.catch_up_speed(unseen, separation.GENTLE_UNSEEN))
    restrain = None
    if not separation.is_alone(view, robot.robot, separation.GENTLE_GAP + view.unsure):
        restrain = functools.partial(separation.restrain, view, robot.robot, clearance, control_timestep, robot.closes)
    return robot.action(view.base, view.arm, restrain)

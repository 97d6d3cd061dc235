"""What a robot sees and does in tests that have no physics."""

import numpy as np

from caregiver_mj.robot import governor
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.view import ChildView, View

ROBOT, TIMESTEP = find_embodiment(), 0.02  # seconds
OPEN_FINGERS = 0.072  # metres, both together


def child(x: float, y: float, vx: float = 0.0, vy: float = 0.0) -> ChildView:
    return ChildView((x, y), (vx, vy))


def view(*children: ChildView, base=(0.0, 0.0, 0.0), now=0.0, fingers=OPEN_FINGERS, candles=()) -> View:
    """A view of children, and of candles by the poses (x, y, z, quaternion) of their feet; the arm is tucked."""
    poses = np.array(candles, float).reshape(-1, 7)
    return View(now, base, fingers, arm_of(ROBOT).tucked, children, poses[:, :3], poses[:, 3:])


def at_rest(base=(0.0, 0.0, 0.0), robot=ROBOT, delay=0.0) -> RobotMotion:
    motion = RobotMotion(robot, TIMESTEP, delay)
    motion.reset(base)
    return motion


def follow(seen: View, robot: RobotMotion) -> None:
    """Let a base do in a control timestep exactly what its skill has just told it, as far as the governor lets it."""
    governor.bound_base(seen, robot)
    robot.action(seen.base)
    robot.now += TIMESTEP

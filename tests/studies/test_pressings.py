"""The study of contacts: which part of the robot presses a child, and who moves when it does, or strikes one."""

import numpy as np

from caregiver_mj.children.walk import ToddlerWalk
from caregiver_mj.house.physics import Physics
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.recording.ledger import Touch
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.view import CHILD_RADIUS
from studies.contacts import Presses, is_pushed

HALL = FloorPlan.parse("############\n#..........#\n#B.........#\n#..........#\n############", "hall")


def pressed(child, seconds, speed=0.0, arm=None, pause=range(0), others=()):
    """Return what is counted of children at rest, (x, y), at a robot that slides ahead, at first."""
    children = [child, *others]
    physics, presses = Physics.from_plan(HALL, children=len(children), visuals=False), Presses(len(children))
    robot = physics.embodiment
    with physics.reset_context():
        physics.set_robot(np.zeros(3), arm)
    action = np.zeros(physics.action_spec().shape)
    action[robot.layout.arm], action[robot.layout.gripper] = physics.arm_position(), robot.grasp.open
    for step in range(round(seconds / 0.02)):
        action[robot.layout.base] = (speed if step < 15 else 0.0), 0.0, 0.0
        for number, place in enumerate(children):
            walk = ToddlerWalk(1.0)
            walk.reset(place if step not in pause else (2.0, 0.8), 0.0)
            physics.set_toddler(walk, number)
        physics.set_action(action)
        physics.step(4)
        presses.look(physics)
    return {what: count for what, count in presses.counts.items() if count}


def beside(by=0.004):
    return 0.0, -(find_embodiment(None).footprint + CHILD_RADIUS - by)


def test_a_child_that_leans_on_a_robot_that_stands_is_counted_once_and_by_the_part():
    assert pressed(beside(), 0.48) == {}
    assert pressed(beside(), 1.5) == {"base": 1}


def test_the_robot_moves_if_its_surface_does():
    assert pressed(beside(), 0.8, speed=0.005) == {"base": 1}
    assert pressed(beside(), 0.8, speed=0.03) == {"base, moving": 1}
    assert pressed(beside(by=0.012), 1.6, speed=0.03, pause=range(30, 40)) == {"base, moving": 1, "base": 1}


def test_each_child_is_counted_and_a_contact_that_ends_is_over():
    far, (x, y) = (2.0, -0.8), beside()
    assert pressed(far, 0.8, others=[(x, y)]) == {"base": 1}
    assert pressed((x, -y), 0.8, others=[(x, y)]) == {"base": 2}
    assert pressed(beside(), 1.4, pause=range(30, 40)) == {"base": 2}
    assert pressed(beside(), 0.8, pause=range(20, 30)) == {}


def test_who_moves_in_a_strike():
    pushed, driven = (Touch(0, "robot", -1, (1.0, 0.0), 0.07, 0.07, speed) for speed in (0.0, 0.06))
    slow, gate = Touch(1, "robot", -1, (1.0, 0.0), 0.01, 0.08, 0.08), Touch(0, "panel", 0, (1.0, 0.0), 0.07)
    assert is_pushed([pushed, slow])
    assert not is_pushed([pushed, driven])
    assert not is_pushed([gate])  # the robot closes it

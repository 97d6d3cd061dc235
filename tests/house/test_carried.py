"""How far the candle in the robot's hand is from a child."""

import numpy as np
import pytest

from caregiver_mj.house.physics import Physics
from caregiver_mj.house.things import FLAME_RADIUS, watch_candle
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import CANDLE, MUG
from caregiver_mj.recording.contacts import FLAME_CLEAR, WAX_CLEAR, Contacts
from caregiver_mj.robot.view import CHILD_RADIUS

HALL = FloorPlan.parse("#########\n#.......#\n#B.....C#\n#T......#\n#########", "hall")
GRIP = 0.08  # metres above the candle's foot
WAX_RADIUS = 0.022  # metres


def held(child, fingers=0.01, off=0.0, grip=GRIP, robot="mobile_fr3", kind=CANDLE):
    """What is counted of a candle held upright in the tucked hand, with a child at an offset (x, y) from it.

    Args:
        child: The offset, metres.
        fingers: How far each stands off the middle, metres.
        off: How far the candle is from between the fingertips, metres.
        grip: How far these are above its foot, metres.
        robot: The robot's name.
        kind: What is held.

    Returns:
        The tally, and how high the candle's foot is.
    """
    hall = FloorPlan.parse(HALL.text.replace("C", kind.symbol))
    physics = Physics.from_plan(hall, robot, visuals=False)
    with physics.reset_context():
        physics.set_robot(np.array([0.0, 0.0, 0.0]))
        physics.data.qpos[[physics.model.joint(f"robot/{j}").qposadr[0] for j in physics.embodiment.names.fingers]] = (
            fingers
        )
    foot = physics.pinch_position() - [0.0, 0.0, grip]
    physics.set_candle(0, np.add(foot, [0.0, off, 0.0]), 0.0)
    for axis, there in zip("xy", foot[:2] + child, strict=True):
        physics.data.qpos[physics.model.joint(f"toddler/{axis}").qposadr] = there
    physics.forward()
    tally = Contacts()
    watch_candle(physics, 0.02, tally)
    return tally, float(foot[2])


@pytest.mark.parametrize("across", [0.0, 0.3, 0.5])
def test_carried_over_the_child_the_lower_ends_are_nearest(across):
    tally, foot = held((0.6 * across, 0.8 * across))
    assert foot > 0.8  # above its head
    over_head = foot - 0.68  # from the upper end of the child's axis to the candle's foot
    wax = np.hypot(across, over_head + WAX_RADIUS) - CHILD_RADIUS - WAX_RADIUS
    flame = np.hypot(across, over_head + 0.170 + FLAME_RADIUS) - CHILD_RADIUS - FLAME_RADIUS
    assert (tally.wax_distance, tally.flame_distance) == pytest.approx((wax, flame), abs=1e-6)
    assert tally.wax_seconds == 0.02 * (wax < 0.1)
    assert tally.flame_seconds == 0.02 * (flame < 0.3)


@pytest.mark.parametrize("robot", ["mobile_fr3", "mobile_ur5e"])
def test_a_child_right_below_the_tucked_hand_is_clear_of_candle_and_flame(robot):
    tally, _ = held((0.0, 0.0), grip=CANDLE.grip, robot=robot)
    assert tally.wax_distance > WAX_CLEAR + 0.03  # a candle may slip in the hand
    assert tally.flame_distance > FLAME_CLEAR


def test_a_mug_is_as_wide_as_it_is_and_has_no_flame():
    tally, foot = held((0.0, 0.0), fingers=0.028, grip=MUG.grip, kind=MUG)
    assert tally.wax_distance == pytest.approx(foot - 0.68 - CHILD_RADIUS, abs=1e-6)
    assert tally.flame_distance == Contacts().flame_distance


def test_an_open_hand_or_a_candle_elsewhere_is_none_in_the_hand():
    assert held((0.2, 0.1), fingers=0.036)[0] == Contacts()
    assert held((0.2, 0.1), off=0.06)[0] == Contacts()
    assert held((2.0, 0.0))[0].flame_distance == 1.0

"""What the robot makes of what it sees, by hand."""

import math

import numpy as np
import pytest
from views import ROBOT, child, view

from caregiver_mj.plans import layout
from caregiver_mj.plans.hazards import CANDLE, MUG
from caregiver_mj.robot.kinematics import hand_is_empty, hand_position, has_in_hand

HALF = math.sqrt(0.5)
UPRIGHT, ON_ITS_HEAD, TOP_TO_THE_EAST = (1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (HALF, 0.0, HALF, 0.0)
TABLE_TOP = 0.60  # metres


def tilted(degrees: float) -> tuple[float, float, float, float]:
    """A turn about the x axis."""
    half = math.radians(degrees) / 2
    return math.cos(half), math.sin(half), 0.0, 0.0


@pytest.mark.parametrize(
    ("orientation", "axis"), [(UPRIGHT, (0, 0, 1)), (ON_ITS_HEAD, (0, 0, -1)), (TOP_TO_THE_EAST, (1, 0, 0))]
)
def test_a_candles_axis_points_from_foot_to_top(orientation, axis):
    seen = view(child(9.0, 9.0), candles=[(1.0, 2.0, 0.6, *orientation)])
    np.testing.assert_allclose(seen.candle_axis(0), axis, atol=1e-12)
    np.testing.assert_array_equal(seen.candle_poses, [[1.0, 2.0, 0.6, *orientation]])


@pytest.mark.parametrize(
    ("height", "orientation", "stands"),
    [
        (TABLE_TOP, UPRIGHT, True),
        (TABLE_TOP + 0.02, UPRIGHT, True),
        (TABLE_TOP + 0.05, UPRIGHT, False),  # in the hand, say
        (0.0, UPRIGHT, False),
        (TABLE_TOP, tilted(15), True),
        (TABLE_TOP, tilted(25), False),
        (TABLE_TOP, TOP_TO_THE_EAST, False),
    ],
)
def test_a_candle_stands_on_a_table_if_it_is_upright_and_as_high(height, orientation, stands):
    assert view(child(9.0, 9.0), candles=[(0.0, 0.0, height, *orientation)]).stands_on_table(0, 0) == stands


AHEAD, HEIGHT = 0.42, 1.04  # metres, of the pinch point when the arm is tucked
CLOSED, ROUND_A_CANDLE, ROUND_A_MUG = 0.024, 0.044, 0.056  # metres, both fingers together


def test_the_hand_is_ahead_of_the_base_wherever_that_looks():
    np.testing.assert_allclose(hand_position(view(child(9, 9)), ROBOT), [AHEAD, 0.0, HEIGHT], atol=1e-4)
    looks_north = view(child(9, 9), base=(1.0, -2.0, math.pi / 2))
    np.testing.assert_allclose(hand_position(looks_north, ROBOT), [1.0, -2.0 + AHEAD, HEIGHT], atol=1e-4)


@pytest.mark.parametrize(
    ("kind", "fingers", "off", "held"),
    [
        (CANDLE, ROUND_A_CANDLE, 0.0, True),
        (CANDLE, CLOSED, 0.0, False),
        (CANDLE, ROUND_A_CANDLE, 0.3, False),
        (MUG, ROUND_A_MUG, 0.0, True),
        (MUG, ROUND_A_CANDLE, 0.0, False),
    ],
    ids=["held", "closed on nothing", "another candle", "mug held", "closed beside a mug"],
)
def test_a_thing_is_in_the_hand_if_the_fingers_have_closed_on_it(kind, fingers, off, held):
    foot = (AHEAD + off, 0.0, HEIGHT - kind.grip, 1.0, 0.0, 0.0, 0.0)
    seen, thing = view(child(9, 9), fingers=fingers, candles=[foot]), layout.thing(kind)
    assert has_in_hand(seen, ROBOT, 0, thing) == held
    assert hand_is_empty(seen, thing) == (not held and off == 0.0)

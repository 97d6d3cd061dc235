"""Where the hand is and what it has got, by the dimensions of the tucked arm."""

import math

import numpy as np
import pytest
from views import child, view

from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.kinematics import hand_is_empty, hand_position, has_in_hand

ROBOT = find_embodiment()
AHEAD, HEIGHT = 0.42, 1.04  # metres, of the pinch point when the arm is tucked
CLOSED, ROUND_A_CANDLE = 0.024, 0.044  # metres, both fingers together


def test_the_hand_is_ahead_of_the_base_wherever_that_looks():
    np.testing.assert_allclose(hand_position(view(child(9, 9)), ROBOT), [AHEAD, 0.0, HEIGHT], atol=1e-4)
    looks_north = view(child(9, 9), base=(1.0, -2.0, math.pi / 2))
    np.testing.assert_allclose(hand_position(looks_north, ROBOT), [1.0, -2.0 + AHEAD, HEIGHT], atol=1e-4)


@pytest.mark.parametrize(
    ("fingers", "off", "held"),
    [(ROUND_A_CANDLE, 0.0, True), (CLOSED, 0.0, False), (ROUND_A_CANDLE, 0.3, False)],
    ids=["held", "closed on nothing", "another candle"],
)
def test_a_candle_is_in_the_hand_if_the_fingers_have_closed_on_it(fingers, off, held):
    foot = (AHEAD + off, 0.0, HEIGHT - 0.10, 1.0, 0.0, 0.0, 0.0)  # gripped 0.1 m above its foot
    seen = view(child(9, 9), fingers=fingers, candles=[foot])
    assert has_in_hand(seen, ROBOT, 0) == held
    assert hand_is_empty(seen) == (fingers == CLOSED)

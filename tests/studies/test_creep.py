"""That a candle in the hand creeps as far as the study's formula says, and no farther than the hand can hold it."""

import pytest

from studies import creep

LOST = 0.030  # metres by which the hand has lost it


@pytest.fixture(scope="module")
def held() -> creep.Held:
    return creep.hold()


@pytest.mark.parametrize(
    ("rate", "timestep", "contact"), [(2.8, 0.005, None), (1.4, 0.005, None), (2.8, 0.00125, None), (2.8, 0.005, 0.002)]
)
def test_a_candle_creeps_as_contacts_and_physics_steps_let_it(held, rate, timestep, contact):
    crept, expected = held.turn(rate, timestep, contact)
    assert 0.85 * expected < crept < expected  # less where the turn speeds up and slows down
    assert crept < 0.6 * LOST


def test_by_hand(held):
    # Half a turn at 2.8 rad/s, 0.433 m out: pi * 2.8 * 0.433 * (0.99 * 4 ms + 5 ms) / 2 = 17.1 mm.
    assert held.turn(2.8, 0.005)[1] == pytest.approx(0.0171, abs=0.0003)

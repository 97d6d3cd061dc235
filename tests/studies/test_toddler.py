"""What is counted of a toddler's walk, on one that was made by hand."""

import numpy as np
import pytest

from caregiver_mj.plans.hazards import NOTHING
from studies import toddler

NORTH, EAST, SOUTH = 0, 1, 2


def test_a_walk_by_hand():
    """It rests, walks east thrice and to a toy, stays for four timesteps, goes north and back, and rests."""
    moves = [NOTHING, EAST, EAST, EAST, *[NOTHING] * 4, NORTH, SOUTH, NOTHING, NOTHING, EAST]
    cells = [0, 1, 2, 3, 3, 3, 3, 3, 4, 3, 3, 3, 2]
    toys = np.zeros((1, len(moves)), bool)
    toys[0, 3] = True
    beside = np.array([False, False, False, True, False])
    walk = toddler.measure(np.array([moves]), np.array([cells]), toys, beside, cell_size=1.6 / 3.6)
    found = toddler.together([walk])
    assert found["dwell at a toy, median, s"] == pytest.approx(4.0)  # of timesteps of a second
    assert found["rest elsewhere, median, s"] == pytest.approx(2.0)
    assert found["bouts that end at a toy"] == 0.5
    assert found["bouts that end beside nothing"] == 0.0
    assert found["bouts of 3 moves or more that are straight"] == 1.0
    assert found["moves that turn back within a bout"] == pytest.approx(1 / 3)
    assert found["metres an hour"] == pytest.approx(6 / 13 * 1600)

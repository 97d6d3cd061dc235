"""How much room there is in houses whose distances are known."""

import numpy as np
import pytest
from robot_plans import CORRIDOR, HOUSE, centre

from caregiver_mj.robot.clearance import Clearance
from caregiver_mj.robot.embodiments import find_embodiment

ROBOT = find_embodiment()


def test_there_is_room_in_the_middle_of_cells_but_not_in_walls_or_furniture():
    clearance = Clearance(HOUSE, ROBOT)
    free = np.array([centre(HOUSE, cell) for cell in HOUSE.free_cells])
    assert clearance.has_room(free)
    assert clearance.has_room(free[:0])
    for cell in ((1, 4), (7, 6), (1, 1)):  # wall, table, bin: a point between two with room
        assert not clearance.has_room(np.array([free[5], centre(HOUSE, cell), free[6]]))


def test_the_hand_meets_walls_but_passes_over_tables():
    clearance = Clearance(HOUSE, ROBOT)
    assert clearance.hand_clear(centre(HOUSE, (7, 5)), centre(HOUSE, (7, 7)))
    assert not clearance.hand_clear(centre(HOUSE, (7, 3)), centre(HOUSE, (7, 5)))


def test_where_the_base_can_stand_and_turn():
    """A corridor of one cell: its walls are 0.25 m thick, so their faces are 0.75 - 0.125 m from its middle."""
    clearance = Clearance(CORRIDOR, ROBOT)
    x, y = CORRIDOR.position((1, 3))
    assert clearance.can_stand((x, y))
    assert clearance.can_turn((x, y))
    # 0.27 m of base and 0.05 m of clearance at least, 0.52 m to turn with a candle; the raster is 0.025 m wide.
    assert clearance.can_stand((x, y + 0.27))
    assert not clearance.can_stand((x, y + 0.36))
    assert clearance.can_turn((x, y + 0.07))
    assert not clearance.can_turn((x, y + 0.14))
    assert clearance.can_turn((x, y), spare=0.05)
    assert not clearance.can_turn((x, y + 0.1), spare=0.05)


@pytest.mark.parametrize("away", [(0.0, 1.2), (0.0, 2.5), (-3.0, 0.0), (9.0, 0.0), (50.0, -50.0)])
def test_the_base_cannot_stand_outside_of_the_house(away):
    x, y = CORRIDOR.position((1, 3))
    assert not Clearance(CORRIDOR, ROBOT).can_stand((x + away[0], y + away[1]))

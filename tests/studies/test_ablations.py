"""The ablations: other destinations of candles, and tables as they are printed."""

import numpy as np

from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.plans.floor_plan import FloorPlan
from studies.ablations import (
    LeastExposedTable,
    NearestTable,
)

# The candle's table, then the others from left to right; a bin beside the last one, so that children go there.
CORRIDOR = FloorPlan.parse("###########\n#.........#\n#.C.T...TB#\n###########", "corridor")


def percept(child):
    one = np.array([[CORRIDOR.cell_index[child]]])
    return Percept(one, one, np.array([[-1]]), one[0], np.array([[0]]), np.array([-1]))


def test_nearest_table_is_the_nearest_on_foot_wherever_the_child_is():
    caregiver = NearestTable(CORRIDOR)
    for child in ((1, 1), (1, 9)):
        assert caregiver.destination(percept(child), np.array([0])).tolist() == [1]


def test_least_exposed_table_is_bumped_into_most_rarely():
    caregiver = LeastExposedTable(CORRIDOR)
    assert caregiver.exposure.shape == (3,)
    assert (caregiver.exposure > 0).all()
    destination = int(caregiver.destination(percept((1, 1)), np.array([0]))[0])
    assert destination == 1 + int(caregiver.exposure[1:].argmin())
    worth = caregiver.worth_protecting(percept((1, 1)))
    assert worth.tolist() == [[bool(caregiver.exposure[0] > caregiver.exposure[1:].min())]]

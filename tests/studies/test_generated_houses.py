"""The study of generated houses."""

import numpy as np

from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from studies.generated_houses import Tour

PLAN = FloorPlan.parse("#######\n#S..C##\n#T...T#\n#..B..#\n#######")  # tables: the candle's is the first


def percept(caregiver_cell=0, candle_table=0, holding=NOTHING, out_of_reach=(False, False)):
    child = np.array([[PLAN.cell_index[2, 4]]])
    return Percept(
        child, child, np.full((1, 1), NOTHING), np.array([caregiver_cell]), np.array([[candle_table]]),
        np.array([holding]), out_of_reach=np.array([out_of_reach]),
    )  # fmt: skip


def test_a_tour_goes_to_every_hazard_once():
    tour = Tour(PLAN)
    tour.reset(1)
    assert tour.choose(percept()).tolist() == [0]
    assert tour.choose(percept(out_of_reach=(True, False))).tolist() == [1]  # and comes back to the first
    landing = len(PLAN.free_cells)
    assert tour.choose(percept(caregiver_cell=landing)).tolist() == [1]
    assert tour.choose(percept(candle_table=NOTHING, holding=0)).tolist() == [1]  # not done while it is in the hand
    assert tour.choose(percept(candle_table=0)).tolist() == [1]  # nor back where it was
    assert tour.choose(percept(candle_table=2)).tolist() == [NOTHING]
    assert tour.left == []

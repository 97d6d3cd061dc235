"""What caregivers with a belief say beside their decisions."""

import dataclasses

import numpy as np
import pytest
from worlds import percept

from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.danger.child_model import EPSILONS
from caregiver_mj.plans.floor_plan import FloorPlan
from studies.ablations import Predictive

CORRIDOR = FloorPlan.parse("#######\n#B...S#\n#######")  # cells 0 to 2, the landing is cell 3
TABLES = FloorPlan.parse("########\n#C....T#\n#......#\n#.B..B.#\n########")
EAST, NOTHING = 1, -1


@pytest.fixture(params=[ForesightCaregiver, Predictive])
def caregiver(request):
    return request.param(CORRIDOR)


def test_the_belief_is_there_to_be_seen(caregiver):
    """Away from its only toy a novice or an explorer goes by chance only: with a fourth of epsilon."""
    moved = percept(CORRIDOR, 1, 3, previous_cell=[[0]], previous_action=[[EAST]])
    caregiver.watch(moved)
    prediction = caregiver.assess(moved).prediction
    to_toy, elsewhere = 0.85 / 5 * np.array(EPSILONS) / 4, np.zeros(5)
    to_toy[[0, 2]] += 0.05 / 2 * np.array([0.05, 0.5]) / 4
    elsewhere[[0, 2]] = 2 * 0.05 / 2 * (1 - 0.75 * np.array([0.05, 0.5]))  # to the stairs, or to the caregiver there
    all_in_all = (to_toy + elsewhere).sum()
    assert prediction.epsilon[0, 0] == pytest.approx((to_toy + elsewhere) / all_in_all, abs=0.01)  # it may have changed
    assert prediction.toy_bin[0, 0] == pytest.approx([to_toy.sum() / all_in_all], abs=0.01)


def test_presence_within_a_timestep(caregiver):
    """Of a child in the middle: to its toy, or one in twenty to the stairs, unless it moves at random."""
    novice, other = np.mean(EPSILONS), np.mean([0.05, 0.5])
    here = caregiver.assess(percept(CORRIDOR, 1)).prediction.presence(1)[0, 0]
    random = 0.85 * novice + 0.15 * other
    to_toy = 0.85 * (1 - novice) + 0.1 * (1 - other)
    assert here == pytest.approx([to_toy + random / 4, random / 2, 0.05 * (1 - other) + random / 4])


def test_safety_is_that_of_the_paper_and_danger_is_equation_2(caregiver):
    rule = PaperCaregiver(CORRIDOR)
    for who in (caregiver, rule):
        who.watch(percept(CORRIDOR, 1, previous_cell=[[0]], previous_action=[[EAST]]))
        who.watch(percept(CORRIDOR, 2, previous_cell=[[1]], previous_action=[[EAST]]))
    found = caregiver.assess(percept(CORRIDOR, 2))
    assert found.safe == pytest.approx(rule.assess(percept(CORRIDOR, 2)).safe)
    assert found.danger == pytest.approx((1 - found.safe[..., None]) * found.reach * CORRIDOR.damage["stairwell"])
    assert found.urgency == pytest.approx(found.reach[:, 0] * CORRIDOR.damage["stairwell"])


def test_a_candle_that_is_carried_or_lies_on_the_floor():
    caregiver = ForesightCaregiver(TABLES)
    assert caregiver.assess(percept(TABLES, 1)).reach > 0
    assert caregiver.assess(percept(TABLES, 1, candle_table=[NOTHING])).reach == 0
    lying = percept(TABLES, 1, candle_table=[NOTHING], candle_cell=[[3]])  # two cells east of the child
    assert caregiver.assess(lying).reach == pytest.approx(1 / 2)


def test_what_lies_on_the_floor_is_reached_by_coming_into_its_cell_until_it_is_gone():
    plan = FloorPlan.parse("#######\n#B.o.S#\n#######")
    caregiver = ForesightCaregiver(plan)
    seen = percept(plan, 0)
    prediction = caregiver.assess(seen).prediction
    random, other = 0.85 * np.mean(EPSILONS) + 0.15 * np.mean([0.05, 0.5]), np.mean([0.05, 0.5])
    assert prediction.reach(plan, seen, 1)[0, 0, 1] == pytest.approx(random / 4 + 0.05 * (1 - other))
    gone = dataclasses.replace(seen, gone=np.array([[True]]))
    assert prediction.reach(plan, gone, 1)[0, 0, 1] == 0.0
    assert caregiver.hazard_distances(gone)[0, 0, 1] == np.inf

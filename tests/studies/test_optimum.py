"""The exact solution of tiny houses, and how far the planner is from it."""

import functools

import pytest

from caregiver_mj.caregivers.foresight.value_table import Objective
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.plans.floor_plan import FloorPlan
from studies import optimum
from studies.optimum import Exact

CORRIDOR = "#######\n#B...S#\n#######"
PRICE = 0.3
EPSILONS = (1.0, 0.5)


@pytest.mark.parametrize("free", [False, True])
def test_by_hand(free):
    plan = FloorPlan.parse(CORRIDOR)
    exact = Exact(plan, [1.0], Objective(discount=0.5, price=PRICE, random_price=PRICE), free)
    landing = len(plan.free_cells)
    assert exact.value[2, landing, 0, 0, 0] == pytest.approx(0.0, abs=1e-5)
    # The caregiver is at the other end, with no way past the child, and best stays there. Before the stairs, b, the
    # child falls with 1/4 and goes to the middle with 1/4; there, a, 1/4 of its moves is into the caregiver, and 1/4
    # leads back: b = 5/4 + (3 b + a) / 8, a = .3 / 4 + (3 a + b) / 8.
    assert exact.value[2, 0, 0, 0, 0] == pytest.approx(2.1083333, rel=1e-5)
    assert exact.value[1, 0, 0, 0, 0] == pytest.approx(0.5416667, rel=1e-5)


@pytest.mark.parametrize("free", [False, True])
def test_by_hand_with_something_on_the_floor(free):
    """The same corridor without stairs: as the child comes towards it the caregiver has it, or has it not yet."""
    plan = FloorPlan.parse("#########\n#B.o....#\n#########")
    exact = Exact(plan, [1.0], Objective(discount=0.5, price=0.0, random_price=0.0), free)
    assert exact.value[0, 3, 0, 0, 0] == pytest.approx(5 / 4, rel=1e-5)  # two moves and an action
    assert exact.value[0, 5, 0, 0, 0] == pytest.approx(5 / 4 + 0.5 * 3 / 4 * 5 / 4, rel=1e-5)
    assert exact.value[0, 5, 1, 0, 0] == pytest.approx(0.0, abs=1e-5)


@functools.cache
def solved(plan, free):
    return Exact(plan, EPSILONS, free=free)


@pytest.mark.parametrize("caregiver", ["knows-goal", "foresight", "paper", "guard", "random"])
def test_no_step_of_any_caregiver_is_better(caregiver, monkeypatch):
    """Nor is the world another one than was solved: steps that are none of the choices would be better now and then."""
    monkeypatch.setattr(optimum, "TIMESTEPS", 60)
    plan = FloorPlan.load(optimum.houses(1)[0])
    for free in (False, True):
        forgone = optimum.forgone(solved(plan, free), make_caregiver(caregiver, plan), 10)
        assert forgone.min() > -1e-4
        assert forgone.max() > 0.1

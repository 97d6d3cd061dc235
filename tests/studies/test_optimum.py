"""The exact solution of tiny houses, and how far the planner is from it."""

import math

import numpy as np
import pytest

from caregiver_mj.caregivers.foresight.value_table import Objective
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.studies import optimum
from caregiver_mj.studies.exact import Exact

CORRIDOR = "#######\n#B...S#\n#######"
TABLES = "#######\n#C...T#\n#.....#\n#B#.#S#\n#######"
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


@pytest.mark.parametrize("name", optimum.houses(3))
def test_who_may_stand_anywhere_leaves_no_more(name):
    plan = FloorPlan.load(name)
    on_tables = math.comb(len(plan.tables), len(plan.candle_tables))
    ours, free = (Exact(plan, EPSILONS, free=one).value[:, :, :on_tables] for one in (False, True))
    assert (free <= ours + 1e-3).all()
    assert free.mean() < 0.99 * ours.mean()


@pytest.mark.parametrize("caregiver", ["knows-goal", "foresight", "paper", "guard", "random"])
def test_no_step_of_any_caregiver_is_better(caregiver, monkeypatch):
    """Nor is the world another one than was solved: steps that are none of the choices would be better now and then."""
    monkeypatch.setattr(optimum, "TIMESTEPS", 60)
    plan = FloorPlan.load(optimum.houses(1)[0])
    for free in (False, True):
        forgone = optimum.forgone(Exact(plan, EPSILONS, free=free), make_caregiver(caregiver, plan), 10)
        assert forgone.min() > -1e-4
        assert forgone.max() > 0.1


@pytest.mark.parametrize("text", [CORRIDOR, TABLES])
def test_the_cost_is_what_is_realised(text):
    """The optimum at first and what is forgone are the discounted damage and price, but for chance."""
    plan, episodes = FloorPlan.parse(text), 300
    exact = Exact(plan, EPSILONS, Objective(price=PRICE, random_price=PRICE))
    forgone = optimum.forgone(exact, make_caregiver("paper", plan), episodes).sum(axis=0)
    cost = optimum.at_first(exact, episodes) + forgone
    world = optimum.begin(plan, EPSILONS, make_caregiver("paper", plan), episodes)
    total, before = np.zeros(len(cost)), np.zeros(len(cost))
    for timestep in range(optimum.TIMESTEPS):
        world.step()
        now = world.ledger.damage + PRICE * world.ledger.totals()["moves_blocked_free"]
        total, before = total + exact.objective.discount**timestep * (now - before), now.copy()
    for both in np.split(total - cost, len(EPSILONS)):
        assert both.std() > 0
        assert abs(both.mean()) < 4 * both.std() / episodes**0.5


def test_the_planner_is_not_far_from_the_best():
    rows = [optimum.run(optimum.Job(house, 10)) for house in optimum.houses(3)]
    for epsilon in EPSILONS:
        told, own = (sum(one[one.epsilon == epsilon][name].mean() for one in rows) for name in ("knows-goal", "own"))
        assert own < told < 1.2 * own


def test_the_command(capsys):
    optimum.main(["--houses", "2", "--episodes", "4", "--jobs", "1"])
    assert "optimum of our interventions" in capsys.readouterr().out

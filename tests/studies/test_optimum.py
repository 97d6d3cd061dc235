"""The exact solution of tiny houses, and how far the planner is from it."""

import math

import numpy as np
import pytest

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.value_table import Objective
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.caregivers.told import ToldCaregiver
from caregiver_mj.interventions.verb import BLOCK, DO_NOTHING, RELOCATE, STAND_ASIDE, Intervention, Interventions
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.plans.routes import ASIDE, STAY, Routes
from studies import optimum
from studies.optimum import Exact
from study import main

CORRIDOR = "#######\n#B...S#\n#######"
TABLES = "#######\n#C...T#\n#.....#\n#B#.#S#\n#######"
THINGS = "########\n#S..o.B#\n#.##...#\n#o...oS#\n########"
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


@pytest.mark.parametrize("free", [False, True])
def test_by_hand_with_something_on_the_floor(free):
    """The same corridor without stairs: as the child comes towards it the caregiver has it, or has it not yet."""
    plan = FloorPlan.parse("#########\n#B.o....#\n#########")
    exact = Exact(plan, [1.0], Objective(discount=0.5, price=0.0, random_price=0.0), free)
    assert exact.value[0, 3, 0, 0, 0] == pytest.approx(5 / 4, rel=1e-5)  # two moves and an action
    assert exact.value[0, 5, 0, 0, 0] == pytest.approx(5 / 4 + 0.5 * 3 / 4 * 5 / 4, rel=1e-5)
    assert exact.value[0, 5, 1, 0, 0] == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("caregiver", ["foresight", "paper", "childproof"])
def test_with_things_on_the_floor_no_step_is_better_and_the_planner_is_nearest_to_the_best(caregiver, monkeypatch):
    monkeypatch.setattr(optimum, "TIMESTEPS", 60)
    exact = Exact(FloorPlan.parse(THINGS), EPSILONS)
    forgone = optimum.forgone(exact, make_caregiver(caregiver, exact.plan), 40)
    assert forgone.min() > -1e-4
    least = optimum.at_first(exact, 40).mean()
    assert (forgone.sum(axis=0).mean() < 0.35 * least) == (caregiver == "foresight")


@pytest.mark.parametrize("caregiver", ["knows-goal", "foresight", "paper", "guard", "random"])
def test_no_step_of_any_caregiver_is_better(caregiver, monkeypatch):
    """Nor is the world another one than was solved: steps that are none of the choices would be better now and then."""
    monkeypatch.setattr(optimum, "TIMESTEPS", 60)
    plan = FloorPlan.load(optimum.houses(1)[0])
    for free in (False, True):
        forgone = optimum.forgone(Exact(plan, EPSILONS, free=free), make_caregiver(caregiver, plan), 10)
        assert forgone.min() > -1e-4
        assert forgone.max() > 0.1


class Best(Caregiver, ToldCaregiver):
    """Does what is best by the exact solution, in the world of everybody else."""

    def __init__(self, exact):
        super().__init__(exact.plan)
        self.exact, self.left = exact, [exact.value]
        self.posts = [[len(self.plan.free_cells) + i] for i in range(len(self.plan.stairwells))]
        self.routes = Routes(self.plan, [*self.posts, *self.plan.graph.beside(self.plan.tables)])
        for _ in range(2):  # what is to come with so many actions left
            self.left.append(exact._act(self.left[-1])[0].reshape(exact.value.shape))

    def hear(self, truth):
        self.goal = truth.goal[:, 0]
        self.epsilon = np.searchsorted(-self.exact.epsilons, -truth.epsilon[:, 0])

    def choose(self, percept):
        raise AssertionError("it decides otherwise")

    def decide(self, percept):
        after, plan = self.left[round(3 * percept.time_left[0]) - 1], self.plan
        child, cell = percept.child_cell[:, 0], percept.caregiver_cell
        found = []
        for world in range(len(cell)):
            if percept.holding[world] != NOTHING:  # it is put down, whatever is said
                found.append(Intervention())
                continue
            answers = [(STAY, Intervention(DO_NOTHING)), (ASIDE, Intervention(STAND_ASIDE))]
            answers += [(i, Intervention(BLOCK, i)) for i in range(len(self.posts))]
            tables = percept.candle_table[world].tolist()
            answers += [
                (len(self.posts) + table, Intervention(RELOCATE, len(self.posts) + candle, to))
                for candle, table in enumerate(tables)
                for to in set(range(len(plan.tables))) - set(tables)
            ]
            place = np.array([one for one, _ in answers])
            each = np.ones(len(answers), int)
            far, there = self.routes.towards(place, child[world] * each[:, None], cell[world] * each)
            takes = [verb.verb == RELOCATE and not left for left, (_, verb) in zip(far, answers, strict=True)]
            candle = [
                verb.hazard - len(self.posts) if take else NOTHING
                for take, (_, verb) in zip(takes, answers, strict=True)
            ]
            on = [[NOTHING if i == taken else table for i, table in enumerate(tables)] for taken in candle]
            to = np.array([verb.destination for _, verb in answers])
            layout = self.exact.layout(np.array(on), np.array(candle), to, np.zeros((len(to), 0), bool))
            cost = after[child[world], there, layout, self.goal[world], self.epsilon[world]]
            found.append(answers[int(cost.argmin())][1])
        return Interventions.of(found)


@pytest.mark.parametrize("name", optimum.houses(2))
def test_whoever_does_what_is_best_forgoes_nothing(name, monkeypatch):
    """So the solution takes nothing for possible that is not, such as to wait with a candle in the hand."""
    monkeypatch.setattr(optimum, "TIMESTEPS", 60)
    exact = Exact(FloorPlan.load(name), EPSILONS)
    assert optimum.forgone(exact, Best(exact), 3).max() < 1e-4


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


def test_the_planner_is_not_far_from_the_best(monkeypatch):
    monkeypatch.setattr(optimum, "TIMESTEPS", 150)
    rows = [optimum.costs(optimum.Job(house, 10)) for house in optimum.houses(3)]
    for epsilon in EPSILONS:
        told, own = (sum(one[one.epsilon == epsilon][name].mean() for one in rows) for name in ("knows-goal", "own"))
        assert own < told < 1.2 * own


def test_the_command(capsys, monkeypatch):
    monkeypatch.setattr(optimum, "TIMESTEPS", 60)
    main(["optimum", "--houses", "2", "--episodes", "4", "--jobs", "1"])
    assert "optimum of our interventions" in capsys.readouterr().out

"""How far the planner is from the best that anybody could do, in houses small enough to know that."""

import numpy as np
import pytest
from exact import Exact

from caregiver_mj.caregivers.foresight.knows_goal import KnowsGoalCaregiver
from caregiver_mj.caregivers.foresight.value_table import Objective
from caregiver_mj.children.tape import EPISODE_TIMESTEPS, Tape
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan

CORRIDOR = "#######\n#B...S#\n#######"
TABLES = "#######\n#C...T#\n#.....#\n#B#.#S#\n#######"
PRICE = 0.3


def costs(plan, epsilon, episodes):
    """Discounted damage and price of the planner that is told bin and epsilon, and the least that is to be expected."""
    objective = Objective(price=PRICE, random_price=PRICE)
    world = GridWorld(plan, epsilon, KnowsGoalCaregiver(plan, objective=objective, hysteresis=0.0))
    world.reset([Tape.draw_family(np.random.RandomState(seed), 1) for seed in range(episodes)])
    exact = Exact(plan, epsilon, EPISODE_TIMESTEPS, objective.discount, PRICE, PRICE)
    least = exact.at(world.child_cell[:, 0], world.goal[:, 0], world.caregiver_cell, world.candle_table)
    total, before = np.zeros(episodes), np.zeros(episodes)
    for timestep in range(EPISODE_TIMESTEPS):
        world.step()
        now = world.ledger.damage + PRICE * world.ledger.totals()["moves_blocked_free"]
        total, before = total + objective.discount**timestep * (now - before), now.copy()
    return total, least


def test_by_hand():
    plan = FloorPlan.parse(CORRIDOR)
    exact = Exact(plan, 1.0, 2, 0.5, PRICE, PRICE)
    landing, nothing = len(plan.free_cells), np.zeros((1, 0), int)
    assert exact.at([2], [0], [landing], nothing) == pytest.approx(0.0)
    # Before the stairs, the caregiver at the other end, with no way past the child: 1/4 of a fall now, and again in the
    # next move unless the child has gone back to the middle, with 1/4; then 1/4 of its moves is into the caregiver.
    assert exact.at([2], [0], [0], nothing) == pytest.approx(5 / 4 + 0.5 * (3 / 4 * 5 / 4 + 1 / 4 * PRICE / 4))


@pytest.mark.parametrize("epsilon", [1.0, 0.5])
@pytest.mark.parametrize("text", [CORRIDOR, TABLES])
def test_nobody_is_better_and_the_planner_not_much_worse(text, epsilon):
    """It goes only to landings, tables and out of the way; whoever may stand anywhere can shield a child better."""
    total, least = costs(FloorPlan.parse(text), epsilon, 400)
    error = 3 * (total - least).std() / len(total) ** 0.5
    assert least.mean() - error < total.mean() < 1.5 * least.mean() + error

"""Bare tables only, a child that stays, and a caregiver that makes no room, in the grid."""

import numpy as np
import pytest
from worlds import streams

from caregiver_mj.caregivers import make_caregiver
from caregiver_mj.children.behaviour import Behaviour
from caregiver_mj.children.child_group import CHILDREN
from caregiver_mj.grid.world import BareTablesWorld, GridWorld, run_episodes
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

PAPER = FloorPlan.load("paper")


@pytest.mark.parametrize(("epsilon", "left"), [(1.0, 0.25), (0.05, 0.15)])
def test_bare_tables_only_in_the_paper_house(epsilon, left):
    """The figures are an independent simulation's, with two decimals."""
    alone, bare = run_episodes(PAPER, epsilon, None, range(500)), BareTablesWorld(PAPER, epsilon).run(streams(500))
    assert bare.damage.mean() / alone.damage.mean() == pytest.approx(left, abs=0.015)


@pytest.mark.parametrize("child", CHILDREN)
def test_with_bare_tables_only_there_are_bumps_into_these_and_nothing_else(child):
    totals = BareTablesWorld(PAPER, f"{child}:0.75").run(streams(20)).totals()
    assert (totals["damage"] == totals["damage_table"]).all()
    if child == "novice":  # no bump takes it anywhere else, so it goes the same ways
        alone = run_episodes(PAPER, 0.75, None, range(20)).totals()
        assert (totals["damage"] == alone["damage_table"] + alone["damage_candle"] / 4).all()
        assert (totals["moves_blocked"] == alone["damage_stairwell"] / 5).all()
        assert (totals["toys_reached"] == alone["toys_reached"]).all()


class Statue(Behaviour):
    """Stays where it is."""

    def act(self, sight, draws):
        return np.full(len(sight.cell), NOTHING)


# Something else to the west of every cell, which is what an index of -1 would mean.
@pytest.mark.parametrize("west", "S.CTB#")
def test_a_child_that_stays_comes_to_no_harm_and_to_no_toy(west):
    plan = FloorPlan.parse(f"#######\n##{west}..##\n##B..T#\n#C....#\n#######")
    world = GridWorld(plan, 1.0, make_caregiver("paper", plan))
    world.behaviours = [Statue(plan, 1.0)]
    world.reset(streams(1, 30))
    world.child_cell[:] = plan.cell_index[(1, 3)]
    world.caregiver_cell[:] = plan.cell_index[(3, 4)]
    world.goal[:] = 0
    for _ in range(30):
        world.step()
        assert world.child_cell.tolist() == [[plan.cell_index[(1, 3)]]]
        assert world.previous_action.tolist() == [[NOTHING]]
        assert world.bumped.tolist() == [[False]]
    totals = world.ledger.totals()
    assert [totals[name].tolist() for name in ("damage", "toys_reached", "moves_blocked")] == [[0], [0], [0]]


# Every caregiver with the novice, and every child with the rule.
@pytest.mark.parametrize(
    ("child", "name"),
    [("novice", name) for name in ("none", "random", "paper", "childproof", "learned", "attentive:.4")]
    + [(child, "paper") for child in CHILDREN if child != "novice"],
)
def test_an_episode_with_any_child_is_the_same_alone_and_among_others(child, name):
    """With a novice beside it, for what a child remembers must be its own."""
    plan = FloorPlan.load("paper")
    caregiver = make_caregiver(name, plan)
    world = GridWorld(plan, f"{child}:0.6,0.3", caregiver)
    families = streams((7, 3, 11), timesteps=50, children=2)
    together = world.run(families)
    alone = world.run(families[:1])
    others = world.run(families[1:])
    assert alone.outcomes() + others.outcomes() == together.outcomes()

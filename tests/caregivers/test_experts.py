"""Whose routes a caregiver has seen: experts in place, in other houses, or none."""

import numpy as np
import pytest

from caregiver_mj.caregivers.experts import Elsewhere, InPlace, routes, surroundings
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.children.novice import expert_trajectories
from caregiver_mj.danger import safety
from caregiver_mj.danger.safety import CONTEXTS
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import house_set
from studies.ablations import Nobody

PAPER = FloorPlan.load("paper")
CORRIDOR = FloorPlan.parse("######\n#S..B#\n######")
UPRIGHT = FloorPlan.parse("###\n#S#\n#.#\n#.#\n#B#\n###")  # the same, turned


def prior(experts, plan, draws=False, seed=0):
    return experts.action_prior(plan, np.random.default_rng(seed), draws)


def test_by_default_they_are_in_place():
    experts = expert_trajectories(PAPER, random := np.random.default_rng(3), 500)
    alpha = safety.action_counts(experts, len(PAPER.free_cells), 2.0)
    expected = safety.action_prior_draw(alpha, random)
    assert (PaperCaregiver(PAPER, 3, experts=InPlace(500, 2.0)).action_prior == expected).all()
    default = PaperCaregiver(PAPER, 3, experts=InPlace()).action_prior
    assert (PaperCaregiver(PAPER, 3).action_prior == default).all()


def test_without_any_the_mean_tells_nothing_and_a_draw_is_noise():
    assert (prior(Nobody(), PAPER) == 0.25).all()
    drawn = prior(Nobody(), PAPER, draws=True)
    assert drawn.sum(axis=1) == pytest.approx(1.0)
    assert drawn.std() > 0.1


def test_what_is_learnt_in_a_house_holds_in_one_that_is_turned():
    experts = Elsewhere.in_houses([CORRIDOR])
    # From the cell beside the stairs all go east, away from them; on to the bin from the other one.
    assert (prior(experts, CORRIDOR).argmax(axis=1) == 1).all()
    assert (prior(experts, UPRIGHT).argmax(axis=1) == 2).all()
    assert prior(experts, UPRIGHT).max() > 0.95


def test_surroundings_by_hand():
    around, sectors = surroundings(CORRIDOR)
    assert around.tolist() == [[1, 0, 1, 2], [1, 4, 1, 0]]  # walls, a free cell, the stairwell; and the bin
    assert sectors.tolist() == [[2], [2]]


def test_routes_end_in_their_bins():
    next_cell, _, index = PAPER.graph.moves
    found = routes(PAPER, np.random.default_rng(0), 300)
    assert {goal for _, _, goal in found} == set(range(len(PAPER.bins)))
    for cells, actions, goal in found:
        assert (next_cell[cells[:-1], actions[:-1]] == cells[1:]).all()
        assert index[cells[-1], actions[-1]] == goal


def test_experts_of_other_houses_are_better_than_none_and_worse_than_those_in_place():
    elsewhere = Elsewhere.in_houses(house_set("train-5"))
    assert elsewhere.alpha.shape == (CONTEXTS, 4)
    route = routes(PAPER, np.random.default_rng(9))
    cells, actions = (np.concatenate([one[part] for one in route]) for part in (0, 1))
    told = [np.log(prior(who, PAPER)[cells, actions]).mean() for who in (Nobody(), elsewhere, InPlace())]
    assert told == sorted(told)
    assert told[1] > told[0] + 0.1


def test_a_caregiver_may_have_seen_experts_elsewhere():
    elsewhere = Elsewhere.in_houses([CORRIDOR])
    for how in ("draw", "mean"):
        caregiver = PaperCaregiver(PAPER, 5, prior=how, experts=elsewhere)
        assert (caregiver.action_prior == prior(elsewhere, PAPER, how == "draw", 5)).all()

"""The paper's rule: what its action prior is learned from, and what it does about children that come after it."""

import numpy as np
import pytest
from worlds import begun

from caregiver_mj import FloorPlan
from caregiver_mj.caregivers.baselines import NearestCaregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.children.novice import expert_trajectories
from caregiver_mj.danger import safety
from caregiver_mj.grid.world import GridWorld, run_episodes
from caregiver_mj.interventions.verb import BLOCK, RELOCATE, STAND_ASIDE

PAPER = FloorPlan.load("paper")


def test_it_is_learned_from_experts_in_the_house_and_by_default_from_1000_timesteps_of_them():
    experts = expert_trajectories(PAPER, random := np.random.default_rng(3), 500)
    alpha = safety.action_counts(experts, len(PAPER.free_cells), 2.0)
    expected = safety.action_prior_draw(alpha, random)
    assert (PaperCaregiver(PAPER, 3, expert_timesteps=500, hyperprior=2.0).action_prior == expected).all()
    default = PaperCaregiver(PAPER, 3, expert_timesteps=1000, hyperprior=1.0).action_prior
    assert (PaperCaregiver(PAPER, 3).action_prior == default).all()


def test_without_any_the_mean_tells_nothing_and_a_draw_is_noise():
    assert (PaperCaregiver(PAPER, prior="mean", expert_timesteps=0).action_prior == 0.25).all()
    drawn = PaperCaregiver(PAPER, expert_timesteps=0).action_prior
    assert drawn.sum(axis=1) == pytest.approx(1.0)
    assert drawn.std() > 0.1


ROOM = FloorPlan.parse("##########\n#B......T#\n#........#\n#........#\n#.C.....S#\n##########", "room")


@pytest.mark.parametrize("maker", [PaperCaregiver, NearestCaregiver])
@pytest.mark.parametrize("child", ["seeker:0", "0", "1"])
def test_who_follows_is_found_out_and_led_away(maker, child):
    caregiver = maker(ROOM)
    world = begun(GridWorld(ROOM, child, caregiver), 10)
    for _ in range(60):
        world.step()
    follows = child == "seeker:0"
    assert (caregiver.followers.there == follows).all()
    verbs = set(caregiver.decide(world.percept()).verb)
    assert verbs == {STAND_ASIDE} if follows else verbs <= {BLOCK, RELOCATE}


def test_who_follows_is_not_drawn_to_where_it_is_hurt():
    """In this house a child that follows was hurt ten times as much beside the stairs that the caregiver stood in."""
    plan, child, seeds = FloorPlan.load("far-bins-300009"), "seeker:0.05", range(40)
    alone, rule = (run_episodes(plan, child, c, seeds).totals()["damage"] for c in (None, PaperCaregiver(plan)))
    assert rule.mean() < 3 * alone.mean()

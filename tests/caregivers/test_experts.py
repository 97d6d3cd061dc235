"""What the rule's action prior is learned from: experts in the house, for more or fewer timesteps, or none."""

import numpy as np
import pytest

from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.children.novice import expert_trajectories
from caregiver_mj.danger import safety
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan

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


def test_they_do_not_walk_for_less_than_no_time():
    with pytest.raises(CaregiverError, match="timesteps of experts must be at least 0, got -1"):
        PaperCaregiver(PAPER, expert_timesteps=-1)

"""Attentive caregivers: how long and how often they look, and that they act only then."""

import functools

import numpy as np
import pytest

from caregiver_mj import CaregiverPolicy, FloorPlan, load
from caregiver_mj.caregivers.baselines import looks
from caregiver_mj.caregivers.registry import find_caregiver, make_caregiver
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.interventions.verb import STAND_ASIDE
from study import run_in_grid

SMALL = FloorPlan.parse("########\n#S.C..B#\n#......#\n#.T..BS#\n########", "small")


@pytest.mark.parametrize("share", [0.1, 0.4, 0.8, 0.95])
def test_share_and_bouts_are_as_asked_for(share):
    """A share that leaves less than a timestep between bouts is met by longer ones."""
    looking = looks(np.random.default_rng(0).random((400, 1000)), share, 6.0)
    ends = np.count_nonzero(looking[:, :-1] & ~looking[:, 1:])
    assert looking.mean() == pytest.approx(share, abs=0.005 if share == 0.95 else 0.01)
    assert share == 0.95 or np.count_nonzero(looking[:, :-1]) / ends == pytest.approx(6.0, abs=0.2)


def rows(name):
    world = functools.partial(GridWorld, caregiver=make_caregiver(name, SMALL))
    totals = run_in_grid(world, SMALL, ["0.5"], 5).ledger.totals()
    return np.array([totals["damage"], totals["interventions"]]).tolist()


@pytest.mark.parametrize("other", ["expected-danger", "random"])
def test_one_that_always_looks_is_the_caregiver_itself_and_one_that_never_does_does_nothing(other):
    assert rows(f"attentive:1:{other}") == rows(other)
    assert sum(rows(f"attentive:0:{other}")[1]) == 0 < sum(rows(f"attentive:.5:{other}")[1])


def test_without_a_name_it_acts_by_the_rule():
    assert find_caregiver("attentive:.4") is find_caregiver("attentive:0.4:paper")


def test_in_the_house_it_ends_what_it_is_about_when_it_does_not_look():
    env = load("supervise", house=SMALL, epsilon=1.0, random=0, visuals=False)
    policy, step = CaregiverPolicy(env, make_caregiver("attentive:1:stairs", SMALL)), env.reset()
    step = env.step(policy(step))
    while not policy.robot.moving:
        step = env.step(policy(step))
    policy.caregiver._looks[:] = False
    for _ in range(150):  # more than a move of the child, and a stop
        step = env.step(policy(step))
    assert policy.intervention.verb == STAND_ASIDE

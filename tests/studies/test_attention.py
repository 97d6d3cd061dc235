"""The study of attention: how long and how often a caregiver looks, and that it acts only then."""

import functools

import numpy as np
import pytest

from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from studies.attention import AttentiveRule, looks
from study import run_in_grid

SMALL = FloorPlan.parse("########\n#S.C..B#\n#......#\n#.T..BS#\n########", "small")


@pytest.mark.parametrize("share", [0.1, 0.4, 0.8])
def test_share_and_bouts_are_as_asked_for(share):
    looking = looks(np.random.default_rng(0).random((400, 1000)), share, 6.0)
    ends = np.count_nonzero(looking[:, :-1] & ~looking[:, 1:])
    assert looking.mean() == pytest.approx(share, abs=0.01)
    assert np.count_nonzero(looking[:, :-1]) / ends == pytest.approx(6.0, abs=0.2)


def rows(kind, share):
    caregiver = kind(SMALL)
    caregiver.share = share
    totals = run_in_grid(functools.partial(GridWorld, caregiver=caregiver), SMALL, ["1", "0.5"], 5).ledger.totals()
    return totals["damage"].tolist(), int(totals["interventions"].sum())


def test_one_that_always_looks_is_the_caregiver_itself_and_one_that_never_does_does_nothing():
    assert rows(AttentiveRule, 1.0) == rows(PaperCaregiver, 1.0)
    assert rows(AttentiveRule, 0.0)[1] == 0 < rows(AttentiveRule, 0.5)[1]

"""Different children side by side in one batch."""

import numpy as np
import pytest

from caregiver_mj.children.behaviour import Sight
from caregiver_mj.children.family import Family
from caregiver_mj.children.novice import Novice
from caregiver_mj.children.side_by_side import side_by_side
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan

PLAN = FloorPlan.load("paper")


def test_each_decides_for_its_share():
    families = [Family.of(epsilon) for epsilon in (1.0, 0.0)]
    together = side_by_side(PLAN, families, 3)
    assert len(together) == 1
    assert together.epsilon == 0.5
    random = np.random.default_rng(0)
    cell, goal = random.integers(len(PLAN.free_cells), size=6), random.integers(len(PLAN.bins), size=6)
    sight = Sight(cell, goal, np.full(6, -1), np.zeros(6, bool))
    draws = random.random((6, 3))
    (behaviour,) = together.children
    behaviour.reset(6)
    expected = [
        family.make(PLAN)[0].act(sight.of(share), draws[share])
        for family, share in zip(families, (slice(0, 3), slice(3, 6)), strict=True)
    ]
    assert behaviour.act(sight, draws).tolist() == np.concatenate(expected).tolist()
    assert behaviour.next_bin(draws[:, 2]).tolist() == (draws[:, 2] * len(PLAN.bins)).astype(int).tolist()


def test_another_number_of_episodes_is_refused():
    (behaviour,) = side_by_side(PLAN, [Family.of(0.5)], 3).children
    with pytest.raises(CaregiverError, match=r"batch must be 3, .*, got 4"):
        behaviour.reset(4)


def test_families_are_alike_in_number_and_share_no_object():
    with pytest.raises(CaregiverError, match="families must have equally many children, got 1, 2"):
        side_by_side(PLAN, [Family.of("1"), Family.of("1,.5")], 3)
    child = Novice(PLAN, 0.5)
    with pytest.raises(CaregiverError, match="got the same Novice twice"):
        side_by_side(PLAN, [Family.of(child), Family.of(child)], 3)

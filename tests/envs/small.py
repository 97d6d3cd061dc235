"""A small house, another one, and equality of what environments return, for their tests."""

import gymnasium
import numpy as np

import caregiver_mj
from caregiver_mj.plans.floor_plan import FloorPlan

PLAN = FloorPlan.parse("########\n#..C..B#\n#......#\n#.T..BS#\n########", "small")
OTHER = FloorPlan.parse("########\n#S.C..B#\n#......#\n#.TC.BS#\n########", "other")
TARGETS = "caregiver_mj/Supervise-Targets-v0"

gymnasium.register_envs(caregiver_mj)


def same(a, b):
    """Whether observations, or runs of them, are equal, value for value."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, (list, tuple)):
        return len(a) == len(b) and all(map(same, a, b))
    return np.array_equal(a, b)

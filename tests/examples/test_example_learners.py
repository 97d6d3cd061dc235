"""The learners of the examples; they need the extra `learn`."""

import numpy as np
import pandas as pd
import pytest

pytest.importorskip("sb3_contrib")

import supervise_targets
import torch
from gymnasium import spaces
from hazard_policy import HazardPolicy
from judge_targets import learnt, policies_of
from supervise_targets import damage_alone, new_model, train
from targets_vector import Remembering

from caregiver_mj.envs.houses_vector import GridHousesVector
from caregiver_mj.envs.sb3 import BatchVecEnv
from caregiver_mj.plans.floor_plan import FloorPlan

torch.set_num_threads(1)

ONE = FloorPlan.parse("########\n#..C..B#\n#......#\n#.T..BS#\n########", "one")
OTHER = FloorPlan.parse("########\n#S.C..B#\n#......#\n#.TC.BS#\n########", "other")


def vector(episodes=6):
    return GridHousesVector((ONE, OTHER), episodes, 2, supervise_targets.FAMILIES, slots=(2, 3))


def test_in_which_place_a_hazard_is_does_not_matter():
    env = BatchVecEnv(Remembering(vector()))
    policy = HazardPolicy(env.observation_space, env.action_space, lambda _: 1e-3)
    assert isinstance(env.observation_space, spaces.Dict)
    random = np.random.default_rng(0)
    shapes = {key: (1, *box.shape) for key, box in env.observation_space.items()}
    seen = {key: torch.as_tensor(random.random(shape), dtype=torch.float32) for key, shape in shapes.items()}
    order = [4, 2, 0, 1, 3]
    actions = [0, *(1 + place for place in order)]
    moved = dict(seen)
    for key, values in seen.items():
        if values.shape[-1] == 5 and key not in ("caregiver_position", "child_position"):
            moved[key] = values[..., order]
        elif values.shape[-1] == 6:
            moved[key] = values[..., actions]
    one, other = (policy.get_distribution(each).distribution.logits for each in (seen, moved))
    torch.testing.assert_close(one[:, actions], other)
    assert (one[0] - one[0, 0]).abs().max() > 0
    torch.testing.assert_close(policy.predict_values(seen), policy.predict_values(moved))


def test_it_trains_goes_on_and_is_judged(tmp_path, monkeypatch):
    monkeypatch.setattr(supervise_targets, "new_model", lambda seed, env: new_model(seed, env, length=100, batch=300))
    alone = np.array([damage_alone(plan, 2) for plan in (ONE, OTHER)])
    for steps in (1200, 1200, 2400):
        train(0, steps, tmp_path, vector(), alone)
    curve = pd.read_csv(tmp_path / "seed-0-curve.csv")
    assert curve.steps.tolist() == [1200, 2400]
    assert curve.core_seconds.is_monotonic_increasing
    rows = learnt(ONE, policies_of(tmp_path), (2, 3), 1)
    assert rows.caregiver.unique().tolist() == ["PPO, seed 0", "paper, once"]
    assert (rows.damage >= 0).all()

"""The page about trained policies, from episodes that are made up."""

import numpy as np
import pandas as pd
import pytest
from judge_targets import RULE, SCRIPTED
from learning_page import PPO, page, read_curves, read_judged

from caregiver_mj.experiments.settings import EPSILONS

LEFT = {"none": 1.0, "nearest": 0.4, "paper": 0.4, "foresight": 0.2, "knows-goal": 0.2, "floor": 0.1}
LEARNT = {"PPO, seed 0": 0.35, "PPO, seed 1": 0.25, RULE: 0.4}


def episodes(house, shares):
    random = np.random.default_rng(house)
    alone = random.integers(10, 30, (len(EPSILONS), 6))  # the same episodes with everybody
    return pd.DataFrame(
        {
            "world": "grid",
            "house": f"house-{house}",
            "caregiver": name,
            "family": f"{epsilon:g}",
            "epsilon": epsilon,
            "episode": episode,
            "damage": share * alone[i, episode],
            "toys_reached": 1,
        }
        for name, share in shares.items()
        for i, epsilon in enumerate(EPSILONS)
        for episode in range(6)
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    assert set(LEFT) == set(SCRIPTED)
    folder = tmp_path_factory.mktemp("run")
    for name, shares, houses in (("scripted", LEFT, range(5)), ("learnt", LEARNT, range(4))):
        (folder / name).mkdir()
        for house in houses:
            episodes(house, shares).to_parquet(folder / name / f"house-{house}-6.parquet")
    for seed in (0, 1):
        steps = np.arange(1, 9) * 100
        curve = {"steps": steps, "core_seconds": steps / 2, "damage": 50 - np.arange(8), "alone": 60}
        pd.DataFrame(curve).to_csv(folder / f"seed-{seed}-curve.csv", index=False)
    return folder


@pytest.fixture(scope="module")
def stairs():
    decisions = np.arange(1, 9) * 150
    curves = {str(seed): pd.DataFrame({"decisions": decisions, "core_seconds": 3.0, "reward": 0.5}) for seed in (0, 1)}
    who = ("PPO, seed 0", "PPO, seed 1", "scripted", "stands still")
    rows = [(name, i, reward, 0.5) for name, reward in zip(who, (0.4, 0.6, 0.9, 0.1), strict=True) for i in range(3)]
    return curves, pd.DataFrame(rows, columns=["who", "episode", "reward", "cost"])


def test_a_policy_is_the_mean_of_its_seeds_where_all_were_judged(folder):
    rows = read_judged(folder)
    assert sorted(rows.house.unique()) == [f"house-{house}" for house in range(4)]
    shares = rows.groupby("caregiver").damage.mean() / rows[rows.caregiver == "none"].damage.mean()
    assert shares[PPO] == pytest.approx(0.3)


def test_the_page_says_what_was_found(folder, stairs):
    curves, judged = stairs
    text = page(read_judged(folder), read_curves(folder), curves, judged)
    # Every ratio is the same in every episode, and so its interval has no width.
    assert f"| `{PPO}` | 0.30 (0.30 to 0.30)" in text
    assert "| *spread of the seeds (sd)* | 0.071" in text
    assert "Against `paper` it leaves less damage at 100 %, 75 %, 50 %, 25 %, 5 % random." in " ".join(text.split())
    assert "Against `foresight` it leaves more damage" in " ".join(text.split())
    assert "2 seeds, each of at least 800 timesteps (6.7 core-minutes)" in " ".join(text.split())
    assert "| *mean of the seeds, ± their sd* | 0.50 ± 0.14 |  |" in text
    assert "nan" not in text

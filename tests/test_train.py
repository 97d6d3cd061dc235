"""Training of the learned caregiver: gradients, what a fit comes to, and a run that goes on."""

import concurrent.futures

import numpy as np
import pytest
import train
from rich.progress import Progress

from caregiver_mj.errors import CaregiverError


def toy(random, worlds=3000):
    """Two or three options in each world, the best that with the greatest first feature, or in some the least."""
    counts = random.integers(2, 4, worlds)
    rows, turned = random.standard_normal((counts.sum(), 4)), random.choice([-1.0, 1.0], (worlds, 1))
    parts = rows, turned, counts, 1.0 - rows[:, 0] * turned[:, 0].repeat(counts)
    return tuple(part.astype(np.float32) if part.dtype == float else part for part in parts)


def test_gradients_are_those_of_the_loss(monkeypatch):
    monkeypatch.setattr(train, "HIDDEN", 5)
    random = np.random.default_rng(0)
    data = [part.astype(float) if part.dtype == np.float32 else part for part in toy(random, 20)]
    net = {name: value.astype(float) for name, value in train.begin(*data[:2], random).items()}
    _, found = train.gradients(net, *data, loose=0.0)
    assert {*net} - {*found} == {"mean", "spread", "mean_world", "spread_world"}
    for name, gradient in found.items():
        where = tuple(0 for _ in gradient.shape)
        ends = []
        for step in (1e-6, -1e-6):
            moved = net | {name: net[name].copy()}
            moved[name][where] += step
            ends.append(train.gradients(moved, *data, loose=0.0)[0])
        assert gradient[where] == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-7)


def test_a_fit_finds_what_is_best():
    random = np.random.default_rng(0)
    data, others = toy(random), toy(random)
    net = train.begin(*data[:2], random)
    before = train.regret(net, others)
    net, loss = train.fit(net, data, 12, random)
    assert loss < 0.1 < before
    assert train.regret(net, others) < 0.1 * before


@pytest.mark.slow
def test_a_run_that_goes_on_comes_to_the_same(tmp_path, monkeypatch):
    for name, value in {"EPISODES": 2, "PAIRS": 1, "BLOCK": 1, "PASSES": 1, "LAST": 2}.items():
        monkeypatch.setattr(train, name, value)
    houses = ["hall-300001", "stairs-only-300005"]

    def run(folder):
        folder.mkdir(exist_ok=True)
        with concurrent.futures.ThreadPoolExecutor(1) as pool, Progress() as progress:
            return train.Run(folder, houses, 0, 1, 60.0).train(pool, progress)

    whole = run(tmp_path / "whole")
    names = {path.name for path in (tmp_path / "whole").iterdir()}
    assert names == {"block-0.npz", "block-1.npz", "curve.csv", "curve.svg", *(f"{house}.npz" for house in houses)}
    for lost in ("block-1.npz", f"{houses[1]}.npz"):
        (tmp_path / "whole" / lost).unlink()
    again = run(tmp_path / "whole")
    assert all((whole[name] == again[name]).all() for name in whole)


@pytest.mark.parametrize("wrong", [["--houses", "test-3"], ["--minutes", "0"]])
def test_what_cannot_be_is_said(tmp_path, wrong, capsys):
    with pytest.raises(SystemExit):
        train.main(["--out", str(tmp_path / "out"), *wrong])
    assert wrong[0] in capsys.readouterr().err


def test_a_run_goes_on_as_what_it_was_begun_as(tmp_path):
    kept = tmp_path / "run.json"
    for seed in (0, 0):
        train._keep(kept, {"seed": seed, "houses": ["train-2"]})
    with pytest.raises(CaregiverError, match="must have its seed and houses"):
        train._keep(kept, {"seed": 1, "houses": ["train-2"]})

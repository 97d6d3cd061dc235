"""Training of the learned caregiver: gradients, what a fit comes to, and a run that goes on."""

import concurrent.futures

import numpy as np
import pytest
import train
from rich.console import Console
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


def test_what_closes_half_of_the_way_is_said_to(capsys):
    """Two houses in which the rule comes to 4 and 2, foresight to 2 and 0: 3 and 1 are half-way, 2 and 2 as well."""
    found = np.zeros((2, 4, 7))
    found[:, :, :5] = np.array([[4, 3, 2, 2], [2, 1, 2, 0]])[:, :, None]
    train.show(found, ["rule", "learned, a", "learned, b", "foresight"], Console(width=200))
    rows = [line for line in capsys.readouterr().out.splitlines() if "%" in line and "|" in line]
    assert [row.split("|")[7].strip() for row in rows[1:]] == [
        "50% (50% to 50%)",
        "50% (0% to 100%)",
        "50% (25% to 75%)",
    ]


@pytest.mark.slow
def test_runs_are_judged_in_houses_of_ones_own(tmp_path, capsys):
    random = np.random.default_rng(0)
    net = train.begin(*(random.standard_normal((4, size)) for size in (43, 28)), random)
    for name, one in {"one": net, "same": net, "other": net | {"w3": -net["w3"]}}.items():
        (tmp_path / name).mkdir()
        np.savez(tmp_path / name / "learned.npz", **one)
    one, same, other = (str(tmp_path / name) for name in ("one", "same", "other"))
    given = ["--out", one, "--judge", same, other, "--jobs", "1", "--episodes", "1"]
    train.main([*given, "--houses", "shapes-test-1"])
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith("| ")]
    assert [row.split(" |")[0] for row in rows[4:7]] == ["| learned, one", "| learned, same", "| learned, other"]
    damages = [row.split("|")[2:7] for row in rows[4:7]]
    assert damages[0] == damages[1] != damages[2]  # the children are the same
    with pytest.raises(SystemExit):
        train.main([*given[:3], str(tmp_path / "none")])
    assert "--judge must be of runs that have learned.npz" in capsys.readouterr().err


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

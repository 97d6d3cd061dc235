"""From grid to house: ratios over houses, the robot watched, and the page about them."""

import dataclasses
import itertools
import json
import math

import numpy as np
import pandas as pd
import pytest

from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.tasks import load
from studies import grid_to_house
from studies.grid_to_house import (
    GRID,
    PARTS,
    PHASES,
    REMAINDER,
    STEPS,
    Handicap,
    Results,
    Rows,
    Watch,
    damages,
    draw_houses,
    draw_steps,
    draw_time,
    in_both_worlds,
    ladder,
    number,
    page,
    read_rows,
)

EPSILONS = (1.0, 0.5)
HOUSES = tuple(f"house-{seed}" for seed in range(200_000, 200_006))


# -- The house -------------------------------------------------------------------------------------


def test_the_watch_accounts_for_every_second():
    paper = FloorPlan.load("paper")
    env = load("supervise", paper, 0.5, random=1)
    policy = CaregiverPolicy(env)
    timestep = env.reset()
    watch = Watch(env, policy, Navigator(paper, env.task.embodiment))
    for _ in range(2500):
        action = policy(timestep)
        watch.look()
        timestep = env.step(action)
    watch.finish()
    assert sum(watch.seconds.values()) == pytest.approx(2500 * env.control_timestep())
    table = pd.DataFrame(watch.phases)
    assert table[list(PARTS)].sum(axis=1).tolist() == pytest.approx(table.house.tolist())
    done = table[table.end == "done"]
    assert (done.phase != "fetch").sum() == policy.interventions_done > 0
    assert set(table.end) <= {"done", "failed", "given up"}
    assert (done.grid >= 0).all()


# -- Ratios ----------------------------------------------------------------------------------------


def table(by_house):
    """Damage of two episodes in each house, a number for each epsilon."""
    index = pd.MultiIndex.from_product([range(len(by_house)), range(2)], names=["house", "episode"])
    return pd.DataFrame(np.repeat(np.array(by_house, float), 2, axis=0), index, columns=list(EPSILONS))


def test_the_ratio_is_the_mean_of_those_of_every_epsilon():
    grid, house = table([[10, 1], [20, 3]]), table([[10, 3], [35, 3]])
    assert grid_to_house.ratio(house[[1.0]], grid[[1.0]]).value == pytest.approx(45 / 30)
    assert grid_to_house.ratio(house, grid).value == pytest.approx((45 / 30 + 6 / 4) / 2)
    found = grid_to_house.by_house(house, grid)
    assert found.ratio.tolist() == pytest.approx(
        [(10 / 15 + 3 / 2) / (10 / 15 + 1 / 2), (35 / 15 + 3 / 2) / (4 / 3 + 3 / 2)]
    )
    assert found.weight.sum() == pytest.approx(1.0)


def test_epsilons_and_houses_in_which_nothing_happens():
    grid, house = table([[10, 0], [0, 0]]), table([[12, 1], [0, 0]])
    assert grid_to_house.ratio(house, grid).value == pytest.approx(1.2)
    assert grid_to_house.by_house(house, grid).ratio.isna().tolist() == [False, True]
    assert math.isnan(grid_to_house.ratio(house[[0.5]], grid[[0.5]]).value)


def chance(houses=40, seed=0):
    random = np.random.default_rng(seed)
    rate = random.gamma(2.0, 3.0, houses).repeat(2)
    index = pd.MultiIndex.from_product([range(houses), range(2)], names=["house", "episode"])
    draw = (pd.DataFrame({1.0: random.poisson(4 * rate), 0.5: random.poisson(rate)}, index) for _ in range(2))
    grid, house = draw
    return grid, house * [1.0, 2.0]


def test_the_interval_of_one_epsilon_is_that_over_houses():
    grid, house = chance()
    ours, theirs = ([part.to_numpy() for _, part in t[1.0].groupby("house")] for t in (house, grid))
    assert grid_to_house.ratio(house[[1.0]], grid[[1.0]]) == pytest.approx(two_level.of_ratio(ours, theirs))


def test_the_interval_of_the_mean_of_ratios_is_about_that_of_resampled_houses():
    grid, house = chance()
    found = grid_to_house.ratio(house, grid)
    random = np.random.default_rng(1)
    y, x = (t.groupby("house").mean().to_numpy() for t in (house, grid))
    drawn = [random.integers(len(x), size=len(x)) for _ in range(2000)]
    low, high = np.quantile([(y[d].mean(0) / x[d].mean(0)).mean() for d in drawn], [0.025, 0.975])
    assert found.value == pytest.approx(1.5, abs=0.25)
    assert found.high - found.low == pytest.approx(high - low, rel=0.25)
    assert found.low == pytest.approx(low, abs=0.1)
    # Another unit of damage at one epsilon changes nothing.
    assert grid_to_house.ratio(house * [1, 7], grid * [1, 7]) == pytest.approx(found)


def test_the_steps_lead_from_the_grid_to_the_house():
    found = results()
    steps = grid_to_house.steps(found)
    assert list(steps) == [*STEPS, REMAINDER]
    whole = {name: step.value for name, (_, step) in steps.items()}
    assert whole == pytest.approx({"once": 0.0, "driving": 0.1, "waiting": 0.2, REMAINDER: -0.1})
    first = {name: step.column(0).value for name, (step, _) in steps.items()}
    assert first == pytest.approx(whole)
    assert grid_to_house.alone(found, "waiting alone").value == pytest.approx(0.15)


# -- Rows of a run ---------------------------------------------------------------------------------


def a_run(folder, run=None, names=("none", "paper"), **changes):
    """A finished run of two episodes in one house; its rows are the grid's."""
    settings = Settings(FloorPlan.load("house-200000"), "grid", names, EPSILONS, 2, seed=5)
    found = evaluate(settings).episodes
    found.assign(**({"world": "house"} | changes)).to_parquet(folder / "episodes.parquet")
    (folder / "run.json").write_text(json.dumps(settings.record() | {"world": "house"} | (run or {})))
    return found


def test_the_grid_runs_the_episodes_of_a_run(tmp_path):
    made = a_run(tmp_path)
    rows = in_both_worlds(read_rows(tmp_path), jobs=1)
    assert (rows.houses, rows.epsilons) == (("house-200000",), EPSILONS)
    for caregiver in ("none", "paper"):
        assert rows.damage("grid", caregiver).equals(rows.damage("house", caregiver))
    wanted = made[(made.caregiver == "paper") & (made.epsilon == 0.5)].damage.tolist()
    assert rows.damage("house", "paper")[0.5].tolist() == wanted


def test_of_a_run_with_several_caregivers_the_one_that_is_asked_for(tmp_path):
    made = a_run(tmp_path, names=("none", "paper", "guard"))
    rows = read_rows(tmp_path, "guard")
    assert (rows.caregiver, rows.settings.caregivers) == ("guard", ("none", "guard"))
    wanted = made[(made.caregiver == "guard") & (made.epsilon == 0.5)].damage.tolist()
    assert in_both_worlds(rows, jobs=1).cared[0][0.5].tolist() == wanted
    without = damages(rows.settings, 2, {GRID: Handicap()}, "house-200000")[GRID]
    assert without[0.5].tolist() == wanted
    with pytest.raises(CaregiverError, match="lacks episodes with none and nearest"):
        read_rows(tmp_path, "nearest")


def test_the_grid_without_a_handicap_is_the_grid(tmp_path):
    a_run(tmp_path)
    rows = read_rows(tmp_path)
    found = damages(rows.settings, 2, {GRID: Handicap(), "waiting": Handicap(near=1.0)}, "house-200000")
    assert found[GRID].equals(rows.damage("house", "paper").rename_axis(columns=None))
    assert not found["waiting"].equals(found[GRID])


@pytest.mark.parametrize(
    ("run", "changes", "told"),
    [
        ({}, {"caregiver": "paper"}, "lacks episodes with none and paper"),
        ({"episodes": 3}, {}, "lacks episodes with none and paper"),
        ({"world": "grid"}, {}, "is not one of single novices in the physical house"),
        ({"families": ["toddler:0.5", "1"]}, {}, "is not one of single novices in the physical house"),
        ({"seed": 1}, {}, "have other seeds"),
        ({"plans": 1}, {}, "must hold a finished run"),
    ],
)
def test_runs_that_will_not_do(tmp_path, run, changes, told):
    a_run(tmp_path, run, **changes)
    with pytest.raises(CaregiverError, match=told):
        read_rows(tmp_path)


# -- The page --------------------------------------------------------------------------------------


def made_rows(houses, called, grid=10.0, house=12.0, alone=40.0, who="paper"):
    """Two episodes in each house with each novice, all the same; at epsilon 0.5 there is half the damage.

    Of the physical houses every other one has a little more than that, and the others as much less.
    """
    kinds = {
        "damage_stairwell": 5.0,
        "damage_candle": 4.0,
        "damage_table": 1.0,
        "damage_gate": 0.0,
        "damage_battery": 0.0,
        "interventions_done": 6,
    }
    rows = [
        {"world": world, "house": name, "caregiver": caregiver, "epsilon": e, "episode": i, "damage": damage * e}
        | kinds
        for off, name in zip(itertools.cycle((0.1, -0.1)), houses, strict=False)
        for e in EPSILONS
        for i in range(2)
        for world, cared in (("grid", grid), ("house", house + off * (len(houses) > 1)))
        for caregiver, damage in (("none", alone), (who, cared))
    ]
    settings = Settings(tuple(map(FloorPlan.load, houses)), "house", ("none", who), EPSILONS, 2, houses=called)
    return Rows(pd.DataFrame(rows), settings)


def results(**damage):
    """Results in which the house leaves 1.2 times what the grid leaves."""
    rows = made_rows(HOUSES, "test-6", **damage)
    level = {GRID: 1.0, "once": 1.0, "driving": 1.1, "waiting": 1.3, "driving alone": 1.1, "waiting alone": 1.15}
    zeros = dict.fromkeys(PARTS, 0.0)
    phases = [
        {**zeros, "phase": phase, "end": end, "grid": 2.0, "house": 3.0, "clear": 2.5, "full": 3.0}
        for phase in PHASES
        for end in ("done", "given up")
    ]
    return Results(
        rows=rows,
        levels={name: share * rows.damage("grid", "paper") for name, share in level.items()},
        handicaps=ladder(1.08, 0.42),
        phases=pd.DataFrame(phases),
        seconds=pd.DataFrame([{"block": 3.0, "idle": 333.0}] * 2),
        same=(6, 6),
        delays={GRID: 0.5, "waiting": 0.9},
    )


def text_of(found):
    return page(found, "caregiver-mj evaluate").text("grid_to_house", "python scripts/study.py grid_to_house")


def flat(found):
    return " ".join(text_of(found).split())


def test_page():
    text = text_of(results())
    assert text.startswith("# From grid to house\n")
    assert "    caregiver-mj evaluate\n    python scripts/study.py grid_to_house\n" in text
    told = flat(results())
    assert "in 6 houses (`test-6`), 2 episodes in each for each epsilon of 1, 0.5" in told
    assert "leaves 1.20 (1.19 to 1.21) times the damage that the grid leaves" in told
    assert "The goal is 1.15 at most, and the interval lies above it as a whole." in told
    assert "24 of 24 episodes have the same damage in both worlds" in told
    assert "6 of 6 episodes have the damage that they have in the run" in told
    assert "| 0.5 | 20.00 | 5.00 | 6.00 | 0.25 | 0.30 | 1.20 (1.19 to 1.21) |" in text
    assert "| all |  |  |  | 0.25 | 0.30 | **1.20 (1.19 to 1.21)** |" in text
    step = "+0.00 (+0.00 to +0.00) | +0.10 (+0.10 to +0.10) | +0.20 (+0.20 to +0.20) | -0.10 (-0.11 to -0.09)"
    assert f"| all | {step} | **1.20** |" in text
    assert "above 0 of driving and waiting. Together they overdo it: the house leaves less." in told
    assert "takes 1.08 thirds of a timestep instead of one" in told
    assert "driving +0.10 (+0.10 to +0.10) and waiting +0.15 (+0.15 to +0.15)" in told
    assert "| fetch | 1 | 2.00 (2.00) | 3.00 (3.00) | 1.00 (1.00) |" in text
    assert "block: 1 done, 1 given up for another target or at the end, 0 failed" in told
    assert not {"nan", "inf"} & set(told.replace(",", " ").split())
    assert all(len(line) <= 120 for line in text.splitlines() if not line.startswith("|"))


def test_page_of_another_caregiver():
    found = dataclasses.replace(results(), rows=made_rows(HOUSES, "test-6", who="foresight"))
    text = text_of(found)
    assert page(found, "").name == "grid_to_house_foresight"
    assert "The caregiver `foresight` in 6 houses" in text
    assert "(grid_to_house_foresight_steps.png)" in text
    assert "The rule" not in text
    assert "leaves 1.20 (1.19 to 1.21) times" in text
    assert page(results(), "").name == "grid_to_house"
    assert {"grid_to_house.png", "grid_to_house_time.png"} < set(page(results(), "").figures)


@pytest.mark.parametrize(
    ("damage", "told"), [(10.5, "lies within it as a whole"), (11.55, "does not decide whether it is met")]
)
def test_what_the_interval_says_of_the_goal(damage, told):
    assert f"The goal is 1.15 at most, and the interval {told}." in flat(results(house=damage))


@pytest.mark.parametrize(
    ("driving", "told"),
    [
        ([0.1] * 6, "above 0 of driving."),
        ([0.5, -0.3, 0.1] * 2, "above 0 of none."),  # on average it is, but that may be chance
        ([-0.1] * 6, "above 0 of none."),
    ],
)
def test_what_costs_something(driving, told):
    found = results()
    grid = found.levels[GRID]
    shares = pd.Series(driving, HOUSES).reindex(grid.index.get_level_values("house")).to_numpy()
    changed = dict.fromkeys(("driving", "waiting"), grid.mul(1 + shares, axis=0))
    assert told in flat(dataclasses.replace(found, levels=found.levels | changed))


@pytest.mark.parametrize(
    ("house", "told"), [(15.0, "the house leaves more."), (12.0, "the house leaves less."), (13.0, "may be chance.")]
)
def test_what_is_not_explained(house, told):
    assert told.replace("the house leaves more", "it leaves more") in flat(results(house=house))


def test_numbers():
    shown = [number(value) for value in (1.234, -0.001, math.inf, -math.inf, math.nan)]
    assert shown == ["1.23", "0.00", "∞", "-∞", "–"]


def test_figures():
    labels = [label.get_text() for label in draw_houses(results()).axes[0].get_xticklabels()]
    assert labels == ["epsilon 1", "epsilon 0.5", "all"]
    figure = draw_steps(results())
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["epsilon 1", "epsilon 0.5", "all"]
    labels = [label.get_text() for label in figure.axes[-1].get_xticklabels()]
    assert labels == ["grid", "deciding once", "driving", "waiting", "not explained", "house"]
    heights = [bar.get_height() for bar in figure.axes[-1].patches]
    assert heights == pytest.approx([0.0, 0.1, 0.2, -0.1])
    assert [label.get_text() for label in draw_time(results()).axes[0].get_yticklabels()] == list(PHASES)

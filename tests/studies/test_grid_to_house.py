"""From grid to house: ratios over houses, the robot watched, and the page about them."""

import itertools
import json

import numpy as np
import pandas as pd
import pytest

from caregiver_mj.errors import CaregiverError
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
        ({"world": "grid"}, {}, "is not one of single novices in the physical house"),
        ({"seed": 1}, {}, "have other seeds"),
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


@pytest.mark.parametrize(
    ("house", "told"),
    [
        (10.5, "The goal is 1.15 at most, and the interval lies within it as a whole."),
        (11.55, "The goal is 1.15 at most, and the interval does not decide whether it is met."),
        (15.0, "it leaves more."),
        (13.0, "may be chance."),
    ],
)
def test_the_page_says_what_its_numbers_say(house, told):
    assert told in flat(results(house=house))


def test_figures():
    assert len(draw_houses(results()).axes[0].get_xticklabels()) == 3
    axes = draw_steps(results()).axes[-1]
    labels = [label.get_text() for label in axes.get_xticklabels()]
    assert labels == ["grid", "deciding once", "driving", "waiting", "not explained", "house"]
    assert [bar.get_height() for bar in axes.patches] == pytest.approx([0.0, 0.1, 0.2, -0.1])
    assert [label.get_text() for label in draw_time(results()).axes[0].get_yticklabels()] == list(PHASES)

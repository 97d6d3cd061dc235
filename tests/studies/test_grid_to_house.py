"""From grid to house: phases in both worlds, and the page about them."""

import dataclasses
import math

import numpy as np
import pandas as pd
import pytest

from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.experiments.seeds import episode_seed, episode_tapes
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.studies.grid_to_house import words
from caregiver_mj.studies.grid_to_house.document import document
from caregiver_mj.studies.grid_to_house.figures import draw
from caregiver_mj.studies.grid_to_house.grid import WatchedGrid, grid_delays
from caregiver_mj.studies.grid_to_house.phases import PARTS, PHASES
from caregiver_mj.studies.grid_to_house.results import EPSILONS, Results
from caregiver_mj.studies.grid_to_house.watch import Watch
from caregiver_mj.tasks import load

TAPES = [episode_tapes(episode_seed(0, i), 1) for i in range(20)]


@pytest.fixture(scope="module")
def paper():
    return FloorPlan.load("paper")


# -- The grid --------------------------------------------------------------------------------------


def test_the_grid_logs_what_was_done_and_is_not_changed_by_it(paper):
    watched, plain = (kind(paper, 0.5, make_caregiver("paper", paper, 0)) for kind in (WatchedGrid, GridWorld))
    ledger, other = watched.run(TAPES), plain.run(TAPES)
    assert all((ledger.totals()[name] == other.totals()[name]).all() for name in other.totals())
    table = pd.DataFrame(watched.phases)
    counts = table.phase.value_counts()
    assert counts["fetch"] >= counts["carry"] > 0
    # Whoever is there already when it occurs to it has blocked a stairwell, too, but in no phase.
    assert 0 < counts["carry"] + counts["block"] <= ledger.interventions_done.sum()
    assert (table.actions >= table.shortest).all()


def test_the_grids_caregiver_loses_a_little_time(paper):
    delays = grid_delays(paper, EPSILONS, 20)
    assert set(delays) == set(PHASES)
    assert all(0.0 < seconds < 5.0 for seconds in delays.values())


# -- The house -------------------------------------------------------------------------------------


def test_the_watch_accounts_for_every_second(paper):
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


# -- The page --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("interval", "told"),
    [
        ((1.0, 1.1), "lies within the goal as a whole"),
        ((1.1, 1.2), "reaches to both sides of the goal"),
        ((1.2, 1.3), "lies above the goal as a whole"),
        ((0.0, math.inf), "of so few episodes has no upper end"),
    ],
)
def test_where_the_interval_lies(interval, told):
    assert words.where(*interval) == told


def test_slowest_tenth():
    # Eleven phases: the slowest two of them take 9 and 3 of 15 seconds; the one that is quicker than the grid's none.
    phases = pd.DataFrame({"house": [10.0, 4.0, 4.0] + [2.0] * 7 + [1.0], "grid": [1.0, 1.0, 1.0] + [2.0] * 7 + [5.0]})
    assert words.slowest(phases) == pytest.approx(12.0 / 15.0)
    assert words.slowest(phases[3:]) == 0.0


def results():
    """Five episodes for each epsilon, in which the house leaves 1.1 times what the grid leaves."""

    def world(damage):
        columns = {"damage": damage, "damage_stairwell": 5.0, "damage_candle": 4.0, "damage_table": 1.0, "done": 6}
        return {epsilon: pd.DataFrame([columns] * 5) for epsilon in EPSILONS}

    zeros = dict.fromkeys(PARTS, 0.0)
    rows = [
        {**zeros, "phase": phase, "end": end, "grid": 2.0, "house": 3.0, "clear": 2.5, "lost": 0.0, "full": 3.0}
        for phase in PHASES
        for end in ("done", "given up")
    ]
    return Results(
        episodes=5,
        alone={e: (np.full(5, 40.0), np.full(5, 40.0)) for e in EPSILONS},
        grid=world(10.0),
        house=world(11.0),
        many=2000,
        reference=dict.fromkeys(EPSILONS, 0.25),
        phases=pd.DataFrame(rows),
        seconds=pd.DataFrame([{"block": 3.0, "idle": 333.0}] * 2),
        grid_delays=dict.fromkeys(PHASES, 0.5),
    )


def test_page():
    text = document(results(), "python scripts/grid_to_house.py")
    assert text.startswith("# From grid to house\n")
    assert "    python scripts/grid_to_house.py\n" in text
    flat = " ".join(text.split())
    assert "the house leaves 1.10 times the damage that the grid leaves" in flat
    assert "That is within the goal of 1.15 at most" in flat
    assert "15 of 15 episodes have the same damage in both worlds" in flat
    assert "over 2,000 episodes" in flat
    assert "| average |  |  |  |  |  |  | **1.100 [1.10, 1.10]** |" in text
    assert "| fetch | 1 | 2.00 (2.00) | 3.00 (3.00) | 1.00 (1.00) |" in text
    assert "- **carry**: +1.00 s." in text
    assert "block: 1 done, 1 given up for another target or at the end, 0 failed" in flat
    assert "nan" not in text
    assert all(len(line) <= 120 for line in text.splitlines() if not line.startswith("|"))


def test_page_of_a_house_that_leaves_too_much():
    bad = dataclasses.replace(results(), house={e: t.assign(damage=20.0) for e, t in results().house.items()})
    assert "That is not within the goal" in " ".join(document(bad, "").split())


def test_figure():
    figure = draw(results())
    damage, time = figure.axes
    assert [label.get_text() for label in damage.get_xticklabels()] == [f"epsilon {e:g}" for e in EPSILONS]
    assert [label.get_text() for label in time.get_yticklabels()] == list(PHASES)

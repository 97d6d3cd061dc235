"""The caregiver that searches: what it simulates is the grid; and the table of those that judge it."""

import dataclasses
import re

import judge_rollout
import numpy as np
import pytest
import rollout_caregiver
from rollout_caregiver import RolloutCaregiver, to_expect

from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.danger.child_model import child_chain
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.spec import episode_streams
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan

HOUSE = "#########\n#S..#..B#\n#...#..C#\n#.......#\n#B..#..T#\n#########\n"


@pytest.fixture(name="plan")
def fixture_plan():
    return FloorPlan.parse(HOUSE)


def streams(episodes):
    return [episode_streams(episode, 1) for episode in range(episodes)]


@pytest.mark.parametrize("sight", ["walls", "all"])
def test_a_simulated_child_goes_where_it_must_unless_the_caregiver_is_in_its_way(plan, sight, monkeypatch):
    monkeypatch.setattr(rollout_caregiver, "SCENARIOS", 20)
    monkeypatch.setattr(rollout_caregiver, "AHEAD", 1)
    caregiver = RolloutCaregiver(plan)
    world = GridWorld(plan, 0.05, caregiver, sight=sight)
    world.reset(streams(1))
    # From below the doorway's left side there is one way to the bin at the right: through the doorway, to the east.
    cell, doorway = plan.cell_index[3, 3], plan.cell_index[3, 4]
    goal = plan.bins.index((1, 7))
    assert child_chain(plan).greedy[cell, goal].max() == 1.0
    percept = dataclasses.replace(world.percept(), child_cell=np.array([[cell]]))
    if percept.belief:
        caregiver.belief = percept.belief
        percept.belief.joint[:] = 0.0
        percept.belief.joint[0, 0, cell, goal, 0] = 1.0  # of epsilon 0.05: one in 20 moves is at random
    caregiver.belief.probability[:] = 0.0
    caregiver.belief.probability[0, 0, goal, 0] = 1.0
    stay = len(plan.stairwells) + 1
    for at, then in ((doorway, cell), (plan.cell_index[3, 7], doorway)):
        there = dataclasses.replace(percept, caregiver_cell=np.array([at]))
        cost = caregiver.simulate(there, np.array([0]), np.array([[stay]]))
        assert cost.shape == (1, 1, 20)
        assert (caregiver.world.child_cell == then).sum() >= 19
        assert (caregiver.world.goal == goal).all()


def test_it_does_what_costs_least_for_the_rest_of_a_timestep(plan, monkeypatch):
    stay = len(plan.stairwells) + 1

    def simulate(self, percept, worlds, options):
        return np.repeat(np.where(options == stay, 0.0, 1.0)[..., None], 2, axis=2)

    monkeypatch.setattr(rollout_caregiver, "OTHERS", 100)
    monkeypatch.setattr(RolloutCaregiver, "simulate", simulate)
    moved = []
    for caregiver in (make_caregiver("foresight", plan), RolloutCaregiver(plan)):
        world = GridWorld(plan, 0.5, caregiver, sight="walls")
        world.reset(streams(4))
        before = world.caregiver_cell
        for _ in range(3):
            world.step()
        moved.append((world.caregiver_cell != before).any())
    assert moved == [True, False]
    assert caregiver.others.any()


def test_what_it_draws_depends_on_the_episode_alone(plan, monkeypatch):
    monkeypatch.setattr(rollout_caregiver, "SCENARIOS", 4)

    def cells(which):
        world = GridWorld(plan, 0.75, RolloutCaregiver(plan), sight="camera")
        world.reset([streams(2)[number] for number in which])
        for _ in range(8):
            world.step()
        return world.caregiver_cell.tolist(), world.child_cell[:, 0].tolist()

    both, alone = cells([0, 1]), cells([1])
    assert [values[1:] for values in both] == list(alone)


def test_what_is_to_be_expected_is_what_comes(plan):
    world = GridWorld(plan, 0.75, make_caregiver("expected-danger", plan))
    world.reset(streams(400))
    expected = np.zeros(400)
    for _ in range(25):
        expected += to_expect(world)
        world.step()
    error = world.ledger.damage - expected
    assert expected.mean() > 0.5
    assert abs(error.mean()) < 4 * error.std() / len(error) ** 0.5 < 0.3 * expected.mean()


def test_gates_and_several_children_are_refused(plan):
    for house, children in ((HOUSE, 2), (HOUSE.replace("..T", "o.T"), 1)):
        plan = FloorPlan.parse(house)
        with pytest.raises(CaregiverError, match="an only child"):
            RolloutCaregiver(plan).reset(1, [0], children)


def test_it_is_judged_and_what_is_kept_is_not_judged_again(tmp_path, monkeypatch, capsys):
    (tmp_path / "tiny.txt").write_text(HOUSE)
    brief = RandomStream.draw_group(np.random.RandomState(0), 1, 6)
    monkeypatch.setattr(judge_rollout, "episode_streams", lambda seed, children: brief)
    asked = ["--houses", str(tmp_path / "tiny.txt"), "--sights", "walls", "--epsilons", ".75", "--episodes", "1"]
    monkeypatch.setattr("sys.argv", ["judge", *asked, "--jobs", "1", "--out", str(tmp_path / "out")])
    judge_rollout.main()
    table = capsys.readouterr().out
    assert re.search(r"^\| walls, 0.75 \| (\d+\.\d\d \| ){4}[+-]\d", table, re.M)
    monkeypatch.setattr(judge_rollout, "measure", None)
    judge_rollout.main()
    assert capsys.readouterr().out == table


def test_its_table():
    damage = dict(zip(judge_rollout.CAREGIVERS, (5.0, 4.0, 3.0), strict=True))
    who = [("all", "foresight"), *(("walls", name) for name in damage)]
    found = {
        judge_rollout.Job(house, *one, (0.75, 0.25), 1, 0): {
            "damage": [[damage[one[1]]], [1.0]],
            "otherwise": [[0.25], [0.5]],
            "ms": 2.0,
        }
        for house in "abc"
        for one in who
    }
    first, second = judge_rollout.report(found, (0.75, 0.25)).splitlines()[2:]
    assert first == "| walls, 0.75 | 4.00 | 5.00 | 4.00 | 3.00 | -1.00 (-1.00 to -1.00) | 25% | 2.0 | 2.0 |"
    assert second.split(" | ")[5:7] == ["+0.00 (+0.00 to +0.00)", "50%"]

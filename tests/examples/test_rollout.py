"""The caregiver that searches: what it simulates is the grid; and the table of those that judge it."""

import dataclasses

import numpy as np
import pytest
import rollout_caregiver
from rollout_caregiver import RolloutCaregiver, to_expect
from worlds import begun

from caregiver_mj import CaregiverError, FloorPlan
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.danger.child_model import child_chain
from caregiver_mj.grid.world import GridWorld

HOUSE = "#########\n#S..#..B#\n#...#..C#\n#.......#\n#B..#..T#\n#########\n"
PLAN = FloorPlan.parse(HOUSE)


@pytest.mark.parametrize("sight", ["walls", "all"])
def test_a_simulated_child_goes_where_it_must_unless_the_caregiver_is_in_its_way(sight, monkeypatch):
    monkeypatch.setattr(rollout_caregiver, "SCENARIOS", 20)
    monkeypatch.setattr(rollout_caregiver, "AHEAD", 1)
    caregiver = RolloutCaregiver(PLAN)
    world = begun(GridWorld(PLAN, 0.05, caregiver, sight=sight), 1)
    # From below the doorway's left side there is one way to the bin at the right: through the doorway, to the east.
    cell, doorway = PLAN.cell_index[3, 3], PLAN.cell_index[3, 4]
    goal = PLAN.bins.index((1, 7))
    assert child_chain(PLAN).greedy[cell, goal].max() == 1.0
    percept = dataclasses.replace(world.percept(), child_cell=np.array([[cell]]))
    if percept.belief:
        caregiver.belief = percept.belief
        percept.belief.joint[:] = 0.0
        percept.belief.joint[0, 0, cell, goal, 0] = 1.0  # of epsilon 0.05: one in 20 moves is at random
    caregiver.belief.probability[:] = 0.0
    caregiver.belief.probability[0, 0, goal, 0] = 1.0
    stay = len(PLAN.stairwells) + 1
    for at, then in ((doorway, cell), (PLAN.cell_index[3, 7], doorway)):
        there = dataclasses.replace(percept, caregiver_cell=np.array([at]))
        cost = caregiver.simulate(there, np.array([0]), np.array([[stay]]))
        assert cost.shape == (1, 1, 20)
        assert (caregiver.world.child_cell == then).sum() >= 19
        assert (caregiver.world.goal == goal).all()


def test_what_is_to_be_expected_is_what_comes():
    world = begun(GridWorld(PLAN, 0.75, make_caregiver("expected-danger", PLAN)), 400)
    expected = np.zeros(400)
    for _ in range(25):
        expected += to_expect(world)
        world.step()
    error = world.ledger.damage - expected
    assert expected.mean() > 0.5
    assert abs(error.mean()) < 4 * error.std() / len(error) ** 0.5 < 0.3 * expected.mean()


def test_gates_and_several_children_are_refused():
    for house, children in ((HOUSE, 2), (HOUSE.replace("..T", "o.T"), 1)):
        with pytest.raises(CaregiverError, match="an only child"):
            RolloutCaregiver(FloorPlan.parse(house)).reset(1, [0], children)

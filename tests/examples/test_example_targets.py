"""The example at the target level: what it sees, and how it is judged. No learner is needed for that."""

import numpy as np
from judge_targets import RULE, learnt, scripted
from targets_vector import EARLIER, Remembering

from caregiver_mj.caregivers.instructed import CommandedCaregiver
from caregiver_mj.children.child_group import ChildGroup, side_by_side
from caregiver_mj.envs.houses_vector import GridHousesVector
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.experiments.spec import episode_seed
from caregiver_mj.grid.world import run_episodes
from caregiver_mj.plans.floor_plan import FloorPlan

PLAN = FloorPlan.parse("########\n#..C..B#\n#......#\n#.T..BS#\n########", "small")
OTHER = FloorPlan.parse("########\n#S.C..B#\n#......#\n#.TC.BS#\n########", "other")


def nothing(seen, mask):
    return mask.argmax(axis=1)


def test_it_remembers_how_near_the_child_was():
    vector = Remembering(GridHousesVector((PLAN, OTHER), 2, 2))
    observation, _ = vector.reset(seed=0)
    near = [observation["hazard_nearness_to_child"][:, 0]] * (EARLIER + 1)
    moved = False
    for _ in range(199 + 1 + 3):
        np.testing.assert_array_equal(observation["before"], np.stack(near[-EARLIER - 1 : -1], axis=1))
        assert vector.observation_space.contains(observation)
        moved |= (observation["before"][:, 0] != observation["before"][:, -1]).any()
        observation, *_, info = vector.step(np.zeros(2, int))
        now = observation["hazard_nearness_to_child"][:, 0]
        near = [now] * (EARLIER + 1) if "seed" in info else [*near, now]
    assert moved


def test_policies_are_judged_on_the_episodes_of_evaluate():
    rows = learnt(PLAN, {"nothing": nothing, "again": nothing}, (2, 2), 2)
    assert rows.caregiver.unique().tolist() == ["nothing", "again", RULE]
    assert len(rows) == 3 * len(EPSILONS) * 2
    idle = CommandedCaregiver(PLAN)
    children = side_by_side(PLAN, [ChildGroup.of(epsilon) for epsilon in EPSILONS], 2)
    seeds = [episode_seed(0, episode) for episode in (0, 1)] * len(EPSILONS)
    wanted = run_episodes(PLAN, children, idle, seeds).damage
    assert wanted.any()
    for name in ("nothing", "again"):
        np.testing.assert_array_equal(rows[rows.caregiver == name].damage, wanted)
    others = scripted(PLAN, 2)
    keys = ["house", "family", "epsilon", "episode"]
    theirs = others[others.caregiver == "none"][keys].reset_index(drop=True)
    assert rows[rows.caregiver == RULE][keys].reset_index(drop=True).equals(theirs)

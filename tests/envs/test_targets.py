"""Environments whose actions are targets, in the grid and in the house."""

import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from small import PLAN, TARGETS, same

from caregiver_mj import CaregiverError, CaregiverPolicy, load
from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.plans.hazards import NOTHING

STAIRWELL, CANDLE = 1, 2  # actions in that house
SHORT = {"time_limit": 8.0}  # seconds, five novice timesteps


class Only(Caregiver):
    """Protects the children from one hazard, from their first move on."""

    def __init__(self, plan, hazard):
        super().__init__(plan)
        self.hazard = hazard

    def reset(self, batch, seeds=None, children=1):
        self.has_seen = False

    def watch(self, percept):
        self.has_seen = True

    def choose(self, percept):
        return np.full(len(percept.child_cell), self.hazard if self.has_seen else NOTHING)


def make(world="grid", house=PLAN, **options):
    return gymnasium.make(TARGETS, world=world, house=house, **options)


def run(env, seed, choose):
    observation, info = env.reset(seed=seed)
    found = []
    while not found or not (found[-1][2] or found[-1][3]):
        found.append(env.step(choose(observation, info)))
        observation, info = found[-1][0], found[-1][-1]
    return found


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"observation": "flat", "slots": (4, 6), "epsilon": "1,.25"},
        {"observation": "map", "epsilon": "1,.25"},
        {"observation": "graph", "shape": (6, 9)},
    ],
)
@pytest.mark.parametrize("world", ["grid", "house"])
def test_gymnasium_finds_no_fault(world, options, recwarn):
    options = options | ({"task_kwargs": SHORT} if world == "house" else {})
    mode = "rgb_array" if world == "grid" else None
    check_env(make(world, render_mode=mode, **options).unwrapped, skip_render_check=mode is None)
    assert [str(warning.message) for warning in recwarn if "WARN" in str(warning.message)] == []


def test_a_candle_is_relocated_and_with_it_in_the_hand_nothing_else_counts():
    env = make(epsilon=0)
    observation, info = env.reset(seed=2)
    carried = 0
    for _ in range(20):
        if observation["holding"].any():
            assert (info["action_mask"].tolist(), observation["holding"].tolist()) == ([0, 0, 1], [0, 1])
            assert observation["hazard_nearness_to_child"][0, 1] == 0
            carried += 1
        observation, *_, info = env.step(CANDLE if info["action_mask"][CANDLE] else 0)
    assert carried > 0
    assert env.unwrapped.action_masks().tolist() == info["action_mask"].astype(bool).tolist()
    assert env.unwrapped.world.world.ledger.interventions_done[0] > 0


@pytest.mark.parametrize(("observation", "epsilon"), [("numbers", 0.5), ("map", "1,.25")])
def test_the_vector_is_so_many_single_ones(observation, epsilon):
    options = {"house": PLAN, "observation": observation, "epsilon": epsilon}
    vector = gymnasium.make_vec(TARGETS, 2, **options)
    single = SyncVectorEnv([lambda: make(**options)] * 2)
    assert vector.metadata["autoreset_mode"] is single.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert vector.metadata["render_fps"] == single.metadata["render_fps"]
    assert vector.observation_space == single.observation_space
    assert vector.action_space == single.action_space
    random = np.random.RandomState(0)
    (one, info), (other, others) = vector.reset(seed=8), single.reset(seed=8)
    assert same(one, other)
    assert same(info, others)
    assert info["seed"].tolist() == [8, 9]
    for step in range(1, 204):  # to the end, and into the next episodes
        mask = info["action_mask"]
        actions = (random.random_sample(mask.shape) * mask).argmax(axis=1)
        (*one, info), (*other, others) = vector.step(actions), single.step(actions)
        assert all(map(same, one, other))
        assert same(info, others)
        assert one[3].all() == (step == 200)
        assert ("outcome" in info) == (step == 200)
        assert ("damage_by_child" in info.get("outcome", ())) == (step == 200)


def test_in_the_house_the_robot_does_what_the_scripted_one_does():
    env = make("house", task_kwargs=SHORT)
    steps = run(env, 3, lambda *_: STAIRWELL)
    assert len(steps) == 5
    elsewhere = load("supervise", PLAN, random=3, task_kwargs=SHORT)
    policy = CaregiverPolicy(elsewhere, Only(PLAN, 0))
    timestep = elsewhere.reset()
    while not timestep.last():
        timestep = elsewhere.step(policy(timestep))
    found, wanted = env.unwrapped.world.dm_env.physics, elsewhere.physics
    np.testing.assert_array_equal(found.data.qpos, wanted.data.qpos)
    info = steps[-1][-1]
    assert info["outcome"] | {"score": info["episode_score"]} == elsewhere.task.outcome()
    observation = steps[-1][0]
    assert observation["under_way"].tolist() == [0, 1, 0]
    assert observation["hazard_nearness_to_caregiver"][0] == 1  # it stands there
    assert observation in env.observation_space


@pytest.mark.parametrize("observation", ["map", "graph"])
def test_the_first_that_is_seen_is_the_same_in_both_worlds(observation):
    options = {"observation": observation, "epsilon": "1,.25", "shape": (6, 9)}
    grid, house = (make(world, **options).reset(seed=0)[0] for world in ("grid", "house"))
    assert grid.keys() == house.keys()
    for key in grid.keys() - {"clock"}:  # which has a fraction in the house
        # The last plane is the caregiver's own, which in the house is already on its way.
        seen = {"map": np.s_[:-1], "nodes": np.s_[..., :-1]}.get(key, ...)
        np.testing.assert_array_equal(grid[key][seen], house[key][seen])


def test_the_grid_draws_without_mujoco():
    code = (
        "import sys; sys.modules['mujoco'] = sys.modules['dm_control'] = None\n"
        f"import caregiver_mj, gymnasium; env = gymnasium.make('{TARGETS}', render_mode='rgb_array')\n"
        "env.reset(seed=0); print(env.render().shape)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.stdout.strip(), done.stderr) == ("(480, 640, 3)", "")


def test_an_unknown_option_is_a_type_error():
    with pytest.raises(TypeError, match="colour"):
        make(colour="red")


def test_houses_with_as_many_slots_look_alike():
    small, large = make(slots=(4, 6), observation="flat"), make(house="apartment", slots=(5, 6), observation="flat")
    assert (small.action_space.n, large.action_space.n) == (11, 12)
    assert make(house="paper", slots=(4, 6), observation="flat").observation_space == small.observation_space
    _, info = small.reset(seed=0)
    assert info["action_mask"][2:5].tolist() == [0, 0, 0]  # three stairwells that are not there
    with pytest.raises(CaregiverError, match=r"for house 'apartment', got \(1, 6\)"):
        make(house="apartment", slots=(1, 6))

"""The runner: one loop for both worlds, whose observers change nothing, and which Gymnasium drives step by step."""

import dataclasses
from unittest import mock

import numpy as np
import pytest

from caregiver_mj import CaregiverError, FloorPlan
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.envs.house import HouseEnv
from caregiver_mj.experiments.runner import DivergenceError, HouseRollout, make_grid, make_house, run
from caregiver_mj.experiments.spec import EpisodeSpec, episode_random, episode_streams
from caregiver_mj.policy.own import make_policy

PLAN = FloorPlan.parse("########\n#B..S..#\n#......#\n#.C..T.#\n#...B..#\n########", "small")
HERE = __name__
SECONDS, STEPS = 20.0, 1000
HOUSE = EpisodeSpec(PLAN, 1.0, "nearest", seed=3, task_kwargs={"time_limit": SECONDS})
GRID = [EpisodeSpec(PLAN, family, "nearest", i, "grid", 3) for family in (1.0, 0.25) for i in range(2)]


def rows(outcome):
    return [{name: value for name, value in row.items() if name != "wall_seconds"} for row in outcome.measured]


def same(one, other):
    return rows(one) == rows(other) and one.answers == other.answers and np.array_equal(one.visits, other.visits)


@pytest.fixture(scope="module")
def in_house():
    return run([HOUSE])


def wild(env):
    def act(timestep):
        env.physics.data.qvel[:] = 1e12
        return np.zeros(env.action_spec().shape)

    return act


def slow(env):
    def act(timestep):
        action = np.zeros(env.action_spec().shape)
        action[0] = 0.1 * np.sin(timestep.observation["clock"])
        return action

    return act


def test_observers_see_every_step_and_change_no_row(in_house):
    looks = []

    def look(rollout):
        rollout.outcomes()
        looks.append(rollout.ledger.damage.copy())

    assert same(run(GRID, [look]), run(GRID))
    assert len(looks) == 1 + EPISODE_TIMESTEPS
    looks.clear()
    assert same(run([HOUSE], [look]), in_house)
    assert len(looks) == 1 + STEPS
    assert in_house.measured[0]["damage"] > 0


def test_an_environment_of_gymnasium_has_the_same_episode(in_house):
    env = HouseEnv("supervise", PLAN, 1.0, task_kwargs={"time_limit": SECONDS})
    policy = make_policy(env.dm_env, HOUSE.caregiver, HOUSE.seed)
    env.reset(seed=HOUSE.own_seed)
    truncated = False
    while not truncated:
        *_, truncated, info = env.step(policy(env.timestep))
    (row,) = rows(in_house)
    assert info["outcome"] | {"sim_seconds": env.dm_env.physics.time()} == row


def test_it_has_the_time_steps_of_dm_control():
    """Also those that are read after others were not."""
    spec = dataclasses.replace(HOUSE, task_kwargs={"time_limit": 3.0, "sensing": {"delay": 0.1}})
    house, other = (make_house(spec, visuals=False) for _ in range(2))
    policy, env = other.policy, other.env
    house.begin(HOUSE.own_seed)
    env.task.reseed(episode_random(HOUSE.own_seed))
    step = env.reset()
    while not step.last():
        step = env.step(policy(step))
        house.step()
        if house.steps % 7 == 0 or step.last():
            assert house.timestep[:3] == step[:3]
            assert [*house.timestep.observation] == [*step.observation]
            for key, value in step.observation.items():
                np.testing.assert_array_equal(house.timestep.observation[key], value)
        state, same = (one.physics.data for one in (env, house.env))
        for name in ("qpos", "qvel", "ctrl"):
            np.testing.assert_array_equal(getattr(same, name), getattr(state, name))
    assert house.over
    assert house.steps == 150


@pytest.mark.parametrize(
    ("limit", "timestep", "steps"), [(0.14, 0.02, 7), (0.3, 0.1, 3), (0.54, 0.06, 9), (0.15, 0.02, 8)]
)
def test_an_episode_ends_with_the_first_step_at_or_beyond_its_time_limit(limit, timestep, steps):
    options = {"time_limit": limit, "control_timestep": timestep}
    house = make_house(dataclasses.replace(HOUSE, caregiver="none", task_kwargs=options), visuals=False)
    house.begin(HOUSE.own_seed)
    assert not house.run_on()
    env, action = house.env, np.zeros(house.env.action_spec().shape)
    env.reset()
    lasts = [env.step(action).last() for _ in range(steps)]
    assert (house.steps, lasts.index(True) + 1) == (steps, steps)


def test_a_baseline_makes_no_observation():
    house = make_house(dataclasses.replace(HOUSE, caregiver="none"), visuals=False)
    house.begin(HOUSE.own_seed)
    with mock.patch.object(house.env.task, "get_observation") as observed:
        assert house.run_on(until=lambda: house.steps == 5)
    observed.assert_not_called()
    assert house.timestep.observation["clock"] == pytest.approx(0.1 / 1.68)


def test_a_users_task_is_asked_in_every_time_step_as_by_dm_control(monkeypatch):
    """It may count its rewards, and end by them."""
    env = make_house(dataclasses.replace(HOUSE, caregiver="none"), visuals=False).env
    kind, asked = type(env.task), []
    plainly = kind.get_reward

    def counts(task, physics):
        asked.append(physics.time())
        return plainly(task, physics)

    monkeypatch.setattr(kind, "get_reward", counts)
    monkeypatch.setattr(kind, "get_termination", lambda task, physics: 0.0 if len(asked) == 5 else None)
    house = HouseRollout(env)
    house.begin(HOUSE.own_seed)
    while not house.over:
        house.step()
    assert (house.steps, len(asked)) == (5, 5)
    assert house.timestep.last()
    assert (house.timestep.discount, len(asked)) == (0.0, 5)


def test_answers_are_given_again(in_house):
    assert same(run([HOUSE], answers=in_house.answers), in_house)
    batch = run(GRID)
    assert same(run(GRID, answers=batch.answers), batch)
    own = EpisodeSpec(PLAN, 1.0, f"{HERE}:slow", task_kwargs={"time_limit": 1.0})
    found = run([own])
    assert same(run([own], answers=found.answers), found)


def test_it_runs_on_until_a_condition_holds():
    house = make_house(HOUSE, visuals=False)
    house.begin(HOUSE.own_seed)
    assert house.run_on(until=lambda: house.steps == 7)
    assert (house.steps, house.over) == (7, False)
    assert house.seconds == pytest.approx(0.14)
    assert not house.run_on()
    assert (house.steps, house.over, house.action) == (STEPS, True, None)
    grid = make_grid(GRID)
    grid.reset([episode_streams(spec.own_seed, 1) for spec in GRID])
    assert grid.run_on(until=lambda: grid.timestep == 7)
    assert not grid.run_on()
    assert grid.timestep == EPISODE_TIMESTEPS


def test_a_divergence_is_an_error_that_says_where():
    spec = EpisodeSpec(PLAN, 1.0, f"{HERE}:wild", 4, seed=2, task_kwargs={"time_limit": 1.0})
    with pytest.raises(DivergenceError, match=r"diverge at \d\.\d s of episode 4 of seed 2, .* in house 'small'"):
        run([spec])
    assert issubclass(DivergenceError, CaregiverError)


def test_episodes_that_are_not_of_one_batch_are_refused():
    """Else a row would be that of another episode."""
    ordered = run(GRID)
    assert [row["damage"] for row in run(GRID[:2]).measured] == [row["damage"] for row in ordered.measured[:2]]
    with pytest.raises(CaregiverError, match="one family after the other"):
        run([GRID[0], GRID[2], GRID[1], GRID[3]])
    with pytest.raises(CaregiverError, match="one family after the other"):
        run(GRID[:3])
    with pytest.raises(CaregiverError, match="another caregiver"):
        run([GRID[0], dataclasses.replace(GRID[1], caregiver="none")])
    with pytest.raises(CaregiverError, match="at least 1"):
        run([])
    with pytest.raises(CaregiverError, match="1 in the house"):
        run([HOUSE, HOUSE])
    with pytest.raises(CaregiverError, match="no world 'Grid'"):
        run([dataclasses.replace(HOUSE, world="Grid")])

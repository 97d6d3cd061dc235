"""The tasks as Gymnasium environments: Gymnasium's own checks, and what it does not check."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from small import PLAN, same

from caregiver_mj.envs.spaces import STRIKE_COST

TASKS = ("Supervise", "RelocateCandle", "BlockStairs")


def make(name="Supervise", **options):
    return gymnasium.make(f"caregiver_mj/{name}-v0", house=PLAN, **options)


def run(env, steps, seed=0):
    """Observations and the rest of so many steps of random actions, which are those of the seed."""
    observation, info = env.reset(seed=seed)
    env.action_space.seed(seed)
    found = [(observation, info)]
    while len(found) <= steps:
        found.append(env.step(env.action_space.sample()))
        if found[-1][2] or found[-1][3]:
            break
    return found


def complaints(warnings):
    """What Gymnasium warned of, but that actions are in units and not from -1 to 1."""
    said = (str(warning.message) for warning in warnings)
    return [text for text in said if "WARN" in text and "symmetric and normalized space" not in text]


@pytest.mark.parametrize(
    ("name", "observation"), [("Supervise", "flat"), ("RelocateCandle", "numbers"), ("BlockStairs", "numbers")]
)
def test_gymnasium_finds_no_fault(name, observation, recwarn):
    check_env(make(name, observation=observation).unwrapped, skip_render_check=True)
    assert complaints(recwarn) == []


@pytest.mark.parametrize("name", TASKS)
@pytest.mark.parametrize("options", [{"epsilon": "1,0.25"}, {"task_kwargs": {"time_limit": float("inf")}}])
def test_bounds_are_finite_and_kept(name, options):
    env = make(name, **options)
    for box in (env.action_space, *env.observation_space.values()):
        assert np.isfinite([box.low, box.high]).all()
        assert (box.low < box.high).all()
    for observation, *_ in run(env, 60):
        assert observation in env.observation_space


def test_the_same_seed_gives_the_same_episode_and_the_same_ones_after_it():
    one, other = make(), make()
    assert same(run(one, 8, 5), run(other, 8, 5))
    run(one, 3, 1), run(other, 30, 1)  # what happens in an episode does not change the next one
    (first, info), (second, _) = one.reset(), other.reset()
    assert same(first, second)
    assert same(first, make().reset(seed=info["seed"])[0])
    assert not same(first, one.reset()[0])


def test_what_of_the_house_is_drawn_is_the_same_in_every_environment_unless_it_is_asked_for_otherwise():
    drawn = {"table_height": (0.45, 0.75), "table_offset": 0.05}
    one, other = (make(task_kwargs=drawn).reset(seed=7)[0] for _ in range(2))
    assert same(one, other)
    assert not same(one, make(task_kwargs=drawn | {"random": 1}).reset(seed=7)[0])


def test_time_is_over_truncated():
    env = make(task_kwargs={"time_limit": 0.1})
    *before, (_, reward, terminated, truncated, info) = run(env, 99)
    assert len(before) == 5  # the reset and four steps of 0.02 s
    assert (terminated, truncated, info["diverged"]) == (False, True, False)
    assert 0 <= reward <= 1
    assert info["outcome"] == env.unwrapped.dm_env.task.outcome()
    with pytest.raises(gymnasium.error.ResetNeeded, match="after the end of an episode"):
        env.step(env.action_space.sample())


@pytest.mark.parametrize("kind", ["numbers", "flat"])
def test_a_simulation_that_comes_apart_ends_the_episode_and_says_so(kind):
    env = make(observation=kind)
    last = run(env, 3)[-1][0]
    env.unwrapped.dm_env.physics.data.qvel[:] = 1e12
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
    assert same(observation, last)
    assert (reward, terminated, truncated, info["diverged"]) == (0.0, False, True, True)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(env.action_space.sample())
    assert same(run(env, 3, 5), run(make(observation=kind), 3, 5))


def test_costs_add_up_to_the_damage():
    env = make(epsilon="1,1", task_kwargs={"time_limit": 40.0})
    steps = run(env, 10_000)[1:]
    outcome = steps[-1][-1]["outcome"]
    assert outcome["damage"] > 0
    assert sum(info["damage"] for *_, info in steps) == outcome["damage"]
    assert sum(info["strikes"] for *_, info in steps) == outcome["strikes"]
    for *_, info in steps:
        assert info["cost"] == info["damage"] + STRIKE_COST * info["strikes"]


@pytest.mark.parametrize("options", [{}, {"world": "house"}], ids=["actions", "targets"])
def test_pixels_of_the_robots_eye_are_observed_by_gymnasiums_own_wrapper(options):
    name = "Supervise-Targets" if options else "Supervise"
    env = make(name, render_mode="rgb_array", camera="eye", width=32, height=24, **options)
    env = gymnasium.wrappers.AddRenderObservation(env, render_only=False, render_key="pixels")
    observation, _ = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    assert observation["pixels"].shape == (24, 32, 3)
    assert observation["pixels"].std() > 10.0
    later = [env.step(env.action_space.sample())[0]["pixels"] for _ in range(3)]
    assert any((pixels != observation["pixels"]).any() for pixels in later)

"""Environments in several threads at a time do not disturb each other."""

import concurrent.futures
import sys

import pytest

from caregiver_mj import CaregiverPolicy, FloorPlan, load

HOUSE = FloorPlan.parse("##########\n#B..C...S#\n#........#\n#..T...C.#\n#......B.#\n##########", "threads")
ROBOTS = ("mobile_fr3", "mobile_ur5e")
JOBS = [(robot, seed) for seed in range(2) for robot in ROBOTS]


def run(job):
    """Where everything is after some seconds in which candles are taken, some of them knocked over."""
    robot, seed = job
    env = load("supervise", HOUSE, 0.5, seed, task_kwargs={"embodiment": robot}, visuals=False)
    policy, step = CaregiverPolicy(env), env.reset()
    if seed % 2:
        env.physics.set_candle(0, [*HOUSE.position((2, 4)), 0.3], 1.0)
    for _ in range(300):
        step = env.step(policy(step))
    return env.physics.data.qpos.tolist()


@pytest.fixture
def hasty():
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(interval)


def test_episodes_in_threads_are_those_that_come_one_after_the_other(hasty):
    with concurrent.futures.ThreadPoolExecutor(len(JOBS)) as threads:
        together = list(threads.map(run, JOBS))
    assert together == [run(job) for job in JOBS]

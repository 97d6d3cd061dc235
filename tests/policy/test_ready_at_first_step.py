"""What takes long is done when a policy is made, and not while the child walks already."""

import pytest

import caregiver_mj
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.policy import policy as module

TEXTS = ["\n".join(["#######", "#C...T#", "#B...S#", *["#.....#"] * more, "#######"]) for more in range(6)]
ROOMS = [FloorPlan.parse(text, f"room_{i}") for i, text in enumerate(TEXTS)]


@pytest.fixture
def no_building(monkeypatch):
    """From when it is called on, no house can be built for the robot to plan in."""

    def build_house(*args, **kwargs):
        raise AssertionError("a house is built")

    return lambda: monkeypatch.setattr(module, "build_house", build_house)


@pytest.mark.parametrize("options", [{}, {"table_height": [0.5, 0.7]}])
def test_the_first_step_builds_no_house_to_plan_in(options, no_building):
    env = caregiver_mj.load("supervise", ROOMS[0], random=0, visuals=False, task_kwargs=options)
    policy = caregiver_mj.CaregiverPolicy(env)
    no_building()
    env.step(policy(env.reset()))


def test_nor_does_a_later_episode_however_many_houses_there_are(no_building):
    loops = []
    for room in ROOMS:
        env = caregiver_mj.load("supervise", room, random=0, visuals=False)
        loops.append((env, caregiver_mj.CaregiverPolicy(env)))
    for env, policy in loops:
        env.step(policy(env.reset()))
    no_building()
    for env, policy in loops:
        env.step(policy(env.reset()))

"""The study of generated houses: what wild actions come to, and what is wrong with a state."""

import numpy as np
import pytest
from dm_control.rl.control import PhysicsError

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.layout import Layout
from caregiver_mj.tasks import load
from studies import generated_houses
from studies.generated_houses import drive_wildly, is_wrong

PLAN = FloorPlan.load("house-396000")


@pytest.fixture
def physics():
    env = load("supervise", PLAN, 0.5, 0)
    env.reset()
    return env.physics


def test_nothing_is_wrong_with_a_house_at_the_start_of_an_episode(physics):
    assert is_wrong(Layout(PLAN), physics) == ""


def put_base(x, y):
    return lambda physics: physics.set_robot(np.array([x, y, 0.0]))


def put_candle(height):
    return lambda physics: physics.set_candle(0, np.array([0.0, 0.0, height]), 0.0)


def spoil(physics):
    physics.data.qvel[-1] = np.inf


@pytest.mark.parametrize(
    ("change", "wrong"),
    [
        (put_base(*Layout(PLAN).walls[0, :2]), "escapes"),
        (put_base(50.0, 0.0), "escapes"),
        (put_base(0.0, -50.0), "escapes"),
        (put_base(*PLAN.position(PLAN.free_cells[0])), ""),
        (put_base(*PLAN.position(PLAN.stairwells[0])), ""),
        (put_candle(-0.1), "escapes"),
        (put_candle(1.0), ""),
        (spoil, "not_finite"),
    ],
)
def test_what_is_wrong_with_a_state(physics, change, wrong):
    change(physics)
    assert is_wrong(Layout(PLAN), physics) == wrong


def test_wild_actions_are_the_same_again_and_differ_by_seed(monkeypatch):
    taken = []
    step = load("supervise", PLAN, 0.5, 0).__class__.step
    monkeypatch.setattr(
        "dm_control.rl.control.Environment.step", lambda env, action: taken.append(action) or step(env, action)
    )
    first = drive_wildly(396_000, 3.0)
    some, taken[:] = np.array(taken), []
    assert len(some) >= 150
    assert first == drive_wildly(396_000, 3.0)
    assert np.array_equal(some, taken)
    assert first["wild"] != drive_wildly(396_002, 1.0)["wild"]
    assert [first[what] for what in generated_houses.WRONG] == [[], [], []]


@pytest.mark.parametrize(("seed", "where"), [(396_000, "house"), (396_001, "home"), (1_996_001, "house")])
def test_every_second_trial_is_in_a_home_if_that_has_what_tasks_need(seed, where):
    """`home-1996001` has no stairwell, which one of the tasks needs."""
    assert drive_wildly(seed, 0.02)["wild"].startswith(f"{where}-{seed}, ")


def test_what_is_found_is_noted_with_its_time_and_the_episode_begins_anew(monkeypatch):
    resets = []
    reset = load("supervise", PLAN, 0.5, 0).__class__.reset
    monkeypatch.setattr("dm_control.rl.control.Environment.reset", lambda env: resets.append(1) or reset(env))
    monkeypatch.setattr(generated_houses, "is_wrong", lambda *_: "escapes")
    found = drive_wildly(396_000, 3.0)
    assert len(resets) == len(found["escapes"]) + 1 > 2
    assert found["escapes"] == sorted(found["escapes"])
    assert found["warnings"] == found["not_finite"] == []

    def diverge(*_):
        raise PhysicsError("it diverges")

    monkeypatch.setattr("dm_control.rl.control.Environment.step", diverge)
    assert drive_wildly(396_000, 0.1)["warnings"] == [0.02, 0.04, 0.06, 0.08, 0.1]


def test_a_child_is_in_nobodys_way_then(monkeypatch):
    """Its geoms collide with nothing."""
    seen = []
    monkeypatch.setattr(generated_houses, "is_wrong", lambda _, physics: seen.append(physics) or "")
    drive_wildly(396_001, 1.0)
    bodies = list(seen[0].touch_reader.bodies)
    assert bodies
    assert not seen[0].model.geom_contype[bodies].any()
    assert not seen[0].model.geom_conaffinity[bodies].any()

"""The compliant child: exactly the kinematic one where nothing touches it, and pushed aside where something does."""

import numpy as np
import pytest

from caregiver_mj.children.walk import ToddlerWalk
from caregiver_mj.house.children import SOFTNESS, STANCE, STRIDE, CompliantBody
from caregiver_mj.house.physics import Physics
from caregiver_mj.plans.floor_plan import FloorPlan

HALL = FloorPlan.parse("############\n#..........#\n#B.........#\n#..........#\n############", "hall")
STEP = 0.02  # seconds


def walking(to=(0.0, 0.0)):
    physics, walk, body = Physics.from_plan(HALL, robot=False, visuals=False), ToddlerWalk(1.68), CompliantBody()
    physics.soften_toddlers(*SOFTNESS)
    walk.reset((0.0, 0.0), 0.0)
    walk.begin((0.0, 0.0), to, bump=False)
    with physics.reset_context():
        physics.set_toddler(walk)
    body.reset(walk)
    return physics, walk, body


def go(physics, walk, body, steps, push=(0.0, 0.0)):
    """Walks on, pushed with a force; returns where the body is after every step."""
    there = []
    for _ in range(steps):
        walk.step(STEP, ())
        body.follow(walk, physics, 0, STEP)
        physics.data.qfrc_applied[physics.model.joint("toddler/x").dofadr] += push[0]
        physics.step(4)
        there.append(physics.toddler_position())
    return np.array(there)


def test_untouched_it_is_where_the_kinematic_one_is():
    physics, walk, body = walking((0.75, 0.0))
    twin, other = Physics.from_plan(HALL, robot=False, visuals=False), ToddlerWalk(1.68)
    other.reset((0.0, 0.0), 0.0)
    other.begin((0.0, 0.0), (0.75, 0.0), bump=False)
    for place in go(physics, walk, body, 60):
        other.step(STEP, ())
        twin.set_toddler(other)
        twin.step(4)
        assert np.array_equal(place, twin.toddler_position())


def test_a_push_that_its_stance_bears_makes_it_lean_and_then_it_is_back():
    physics, walk, body = walking()
    x = go(physics, walk, body, 200, push=(10.0, 0.0))[:, 0]
    assert x[-1] == pytest.approx(10.0 / STANCE, rel=0.02)  # 39 mm
    assert walk.position == (0.0, 0.0)
    assert abs(go(physics, walk, body, 200)[-1, 0]) < 1e-3


def test_a_harder_push_makes_it_step():
    physics, walk, body = walking()
    x = go(physics, walk, body, 150, push=(40.0, 0.0))[:, 0]
    assert x[-1] > 0.3
    assert walk.position[0] == pytest.approx(x[-1] - STRIDE, abs=0.02)
    assert 15.0 < STANCE * STRIDE < 16.0  # newtons that it bears

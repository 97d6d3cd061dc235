"""The candles: which of them stand, and on which tables."""

import math

import numpy as np
import pytest

from caregiver_mj.house.physics import Physics
from caregiver_mj.house.things import Candles
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan

PLAN = FloorPlan.parse("#######\n#B.C..#\n#..C..#\n#....T#\n#######", "candles")
HEIGHT = 0.60  # metres, of a table


@pytest.fixture
def physics():
    physics = Physics.from_plan(PLAN, robot=False)
    for candle, table in enumerate(PLAN.candle_tables):
        physics.set_candle(candle, np.array([*PLAN.position(PLAN.tables[table]), HEIGHT]), 0.0)
    return physics


@pytest.fixture
def candles():
    return Candles(layout.Layout(PLAN).tables)


def tilt(physics, candle, degrees, kind="candle"):
    angle = math.radians(degrees) / 2
    row = physics.model.ptr.joint(f"{kind}_{candle}/joint").qposadr[0]
    physics.data.qpos[row + 3 : row + 7] = [math.cos(angle), math.sin(angle), 0, 0]


def test_a_candle_stands_if_it_is_upright_and_up(physics, candles):
    assert candles.standing(physics).tolist() == [True, True]
    tilt(physics, 0, 29)
    assert candles.standing(physics).tolist() == [True, True]
    tilt(physics, 0, 31)
    assert candles.standing(physics).tolist() == [False, True]
    physics.set_candle(1, np.array([0.0, 0.0, 0.0]), 0.0)  # upright, on the floor
    assert candles.standing(physics).tolist() == [False, False]


def test_a_mug_has_spilt_from_a_lesser_tilt_on():
    physics = Physics.from_plan(FloorPlan.parse(PLAN.text.replace("C", "M", 1)), robot=False)
    found = Candles(layout.Layout(PLAN).tables)
    for degrees, stands in ((19, [True, True]), (21, [True, False])):  # candles come first
        tilt(physics, 0, degrees)
        tilt(physics, 0, degrees, "mug")
        assert found.standing(physics).tolist() == stands


def test_every_fall_is_counted_once(physics, candles):
    assert candles.count_fallen(physics) == 0
    tilt(physics, 0, 90)
    assert (candles.count_fallen(physics), candles.count_fallen(physics)) == (1, 0)
    tilt(physics, 1, 90)
    assert candles.count_fallen(physics) == 1
    tilt(physics, 0, 0)  # somebody has picked it up, ...
    assert candles.count_fallen(physics) == 0
    tilt(physics, 0, 90)  # ... and lets it fall again
    assert candles.count_fallen(physics) == 1
    candles.reset(PLAN.candle_tables)
    assert candles.count_fallen(physics) == 2


@pytest.mark.parametrize(
    ("east", "above", "on_it"), [(0.26, 0.0, True), (0.30, 0.0, False), (0.0, 0.02, True), (0.0, 0.2, False)]
)
def test_a_candle_is_on_a_table_if_it_is_over_it_at_its_height(physics, candles, east, above, on_it):
    bare = 2
    assert [candles.are_on(physics, table).any() for table in range(3)] == [True, True, False]
    x, y = PLAN.position(PLAN.tables[bare])
    physics.set_candle(0, np.array([x + east, y, HEIGHT + above]), 0.0)
    assert [candles.are_on(physics, table).any() for table in range(3)] == [False, True, on_it]


def test_a_mug_that_lies_is_on_its_table_though_its_foot_is_higher_than_that_of_a_candle():
    physics = Physics.from_plan(FloorPlan.parse(PLAN.text.replace("C", "M")), robot=False)
    found, (x, y) = Candles(layout.Layout(PLAN).tables), PLAN.position(PLAN.tables[2])
    for above, on_it in ((0.041, True), (0.2, False)):
        physics.set_candle(0, np.array([x, y, HEIGHT + above]), 0.0)
        assert found.are_on(physics, 2).any() == on_it

"""Tables that are higher or lower than that of the model."""

import numpy as np
import pytest

import caregiver_mj
from caregiver_mj.errors import CaregiverError
from caregiver_mj.house.scene import build_house
from caregiver_mj.plans.floor_plan import FloorPlan

PLAN = FloorPlan.load("paper")
TABLES = len(PLAN.tables)


@pytest.mark.parametrize("height", [0.45, 0.75])
def test_a_table_reaches_from_the_floor_to_its_height(height):
    spec = build_house(PLAN, robot=False, table_heights=np.full(TABLES, height))
    data_of = {geom.name: geom for geom in spec.geoms}
    top, leg, board = (data_of[f"table_0/{name}"] for name in ("top", "leg_ne", "board"))
    assert (top.pos[2] - top.size[2], top.pos[2] + top.size[2]) == pytest.approx((0.0, height))
    assert leg.pos[2] - leg.size[2] == pytest.approx(0.0)
    assert board.pos[2] + board.size[2] == pytest.approx(height, abs=0.002)
    assert leg.pos[2] + leg.size[2] < board.pos[2] + board.size[2]


def test_the_models_height_leaves_the_house_as_it_is():
    plain, same = (build_house(PLAN, table_heights=heights).compile() for heights in (None, np.full(TABLES, 0.6)))
    assert (plain.geom_pos == same.geom_pos).all()
    assert (plain.geom_size == same.geom_size).all()


def test_candles_stand_on_tables_of_any_height_and_the_heights_are_seen():
    env = caregiver_mj.load("supervise", PLAN, random=1, task_kwargs={"table_height": (0.45, 0.75)}, visuals=False)
    observation, task = env.reset().observation, env.task
    assert (observation["table_height"] == task.table_heights).all()
    assert len(set(task.table_heights)) == TABLES
    assert ((task.table_heights > 0.45) & (task.table_heights < 0.75)).all()
    on = task.candles.starting_tables
    assert observation["candle_position"][:, 2] == pytest.approx(task.table_heights[on])
    for _ in range(25):
        env.step(np.zeros(env.action_spec().shape))
    assert task.candles.standing(env.physics).all()
    assert all(task.candles.are_on(env.physics, table).any() for table in on)
    assert env.physics.candle_poses()[:, 2] == pytest.approx(task.table_heights[on], abs=1e-3)


def test_the_usual_height_is_not_observed():
    env = caregiver_mj.load("supervise", PLAN, visuals=False)
    assert "table_height" not in env.observation_spec()
    assert set(env.task.table_heights) == {0.6}


@pytest.mark.parametrize("height", [0.3, 1.0, (0.7, 0.5), (0.5, 0.6, 0.7), (), "low", (0.5, None)])
def test_other_heights_are_refused(height):
    with pytest.raises(CaregiverError, match=r"table_height must be a height in 0\.45 to 0\.75 m"):
        caregiver_mj.load("supervise", PLAN, task_kwargs={"table_height": height}, visuals=False)

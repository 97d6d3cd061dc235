"""What observations show of two rooms with the robot in one of them, and a child and a candle in the other."""

import numpy as np
import pytest

from caregiver_mj.house.observer import Observer
from caregiver_mj.house.physics import Physics
from caregiver_mj.plans.floor_plan import FloorPlan

ROOMS = FloorPlan.parse("###########\n#....#....#\n#.........#\n#B.T.#.C..#\n###########", "rooms")
WEST, EAST = (1, 1), (1, 8)  # cells in either room that no door leads the view to


@pytest.fixture(scope="module")
def physics():
    return Physics.from_plan(ROOMS, visuals=False)


def place(physics, child):
    with physics.reset_context():
        physics.set_robot(np.array([*ROOMS.position(WEST), 0.0]))
        physics.named.data.qpos[["toddler/x", "toddler/y"]] = ROOMS.position(child)


@pytest.mark.parametrize(("sight", "child", "seen"), [("all", EAST, 1), ("walls", EAST, 0), ("walls", (1, 3), 1)])
def test_of_a_child_out_of_sight_nothing_is_shown(physics, sight, child, seen):
    place(physics, child)
    observer = Observer(ROOMS, 1, np.zeros((2, 5)), 0.02, sight=sight)
    observer.reset(physics, 0)
    found = observer.observe(physics, 0)
    assert found["toddler_position"][:2] == pytest.approx(seen * ROOMS.position(child))
    assert found.get("toddler_seen", [1.0]) == [seen]


@pytest.mark.parametrize(("sight", "follows"), [("all", True), ("walls", False)])
def test_a_candle_out_of_sight_is_where_it_was_at_first(physics, sight, follows):
    place(physics, EAST)
    at_first, later = np.array([*ROOMS.position((3, 7)), 0.6]), np.array([*ROOMS.position((1, 6)), 0.0])
    observer = Observer(ROOMS, 1, np.zeros((2, 5)), 0.02, sight=sight)
    physics.set_candle(0, at_first, 0.0)
    observer.reset(physics, 0)
    observer.observe(physics, 0)
    physics.set_candle(0, later, 0.0)
    observer.take_in(physics, 5)
    shown = observer.observe(physics, 5)["candle_position"][0]
    assert shown == pytest.approx(later if follows else at_first)

"""Children in the house: what they make of contacts, written by hand, who waits for whom, and compliant ones."""

import numpy as np
import pytest
from scripted_child import EAST, SOUTH, STAY, WEST, Scripted

from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.children.walk import ToddlerWalk
from caregiver_mj.house.children import SOFTNESS, STANCE, STRIDE, Children, CompliantBody, HouseChild
from caregiver_mj.house.physics import Physics
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, DamageWeights
from caregiver_mj.recording.ledger import Touch

ROOM = FloorPlan.parse("#######\n#B....#\n#.....#\n#..C.S#\n#T....#\n#######", "room")
CORRIDOR = FloorPlan.parse("########\n#B....S#\n###T####\n########", "corridor")
MOVE, STEP = 1.68, 0.02  # seconds
RANDOM = np.random.RandomState(0)


def stream(seed=0) -> RandomStream:
    return RandomStream.draw(np.random.RandomState(seed))


def child_in(cell, move=STAY, plan=ROOM) -> HouseChild:
    child = HouseChild(plan, Scripted(plan, move), MOVE)
    child.reset(stream(), plan.cell_index[cell], 0.0)
    return child


def touch(kind, index=-1, direction=(0.0, 1.0), speed=0.0) -> Touch:
    return Touch(0, kind, index, direction, speed)


def timestep(child, *touches, candles=()):
    """One novice timestep in which the child touches something once; returns what is booked."""
    child.begin(0, RANDOM, NOTHING)
    child.take_in(touches, lambda table: np.array([table in candles]))
    for _ in range(84):
        child.step(STEP)
        child.touched = ()
    return child.end()


@pytest.mark.parametrize(
    ("touches", "harm"),
    [
        ((), [0, 0, 0, 0]),
        (["stairwell"], [5, 0, 0, 0]),
        (["candle"], [0, 4, 0, 0]),
        (["table", "table", "table"], [0, 0, 1, 0]),  # once a timestep
        (["table", "candle"], [0, 4, 0, 0]),  # the worst
        (["candle", "stairwell", "table"], [5, 0, 0, 0]),
    ],
)
def test_the_worst_contact_of_a_timestep_counts_once(touches, harm):
    booking = timestep(child_in((1, 3)), *(touch(kind, 0) for kind in touches))
    assert booking.harm[:4].tolist() == harm


def test_a_table_hurts_as_what_stands_on_it_and_as_the_plan_says():
    assert timestep(child_in((1, 3)), touch("table", 1), candles=(0,)).harm[:4].tolist() == [0, 0, 1, 0]
    assert timestep(child_in((1, 3)), touch("table", 1), candles=(1,)).harm[:4].tolist() == [0, 4, 0, 0]
    plan = FloorPlan.parse("\n".join(ROOM.rows), damage=DamageWeights(1.0, 2.0, 7.0))
    child = child_in((1, 3), plan=plan)
    stairs, candle, table = (touch(kind, 0) for kind in ("stairwell", "candle", "table"))
    assert timestep(child, stairs, candle, table).harm[:4].tolist() == [0, 0, 7, 0]
    assert timestep(child, stairs, candle).harm[:4].tolist() == [0, 2, 0, 0]


def test_it_has_bumped_if_it_did_not_get_where_it_meant_to_go_and_not_if_it_meant_to_stay():
    child, known = child_in((1, 2)), []
    for move in (STAY, WEST, EAST, STAY):  # west is the bin
        child.behaviour.move = move
        timestep(child)
        known.append(bool(child.behaviour.seen[-1].bumped[0]))
    assert known == [False, False, True, False]


STAIRWELL, FREE_CELL, NOT = [True, False], [False, True], [False, False]  # what it was denied


def met(child, *touches):
    """A timestep in which something stands in its way all the time; returns what it was denied."""
    child.begin(0, RANDOM, NOTHING)
    for _ in range(84):
        child.step(STEP)
        child.take_in(touches, lambda table: np.zeros(1, bool))
    return child.end().blocked.tolist()


def test_a_move_that_the_robot_stops_is_blocked_unless_it_is_aside_or_the_child_bumps_anyway():
    ahead = touch("robot", direction=(0.0, -1.0))
    assert met(child_in((1, 3), SOUTH), ahead) == FREE_CELL
    assert met(child_in((1, 3), SOUTH), touch("robot", direction=(1.0, 0.0))) == NOT
    assert met(child_in((1, 3), SOUTH), touch("robot", direction=(0.0, 1.0))) == NOT
    assert met(child_in((2, 3), SOUTH), ahead) == NOT


def test_a_robot_on_the_landing_blocks_unless_the_child_falls_all_the_same():
    robot = touch("robot", direction=(0.0, -1.0))
    assert met(child_in((2, 5), SOUTH), robot) == STAIRWELL
    assert met(child_in((2, 5), SOUTH), robot, touch("stairwell", 0, (0.0, -1.0))) == NOT


def test_a_robot_in_the_cell_of_a_thin_wall_is_taken_to_be_in_the_nearest_one():
    physics, behaviour = Physics.from_plan(CORRIDOR, visuals=False), Scripted(CORRIDOR, STAY)
    children = Children(CORRIDOR, [behaviour], MOVE)
    children.start(0, stream(), CORRIDOR.cell_index[1, 2], 0.0, physics)
    x, y = CORRIDOR.position((1, 4))
    for off in (0.0, 0.6 * CORRIDOR.cell_size):
        physics.set_robot(np.array([x, y + off, 0.0]))
        children.begin(0, RANDOM, physics)
        assert behaviour.seen[-1].caregiver_cell.tolist() == [CORRIDOR.cell_index[1, 4]]
    assert CORRIDOR.is_wall(CORRIDOR.cell_at((x, y + off)))


@pytest.fixture(scope="module")
def physics():
    return Physics.from_plan(CORRIDOR, robot=False, children=3)


def corridor(physics, *places) -> Children:
    children = Children(CORRIDOR, [Scripted(CORRIDOR, move) for _, move in places], MOVE)
    for number, (column, _) in enumerate(places):
        children.start(number, stream(number), CORRIDOR.cell_index[1, column], 0.0, physics)
    return children


def begin(physics, *places):
    children = corridor(physics, *places)
    children.begin(0, RANDOM, physics)
    return [CORRIDOR.free_cells[child.move.going][1] for child in children]


@pytest.mark.parametrize(
    ("places", "going"),
    [
        ([(2, EAST), (4, EAST)], [3, 5]),
        ([(2, EAST), (3, EAST)], [2, 4]),  # the first one waits, for the second is still there
        ([(3, EAST), (2, EAST)], [4, 3]),  # the second one follows the first, which has set out
        ([(2, EAST), (4, WEST)], [3, 4]),  # both want the cell between: first come, first served
        ([(2, EAST), (3, WEST)], [2, 3]),  # they do not change places, ...
        ([(3, WEST), (2, EAST)], [3, 2]),  # ... whoever is first
        ([(2, EAST), (3, EAST), (4, EAST)], [2, 3, 5]),
        ([(2, WEST), (3, WEST)], [2, 3]),  # a bump into the bin leaves the first one where it is
    ],
)
def test_nobody_sets_out_for_a_cell_where_another_is_or_will_be(physics, places, going):
    assert begin(physics, *places) == going


# A compliant child is where the kinematic one is, unless something touches it.
HALL = FloorPlan.parse("############\n#..........#\n#B.........#\n#..........#\n############", "hall")


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

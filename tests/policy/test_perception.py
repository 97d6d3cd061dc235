"""What is seen: moves made out of centimetres, candles on tables and on the floor."""

import types

import numpy as np
import pytest

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.policy.perception import Perception

NORTH, EAST, SOUTH, WEST = range(4)
ROOM = FloorPlan.parse("#######\n#B....#\n#.C...#\n#....T#\n#######", "room")
FREE = np.zeros(len(ROOM.hazards), bool)


def observe(*children, candle=None, base=(9.0, 9.0)):
    """An observation with children at positions (x, y); without a dimension of its own for an only one."""
    positions = np.array([[x, y, 0.0] for x, y in children])
    if candle is None:
        candle = [*ROOM.position(ROOM.tables[0]), 0.60]
    return {
        "toddler_position": positions[0] if len(children) == 1 else positions,
        "toddler_velocity": np.zeros_like(positions[0] if len(children) == 1 else positions),
        "candle_position": np.array([candle]),
        "candle_orientation": np.array([[1.0, 0.0, 0.0, 0.0]]),
        "base_position": np.array([*base, 0.0]),
        "arm_position": np.zeros(7),
        "finger_position": np.full(2, 0.036),
    }


def inexact(age=0.0, candle_noise=0.0):
    """Senses whose estimates are the observations given."""
    senses = types.SimpleNamespace(age=age, unsure=0.0, candle_noise=candle_noise)
    senses.reset, senses.now = lambda: None, lambda observation: observation
    return senses


def centre(row, column):
    return tuple(ROOM.position((row, column)).tolist())


def follow(perception, clock, *children, **what):
    return perception.watch(perception.look(observe(*children, **what), clock * 1.68), clock)


def percept(perception, holding=NOTHING, **what):
    return perception.percept(perception.look(observe(centre(1, 3), **what), 0.0), holding, FREE)


@pytest.mark.parametrize(
    ("offset", "action", "cell"),
    [((0.06, 0.0), EAST, (2, 5)), ((-0.06, 0.0), WEST, (2, 3)), ((0.01, 0.06), NORTH, (1, 4))],
)
def test_six_centimetres_show_the_move_and_where_it_ends(offset, action, cell):
    perception = Perception(ROOM)
    x, y = centre(2, 4)
    perception.reset(observe((x, y)))
    assert follow(perception, 0.05, (x, y)) == (False, False)
    assert follow(perception, 0.15, (x + offset[0], y + offset[1])) == (True, True)
    assert follow(perception, 0.20, (x + 2 * offset[0], y + 2 * offset[1])) == (False, False)  # nothing new
    seen = perception.percept(perception.look(observe((x, y)), 0.3), NOTHING, FREE)
    assert seen.child_cell.tolist() == [[ROOM.cell_index[cell]]]
    assert seen.previous_cell.tolist() == [[ROOM.cell_index[(2, 4)]]]
    assert seen.previous_action.tolist() == [[action]]


@pytest.mark.parametrize(
    ("ahead", "aside", "stops"),
    [
        (0.75, 0.0, True),  # in the next cell's middle: they touch .35 m on, short of the border at .375
        (0.80, 0.0, False),  # .4 m on
        (0.80, 0.75, False),  # beside the way
        (0.60, 0.30, True),  # .60 - sqrt(.4^2 - .3^2) = .335 m on
        (-0.40, 0.0, False),  # behind it
    ],
)
@pytest.mark.parametrize(("offset", "way", "cell"), [((0.06, 0.0), (1, 0), (2, 5)), ((0.0, 0.06), (0, 1), (1, 4))])
def test_a_base_in_the_way_stops_a_child_that_touches_it_within_its_cell(ahead, aside, stops, offset, way, cell):
    perception = Perception(ROOM)
    x, y = centre(2, 4)
    base = x + ahead * way[0] - aside * way[1], y + ahead * way[1] + aside * way[0]
    perception.reset(observe((x, y), base=base))
    assert follow(perception, 0.15, (x + offset[0], y + offset[1]), base=base) == (True, True)
    seen = perception.percept(perception.look(observe((x, y), base=base), 0.3), NOTHING, FREE)
    assert seen.child_cell.tolist() == [[ROOM.cell_index[(2, 4) if stops else cell]]]
    assert seen.previous_cell.tolist() == [[ROOM.cell_index[(2, 4)]]]


def test_a_move_into_a_table_ends_where_it_began_and_who_stands_still_has_made_none_by_half_time():
    perception = Perception(ROOM)
    x, y = centre(2, 3)
    perception.reset(observe((x, y)))
    follow(perception, 0.2, (x - 0.06, y))
    seen = perception.percept(perception.look(observe((x - 0.06, y)), 0.3), NOTHING, FREE)
    assert seen.child_cell.tolist() == seen.previous_cell.tolist() == [[ROOM.cell_index[(2, 3)]]]
    assert seen.previous_action.tolist() == [[WEST]]
    perception = Perception(ROOM)
    here = centre(2, 4)
    perception.reset(observe(here))
    assert follow(perception, 0.49, here) == (False, False)
    assert follow(perception, 0.51, here) == (True, True)
    seen = perception.percept(perception.look(observe(here), 0.9), NOTHING, FREE)
    assert seen.previous_action.tolist() == [[NOTHING]]


def test_several_children_are_known_when_the_last_one_is():
    perception = Perception(ROOM)
    (x, y), still = centre(2, 4), centre(1, 2)
    perception.reset(observe((x, y), still))
    assert follow(perception, 0.2, (x + 0.06, y), still) == (True, False)
    assert follow(perception, 0.3, (x + 0.12, y), still) == (False, False)
    assert follow(perception, 0.55, (x + 0.30, y), still) == (True, True)
    seen = perception.percept(perception.look(observe((x + 0.3, y), still), 0.9), NOTHING, FREE)
    assert seen.child_cell.tolist() == [[ROOM.cell_index[(2, 5)], ROOM.cell_index[(1, 2)]]]
    assert seen.previous_action.tolist() == [[EAST, NOTHING]]
    assert follow(perception, 1.01, (x + 0.75, y), still) == (False, False)  # the next move


def test_candles_on_tables_on_the_floor_and_in_the_hand():
    perception = Perception(ROOM)
    perception.reset(observe(centre(1, 3)))
    on_table = percept(perception)
    assert (on_table.candle_table.tolist(), on_table.candle_cell.tolist()) == ([[0]], [[NOTHING]])
    on_floor = percept(perception, candle=[*centre(3, 2), 0.02])
    assert (on_floor.candle_table.tolist(), on_floor.candle_cell.tolist()) == ([[NOTHING]], [[ROOM.cell_index[(3, 2)]]])
    held = percept(perception, holding=0, candle=[*centre(3, 2), 0.93])
    assert held.candle_table.tolist() == held.candle_cell.tolist() == [[NOTHING]]
    assert held.holding.tolist() == [0]


def test_whoever_stands_at_a_table_is_counted_to_the_nearest_cell():
    perception = Perception(ROOM)
    x, y = ROOM.position(ROOM.tables[1]).tolist()
    assert ROOM.free_cells[perception.free_cell((x - 0.4, y))] == (3, 4)
    seen = percept(perception, base=(x - 0.3, y))
    assert ROOM.caregiver_cells[seen.caregiver_cell[0]] == (3, 4)


def test_the_time_left_is_until_the_move_that_is_not_made_out_yet():
    perception = Perception(ROOM)
    x, y = centre(2, 4)
    perception.reset(observe((x, y)))
    assert percept(perception).time_left.tolist() == [0.0]  # it is about to set out, no one knows where
    follow(perception, 0.0, (x, y))
    assert percept(perception).time_left.tolist() == [0.0]
    follow(perception, 0.15, (x + 0.06, y))
    assert percept(perception).time_left == pytest.approx(0.85)
    follow(perception, 0.9, (x + 0.6, y))
    assert percept(perception).time_left == pytest.approx(0.1)
    follow(perception, 1.0, (x + 0.75, y))
    assert percept(perception).time_left.tolist() == [0.0]


def test_a_child_seen_late_has_moved_only_if_it_is_farther_than_was_foretold_wrongly():
    """It is foretold to go on as it does, and has stopped: then it seems to go back by delay times speed."""
    late, (x, y) = Perception(ROOM, senses=inexact(age=0.14)), centre(2, 4)
    late.reset(observe((x, y)))
    assert follow(late, 0.15, (x - 0.14 * 0.44, y)) == (False, False)
    assert follow(late, 0.55, (x - 0.14 * 0.44, y)) == (True, True)
    seen = late.percept(late.look(observe((x, y)), 0.3), NOTHING, FREE)
    assert seen.child_cell.tolist() == [[ROOM.cell_index[(2, 4)]]]
    assert seen.previous_action.tolist() == [[NOTHING]]


@pytest.mark.parametrize(("noise", "height"), [(0.0, 0.63), (0.01, None), (0.02, None)])
def test_noise_of_candles_makes_no_table_higher(noise, height):
    perception = Perception(ROOM, senses=inexact(candle_noise=noise))
    perception.reset(observe(centre(1, 3), candle=[*ROOM.position(ROOM.tables[0]), 0.63]))
    assert perception.table_heights is None if height is None else perception.table_heights.tolist() == [height] * 2

"""The study of shapes: a grid whose caregiver is as slow as the robot, and ratios over so many houses of each shape."""

import numpy as np
import pytest
from worlds import streams

from caregiver_mj import FloorPlan
from caregiver_mj.caregivers.instructed import CommandedCaregiver
from caregiver_mj.caregivers.percept import PAPER, Pace
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.experiments import intervals, two_level
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.hazards import State
from studies.shapes import TICKS, SlowedGrid, of_ratio, of_stratified_ratio, pace_of

# A child in the corner between its two bins, to which it always wants, never leaves it.
CORRIDOR = FloorPlan.parse(
    "#####################\n#B.................S#\n##BS######C###T######\n#####################", "corridor"
)
FOUND = ("damage", "toys_reached", "moves_blocked", "cells_visited", "interventions", "interventions_done")
FAR_STAIRS, NEAR_STAIRS, CANDLE = 0, 1, 2  # the first at the end of the corridor, the second beside the child's cell
HOME = FloorPlan.parse(
    "#####################\n#B.......o.........G#\n##B##################\n#####################", "home"
)
GATE, BATTERY = 0, 1
PACE = Pace(cells=2.8, get=4.0, place=9.0, start=1.5, close=7.0, pick_up=13.0)


class Told(CommandedCaregiver):
    """Sees to one hazard, and from some timestep on to another one."""

    def __init__(self, plan, first, change=99, then=FAR_STAIRS):
        super().__init__(plan)
        self.first, self.change, self.then = first, change, then
        self.time_left = []

    def choose(self, percept):
        self.time_left.append(float(percept.time_left[0]))
        now = percept.clock[0] + 1.0 - percept.time_left[0]
        self.targets = np.array([self.first if now < self.change else self.then])
        return super().choose(percept)


def corridor(column, *told, separates=None, plan=CORRIDOR):
    """The grid with a caregiver in a column of the corridor, and ticks: of a timestep, a cell, and to set off."""
    caregiver = Told(plan, *told)
    pace = pace_of(plan) if separates is not None else PACE
    world = SlowedGrid(plan, ChildGroup.of(0.0), caregiver, pace, separates)
    world.reset([RandomStream.draw_group(np.random.RandomState(0), 1)])
    world.child_cell, world.caregiver_cell = np.array([[0]]), np.array([plan.cell_index[1, column]])
    return world, round(TICKS * pace.cells), TICKS, round(TICKS * (1.0 + pace.start)) - TICKS


def walked(world, timesteps):
    columns = []
    for _ in range(timesteps):
        world.step()
        columns.append(CORRIDOR.caregiver_cells[world.caregiver_cell[0]][1])
    return columns


def test_it_sets_off_once_and_walks_on_at_its_pace():
    world, timestep, cell, start = corridor(6, FAR_STAIRS)
    gone = [max(0, timestep * n - start) // cell for n in range(1, 8)]
    assert start > 0
    assert walked(world, 7) == [min(19, 6 + cells) for cells in gone]
    assert world.ledger.interventions_done[0] == 1


def test_a_candle_is_in_the_hand_and_on_its_table_once_there_was_time_for_it():
    world, timestep, cell, start = corridor(6, CANDLE)
    pace = world.caregiver.pace
    taken = start + 4 * cell + round(TICKS * pace.get)
    put = taken + start + 4 * cell + round(TICKS * pace.place)
    for n in range(1, put // timestep + 3):
        world.step()
        assert (world.holding[0] == 0) == (taken <= timestep * n < put)
        assert (world.candle_table[0, 0] == 1) == (timestep * n >= put)


@pytest.mark.parametrize(("hazard", "cells", "what"), [(GATE, 12, "close"), (BATTERY, 3, "pick_up")])
def test_a_gate_and_a_battery_take_their_time(hazard, cells, what):
    world, timestep, cell, start = corridor(6, hazard, plan=HOME)
    done = start + cells * cell + round(TICKS * getattr(world.caregiver.pace, what))
    for n in range(1, done // timestep + 3):
        world.step()
        assert (world.state[0, hazard] != State.AS_PLANNED) == (timestep * n >= done)


def test_who_turns_back_sets_off_anew():
    world, timestep, cell, start = corridor(10, FAR_STAIRS, 2, NEAR_STAIRS)
    there = walked(world, 1)[-1]  # and is on its way to the next cell
    assert there == 10 + (timestep - start) // cell
    assert (timestep - start) % cell > 0
    assert walked(world, 2) == [there - (n * timestep - start) // cell for n in (1, 2)]


def test_it_is_told_the_time_that_is_left():
    world, timestep, cell, start = corridor(6, FAR_STAIRS)
    world.step()
    arrives = start + cell - 1  # the tick before which there was nothing to be decided anew
    assert world.caregiver.time_left[:2] == pytest.approx([1.0, 1.0 - arrives / timestep])


def test_it_is_slow_towards_a_child_and_not_away_from_it():
    done = []
    for separates in (False, True):
        world, timestep, cell, start = corridor(10, NEAR_STAIRS, separates=separates)
        walked(world, 3)
        done.append(world.ledger.interventions_done[0])
        walked(world, 1)
        assert world.ledger.interventions_done[0] == 1
    assert start + 8 * cell <= 3 * timestep  # in time, but for the last two cells, beside the child
    assert done == [1, 0]
    away = [walked(corridor(3, FAR_STAIRS, separates=separates)[0], 5) for separates in (False, True)]
    assert away[0] == away[1]


@pytest.mark.parametrize("house", ["house-3", "home-3"])
def test_at_the_pace_of_the_grid_its_rows_are_those_of_the_grid(house):
    plan, family = FloorPlan.load(house), ChildGroup.of(0.75)
    episodes = streams(3)
    grid = GridWorld(plan, family, make_caregiver("expected-danger", plan)).run(episodes).totals()
    world = SlowedGrid(plan, family, make_caregiver("expected-danger", plan), PAPER)
    for episode, stream in enumerate(episodes):
        own = world.run([stream]).totals()
        assert {name: own[name][0] for name in FOUND} == {name: grid[name][episode] for name in FOUND}


OURS, THEIRS = np.array([2.0, 4.0, 6.0, 10.0]), np.array([1.0, 3.0, 2.0, 4.0])


def test_a_ratio_of_two_houses_of_each_of_two_shapes():
    # R = 22 / 10. The errors y - R x are -0.2, -2.6 and 1.6, 1.2, which within the shapes have variances 2.88 and 0.08;
    # so the sum has 2 * 2.88 + 2 * 0.08 = 5.92. Two of four degrees of freedom are left: t = 4.3027.
    ratio, low, high = of_stratified_ratio(OURS, THEIRS, [2, 2])
    reach = 4.3027 * 5.92**0.5 / 10
    assert (ratio, low, high) == pytest.approx((2.2, 2.2 - reach, 2.2 + reach), rel=1e-4)


def test_a_ratio_is_not_negative_and_there_may_be_none():
    assert of_stratified_ratio(np.array([0.0, 9.0, 0.0, 9.0]), np.ones(4), [2, 2]).low == 0.0
    assert np.isnan(of_stratified_ratio(OURS, np.zeros(4), [2, 2]).value)


def test_houses_are_taken_within_their_shapes_where_there_are_several_of_each():
    ours, theirs = ([np.array([mean - 1.0, mean + 1.0]) for mean in means] for means in (OURS, THEIRS))
    assert of_ratio(ours, theirs, [2, 2]) == pytest.approx(of_stratified_ratio(OURS, THEIRS, [2, 2]))
    for sizes in ([4], [1, 3]):
        assert of_ratio(ours, theirs, sizes) == two_level.of_ratio(ours, theirs) != of_ratio(ours, theirs, [2, 2])
    assert of_ratio(ours[:1], theirs[:1], [1]) == intervals.of_ratio(ours[0], theirs[0])

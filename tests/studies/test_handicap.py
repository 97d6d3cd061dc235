"""The grid's caregiver with what the robot lacks, in a corridor by hand, and how much of it there is to be."""

import numpy as np
import pandas as pd
import pytest

from caregiver_mj.caregivers import Caregiver
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.tape import Tape
from caregiver_mj.experiments.settings import episode_seed, episode_tapes
from caregiver_mj.plans.floor_plan import FloorPlan
from studies import grid_to_house
from studies.grid_to_house import Handicap, HandicappedGrid, WatchedGrid, minded_cells

# Free cells 0 to 17 from west to east, and beyond them the landings 18 in the west and 19 in the east. The child stands
# in cell 0 and bumps into its bin.
CORRIDOR = FloorPlan.parse(f"{'#' * 22}\n##B{'#' * 19}\n#S{'.' * 18}S#\n{'#' * 22}", "corridor")
EAST = 1


class Eastward(Caregiver):
    """Goes to the eastern stairwell."""

    def choose(self, percept):
        return np.full(len(percept.child_cell), EAST)


class Turncoat(Caregiver):
    """Goes west from even cells and east from odd ones."""

    def choose(self, percept):
        return percept.caregiver_cell % 2


def walk(handicap, caregiver, start, timesteps, kind=HandicappedGrid):
    """The caregiver's cell after each timestep, and the world."""
    world = kind(CORRIDOR, 0.0, caregiver(CORRIDOR), handicap)
    world.reset([[Tape(np.zeros(3), np.full((timesteps, 3), 0.5))]])
    world.child_cell[:], world.caregiver_cell[:] = 0, start
    cells = []
    for _ in range(timesteps):
        world.step()
        cells.append(int(world.caregiver_cell[0]))
    assert world.child_cell[0, 0] == 0
    return cells, world


@pytest.mark.parametrize(
    ("pace", "cells"),
    [
        (1.0, [6, 9, 12, 15]),
        (1.5, [5, 7, 9, 11]),
        (2.0, [4, 6, 7, 9]),  # what is left of the first timestep is enough for another action in the second
        (4.0, [3, 4, 5, 6]),
        (0.75, [7, 11, 15, 19]),
    ],
)
def test_actions_that_take_longer_or_shorter(pace, cells):
    assert walk(Handicap(pace=pace), Eastward, 3, 4)[0] == cells


def test_actions_near_the_child_take_longer():
    assert minded_cells(CORRIDOR)[:5, 0].tolist() == [True, True, True, False, False]  # 1.5 m, not 2.25 m
    assert walk(Handicap(near=2.0), Eastward, 1, 3)[0] == [2, 3, 6]
    assert walk(Handicap(near=0.5), Eastward, 1, 3)[0] == [3, 6, 9]  # two of them take the first timestep


def test_who_decides_once_carries_on():
    assert walk(Handicap(), Turncoat, 10, 2)[0] == [9, 10]  # to 9, back, and to 9 again
    assert walk(Handicap(once=True), Turncoat, 10, 2)[0] == [7, 10]
    assert walk(Handicap(once=True, pace=1.5), Turncoat, 10, 2)[0] == [8, 6]


# -- Phases --------------------------------------------------------------------------------------


def test_the_grid_logs_what_was_done_and_is_not_changed_by_it():
    plan, tapes = FloorPlan.load("paper"), [episode_tapes(episode_seed(0, i), 1) for i in range(10)]
    handicap = Handicap(True, 1.2, 0.3)
    worlds = [kind(plan, 0.5, make_caregiver("paper", plan), handicap) for kind in (WatchedGrid, HandicappedGrid)]
    ledger, other = (world.run(tapes) for world in worlds)
    assert all((ledger.totals()[name] == other.totals()[name]).all() for name in other.totals())
    table = pd.DataFrame(worlds[0].phases)
    counts = table.phase.value_counts()
    assert counts["fetch"] >= counts["carry"] > 0
    # Whoever is there already when it occurs to it has blocked a stairwell, too, but in no phase.
    assert 0 < counts["carry"] + counts["block"] <= ledger.interventions_done.sum()
    assert (table.actions >= table.shortest).all()
    assert (table.near <= table.actions).all()
    assert 0 < table.near.sum() < table.actions.sum()


# -- How much there is to be ---------------------------------------------------------------------

# Two completed phases in which the robot needs 12 s instead of the grid's 10, and loses 3 s to the child.
IN_HOUSE = pd.DataFrame(
    {
        "phase": ["block", "fetch", "fetch"],
        "end": ["done", "done", "given up"],
        "grid": [6.0, 4.0, 100.0],
        "clear": [7.0, 4.0, 100.0],
        "hand": [0.0, 1.0, 100.0],
        "house": [9.0, 6.0, 500.0],
    }
)
IN_GRID = pd.DataFrame(
    {
        "phase": ["block", "block", "fetch", "carry"],
        "actions": [10, 12, 8, 50],
        "near": [2, 4, 1, 50],
        "shortest": [10, 10, 8, 1],
        "time": [10.0, 14.0, 9.0, 50.0],
    }
)


def test_how_much_of_each_handicap_there_is():
    assert grid_to_house.pace_of(IN_HOUSE) == pytest.approx(12 / 10)
    # Near.
    # The child costs the robot 1.5 s a phase, which are 3 actions. The grid's caregiver loses 1 action in a mean block
    # and none in a fetch, 0.5 in all at a pace of 1, and has 3 actions near the child in a block and 1 in a fetch.
    assert grid_to_house.near_of(IN_HOUSE, IN_GRID, Handicap(), 0.5) == pytest.approx((3 - 0.5) / 2)
    assert grid_to_house.near_of(IN_HOUSE, IN_GRID, Handicap(pace=4.0), 0.5) == pytest.approx((3 - 2) / 2)
    assert grid_to_house.near_of(IN_HOUSE, IN_GRID, Handicap(pace=9.0), 0.5) == 0.0
    # Delay.
    # 0 and 4 actions in a block, 1 in a fetch: 1.5 in the mean of one of each.
    assert grid_to_house.delay_of(IN_HOUSE, IN_GRID, 0.5) == pytest.approx(0.75)

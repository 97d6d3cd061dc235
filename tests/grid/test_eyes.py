"""What the grid's caregiver sees, and what comes of it."""

import numpy as np
import pytest
from worlds import begun, streams

from caregiver_mj import FloorPlan
from caregiver_mj.caregivers.caregiver import PrivilegedCaregiver
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.registry import CAREGIVERS, make_caregiver
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.visibility import ALL_ROUND


class Watching(PaperCaregiver):
    def reset(self, *args, **kwargs):
        super().reset(*args, **kwargs)
        self.shown = []

    def watch(self, percept):
        super().watch(percept)
        self.shown.append((percept.child_cell.copy(), percept.previous_action.copy(), percept.belief.seen.copy()))


def put(world, caregiver, child=None):
    """Begins anew to look, with caregiver and child in some cells."""
    world.caregiver_cell[:] = world.plan.cell_index[caregiver]
    if child:
        world.child_cell[:] = world.plan.cell_index[child]
    world.eyes = type(world.eyes)(world, world.sight)


@pytest.mark.parametrize("sight", ["walls", "camera", "rooms:2"])
def test_what_is_seen_is_true_and_the_rest_is_not_told(sight):
    plan = FloorPlan.load("apartment")
    caregiver = Watching(plan)
    world = begun(GridWorld(plan, "1,.25", caregiver, sight=sight), range(5), children=2)
    for _ in range(60):
        world.step()
        cell, action, seen = caregiver.shown[-1]
        assert (cell[seen] == world.child_cell[seen]).all()
        assert (action[~seen] == -1).all()
    shares = np.mean([seen for _, _, seen in caregiver.shown])
    assert 0.02 < shares < 0.98


@pytest.mark.parametrize("name", ["nearest", "foresight"])  # one goes by a single cell, the other by the belief
def test_what_is_out_of_sight_changes_nothing(name):
    """Two worlds that differ only in how a child moves where it is not seen do the same until one is seen."""
    plan = FloorPlan.parse(
        "#############\n#....#S.....#\n#....#.####.#\n#B...#......#\n#...........#\n#C..T#.....S#\n#############",
        "two rooms",
    )
    moves = []
    for seeds in ([3], [4]):
        world = begun(GridWorld(plan, 1.0, make_caregiver(name, plan), sight="walls"), seeds)
        put(world, (1, 1), (1, 11))
        assert not world.eyes.tracker.seen.any()
        trace = []
        while not world.eyes.tracker.seen.any() and len(trace) < 200:
            world.step()
            trace.append((world.caregiver_cell[0], world.orders[0]))
        moves.append(trace[:-1])
    together = min(map(len, moves))
    assert together > 0
    assert moves[0][:together] == moves[1][:together]


def test_whoever_stands_still_turns_round():
    plan = FloorPlan.load("paper")
    world = begun(GridWorld(plan, 0.5, make_caregiver("guard", plan), sight="camera"), 1)
    headings = set()
    for _ in range(20):
        before = world.caregiver_cell.copy()
        world.step()
        headings.add(int(world.eyes.heading[0]))
    assert (world.caregiver_cell == before).all()
    assert world.eyes.heading[0] == ALL_ROUND
    assert len(headings) > 1  # on its way it looked to where it went


def test_it_finds_out_what_has_become_of_things_by_looking():
    plan = FloorPlan.parse("#########\n#B..#..o#\n#...#.#.#\n#.......#\n#########", "battery")
    world = begun(GridWorld(plan, 0.5, make_caregiver("nearest", plan), sight="walls"), 1)
    world.state[:] = 0
    put(world, (1, 2))
    world.state[:] = 2  # a child has taken it, out of sight
    world.eyes.look(np.zeros((1, 1), bool))
    assert world.percept().gone is None
    world.caregiver_cell[:] = plan.cell_index[(3, 7)]
    world.eyes.look(np.zeros((1, 1), bool))
    assert world.percept().gone.all()


@pytest.mark.parametrize(
    "name", [name for name, kind in CAREGIVERS.items() if kind and not issubclass(kind, PrivilegedCaregiver)]
)
def test_every_caregiver_can_do_with_its_own_eyes(name):
    plan, damage = FloorPlan.load(HOME), []
    for _ in range(2):
        world = begun(GridWorld(plan, "1,.25", make_caregiver(name, plan), sight="camera"), range(3), children=2)
        for _ in range(40):
            world.step()
        damage.append(world.ledger.damage)
    assert damage[0].any()
    assert (damage[0] == damage[1]).all()


@pytest.mark.slow  # its tables are
def test_foresight_goes_to_look_for_a_child_that_moves_at_random():
    plan, seeds = FloorPlan.load("house-17"), range(6)
    looks, never = (
        GridWorld(plan, 1.0, ForesightCaregiver(plan, regrets=regrets), sight="walls").run(streams(seeds)).totals()
        for regrets in (30, 0)
    )
    assert (never["looking"] == 0).all()
    assert looks["looking"].mean() > 0.02
    assert looks["seen"].mean() > never["seen"].mean()


HOME = "home-1-9x8-rooms1-stairwells1-candles1-tables1-bins1-gates1-mugs0-batteries1"
HALL = "########\n#S....B#\n########"


def test_it_does_not_walk_into_a_child_behind_its_back_and_feels_it():
    plan = FloorPlan.parse(HALL, "hall")
    world = begun(GridWorld(plan, 0.5, make_caregiver("guard", plan), sight="camera"), 1)
    put(world, (1, 4), (1, 3))
    world.eyes.heading[:] = 1  # away from it
    unseen = np.full((1, 1), -1)
    world.eyes.tracker.move(unseen, unseen, unseen, world.eyes.in_view())
    world.eyes.tracker.cell[:] = plan.cell_index[(1, 5)]  # it is thought to have passed
    world.act_caregiver(world.caregiver)
    assert (world.caregiver_cell == plan.cell_index[(1, 4)]).all()
    assert world.eyes.tracker.seen.all()
    assert (world.eyes.tracker.cell == plan.cell_index[(1, 3)]).all()


def test_the_rule_weighs_what_it_fears_by_where_the_child_may_be():
    plan = FloorPlan.parse("#########\n#S.....S#\n####B####\n#########", "two stairs")
    world = begun(GridWorld(plan, 0.5, make_caregiver("expected-danger", plan), sight="walls"), 1)
    west, east = plan.cell_index[(1, 2)], plan.cell_index[(1, 5)]
    joint = np.zeros_like(world.eyes.tracker.joint)
    joint[:, :, west], joint[:, :, east] = 0.75 / joint[0, 0, 0].size, 0.25 / joint[0, 0, 0].size
    world.eyes.tracker.joint = joint
    # By inverse distance: from the west 1 and 5 moves, from the east 4 and 2: 5/6, 1/6 and 1/3, 2/3.
    first = 0.75 * 5 / 6 + 0.25 / 3
    assert world.caregiver.reach(world.percept())[0, 0] == pytest.approx([first, 1 - first], abs=1e-6)

"""The grid in which the caregiver acts while the children are on their way, as the robot does in the house."""

import numpy as np
import pytest

from caregiver_mj.caregivers import Caregiver, make_caregiver
from caregiver_mj.children.tape import Tape
from caregiver_mj.errors import CaregiverError
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan

NORTH, EAST, SOUTH, WEST = range(4)
LANDING = FloorPlan.parse("#########\n#......S#\n#B.....##\n#########")
KITCHEN = FloorPlan.parse("#######\n#.....#\n#B.C.T#\n#.....#\n#######")


class Guard(Caregiver):
    """Protects from the first hazard, and remembers what it saw."""

    def reset(self, batch, seeds=None, children=1):
        self.seen = []

    def choose(self, percept):
        self.seen.append(percept)
        return np.zeros(len(percept.child_cell), int)


def world(plan, meanwhile, child, caregiver, move):
    """A world in which the child goes one way for ever."""
    made = GridWorld(plan, 1.0, Guard(plan), meanwhile=meanwhile)
    made.reset([[Tape(np.zeros(3), np.tile([0.0, (move + 0.5) / 4, 0.0], (3, 1)))]])
    made.child_cell[:] = made.previous_cell[:] = plan.cell_index[child]
    made.caregiver_cell[:] = plan.cell_index[caregiver]
    return made


@pytest.mark.parametrize(("meanwhile", "harm"), [(0, 5.0), (1, 0.0), (2, 0.0), (3, 0.0)])
def test_a_caregiver_next_to_the_stairwell_comes_in_between(meanwhile, harm):
    plan = FloorPlan.parse("#########\n#.......#\n#B....S.#\n#########")  # child from the west, caregiver in the east
    one = world(plan, meanwhile, (2, 5), (2, 7), EAST)
    one.step()
    totals = one.ledger.totals()
    assert totals["damage"].tolist() == [harm]
    blocked = [int(harm == 0)]
    for column in ("moves_blocked", "moves_blocked_stairwell", "moves_entered", "moves_entered_blocked"):
        assert totals[column].tolist() == blocked
    assert one.ledger.timestep == 1


@pytest.mark.parametrize(("meanwhile", "harm"), [(1, 5.0), (2, 0.0)])
def test_it_comes_no_faster_than_it_can(meanwhile, harm):
    plan = FloorPlan.parse("##########\n#........#\n#B....S..#\n##########")
    one = world(plan, meanwhile, (2, 5), (2, 8), EAST)
    one.step()
    assert one.ledger.totals()["damage"].tolist() == [harm]


def test_one_that_stands_there_blocks_and_has_not_cut_anything_off():
    one = world(LANDING, 1, (1, 6), (1, 7), EAST)
    one.step()
    totals = one.ledger.totals()
    assert (totals["moves_blocked"].item(), totals["moves_entered"].item(), totals["damage"].item()) == (1, 0, 0)


def test_the_caregiver_sees_where_the_child_is_going_and_then_where_it_is():
    one = world(LANDING, 1, (1, 2), (2, 6), EAST)
    one.step()
    seen = [(p.child_cell.item(), p.previous_cell.item(), p.previous_action.item()) for p in one.caregiver.seen]
    there, here = LANDING.cell_index[1, 3], LANDING.cell_index[1, 2]
    assert seen[0] == (there, here, EAST)
    assert one.child_cell.item() == there
    assert one.caregiver.seen[0].time_left.item() == 1.0


def test_a_candle_taken_meanwhile_does_not_burn():
    harms = []
    for meanwhile in (0, 1):
        one = world(KITCHEN, meanwhile, (1, 3), (3, 3), SOUTH)  # child and caregiver on both sides of the table
        one.step()
        harms.append(one.ledger.totals()["damage"].item())
    assert harms == [4.0, 1.0]


def test_what_cannot_be_is_refused():
    with pytest.raises(CaregiverError, match="meanwhile must be 0 to 3, got 4"):
        GridWorld(LANDING, 0.5, None, meanwhile=4)
    with pytest.raises(CaregiverError, match="meanwhile must be 0 with a caregiver"):
        GridWorld(LANDING, 0.5, make_caregiver("knows-goal", LANDING), meanwhile=1)

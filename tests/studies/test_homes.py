"""Homes: where damage weights come from, and the page."""

import pytest
from worlds import streams

from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import BATTERY, GATE, State
from studies import homes

HOUSE = "home-1-9x8-rooms1-stairwells1-candles1-tables1-bins1-gates1-mugs0-batteries1"


@pytest.mark.parametrize(("admitted", "damage"), [(0.5, 1.0), (1.0, 2.0), (4.0, 4.0), (11.4, 5.511), (10.3, 5.365)])
def test_damage_is_on_a_line_in_the_logarithm_of_who_is_admitted(admitted, damage):
    assert homes.weight(admitted) == pytest.approx(damage, abs=1e-3)


@pytest.mark.parametrize("made", [homes.NoGates, homes.ForesightNoGates])
def test_without_the_verb_no_gate_is_closed_but_all_else_is_done(made):
    plan = FloorPlan.load(HOUSE)
    world = GridWorld(plan, "0.5", made(plan))
    world.run(streams(4))
    gates, things = ([kind is one for kind in plan.hazards.kinds] for one in (GATE, BATTERY))
    assert (world.state[:, gates] == State.AS_PLANNED).all()
    assert (world.state[:, things] == State.GONE).any()
    assert (world.ledger.interventions_done > 0).all()

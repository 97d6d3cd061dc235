"""A newcomer's errand: a stateful verb. It is all in this file but what all verbs have in common, at its end.

The verb `shut` has the caregiver go to a stairwell and shut its gate, for good. What there is to say of it: what it is
called, acts on and leaves, where one stands for it in the grid, and what the robot does.
"""

import numpy as np
import pytest
from worlds import streams

from caregiver_mj import CaregiverError, CaregiverPolicy, FloorPlan, load
from caregiver_mj.caregivers import Caregiver
from caregiver_mj.grid.verbs import GRID_VERBS, InOpening
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.interventions.verb import BLOCK, PICK_UP, RELOCATE, VERBS, Intervention, Interventions, Verb, verb_of
from caregiver_mj.plans.hazards import NOTHING, State, Where
from caregiver_mj.policy.routines import ROUTINES, Routine
from caregiver_mj.robot import skills

HOUSE = FloorPlan.parse("##########\n#S......B#\n#........#\n#.....C.S#\n#...T....#\n##########", "gates")


def shut_gate(means, intervention, view, percept):
    return Routine(means, intervention, skills.Block(means.navigator, intervention.hazard))


class Gatekeeper(Caregiver):
    """Shuts one stairwell after the other, and is then idle."""

    def choose(self, percept):
        raise NotImplementedError

    def decide(self, percept):
        batch, stairs = len(percept.child_cell), len(self.plan.stairwells)
        left = np.zeros((batch, stairs), bool) if percept.out_of_reach is None else percept.out_of_reach[:, :stairs]
        first = np.where(left.all(axis=1), NOTHING, left.argmin(axis=1))
        return Interventions.of([Intervention() if n == NOTHING else Intervention("shut", int(n)) for n in first])


@pytest.fixture
def _registered(monkeypatch):
    monkeypatch.setitem(VERBS, "shut", Verb("shut", "shut the gate of {hazard}", Where.OPENING, leaves=State.SHUT))
    monkeypatch.setitem(GRID_VERBS, "shut", InOpening())
    monkeypatch.setitem(ROUTINES, "shut", shut_gate)


@pytest.mark.usefixtures("_registered")
def test_verbs_with_the_same_places_share_their_routes(monkeypatch):
    known = []
    monkeypatch.setattr("caregiver_mj.grid.world.routes", lambda plan, places: known.extend(places))
    GridWorld(HOUSE, "1", Gatekeeper(HOUSE))  # `block` and `shut` are done in the same stairwells
    assert len(known) == len(set(known)) == len(HOUSE.stairwells) + len(HOUSE.tables)


@pytest.mark.usefixtures("_registered")
def test_the_robot_shuts_it_and_no_child_falls_there_any_more():
    env = load("supervise", HOUSE, 0.5, random=0, visuals=False)
    policy = CaregiverPolicy(env, Gatekeeper(HOUSE))
    step, activities = env.reset(), set()
    for _ in range(24 * 84):
        step = env.step(policy(step))
        activities.add(policy.activity)
        if policy.executive.done == 2:
            break
    assert {"shut the gate of stairwell 1", "shut the gate of stairwell 2"} <= activities
    assert env.task.outcome()["interventions_done"] == policy.executive.begun == 2
    assert env.task.children.state.tolist() == [State.SHUT, State.SHUT, State.AS_PLANNED]
    policy(env.step(policy(step)))
    assert policy.activity == "keep out of the way"
    env.reset()
    assert env.task.children.state.tolist() == [State.AS_PLANNED] * 3


@pytest.mark.usefixtures("_registered")
def test_a_verb_with_one_half_is_refused_where_it_has_none(monkeypatch):
    monkeypatch.delitem(GRID_VERBS, "shut")
    monkeypatch.delitem(ROUTINES, "shut")
    with pytest.raises(CaregiverError, match=r"'shut' must have its half in grid.verbs.GRID_VERBS"):
        GridWorld(HOUSE, "0.5", Gatekeeper(HOUSE)).run(streams(1, 2))
    env = load("supervise", HOUSE, 0.5, random=0, visuals=False)
    policy = CaregiverPolicy(env, Gatekeeper(HOUSE))
    with pytest.raises(CaregiverError, match=r"'shut' must have its half in policy.routines.ROUTINES"):
        policy(env.reset())


PLAN = FloorPlan.parse("########\n#S..o.B#\n##T#CT##\n########")


def test_another_destination_is_no_other_intervention():
    before = Interventions.of([Intervention(RELOCATE, 1, 2), Intervention(RELOCATE, 1, 2), Intervention(BLOCK, 0)])
    now = Interventions.of([Intervention(RELOCATE, 1, 0), Intervention(BLOCK, 0), Intervention(BLOCK, 1)])
    assert now.begins_after(before).tolist() == [False, True, True]


@pytest.mark.parametrize("name", list(VERBS))
def test_every_verb_says_what_it_is_called_and_drawn_as(name):
    verb = verb_of(name)
    intervention = Intervention(name, {BLOCK: 0, RELOCATE: 1, PICK_UP: 2}.get(name, -1))
    marks = {BLOCK: ("cell", (1, 1)), RELOCATE: ("candle", 0), PICK_UP: ("cell", (1, 4))}
    assert verb.name == name
    assert verb.describe(PLAN, intervention)
    assert verb.mark(PLAN, intervention) == marks.get(name)

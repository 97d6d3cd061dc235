"""A newcomer's errand: a third verb. It is all in this file; nothing else in the package is touched.

The verb `visit` has the caregiver stand beside a toy bin, its destination. What there is to say of it: where one stands
for it in the grid, what is done there, how the robot does it, and what it is called.
"""

import math

import numpy as np
import pytest

import caregiver_mj
from caregiver_mj.caregivers import Caregiver
from caregiver_mj.children.tape import Tape
from caregiver_mj.errors import CaregiverError
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.interventions.registry import VERBS
from caregiver_mj.interventions.verb import Intervention, Interventions, Verb
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

HOUSE = FloorPlan.parse("##########\n#S......B#\n#........#\n#.....C..#\n#...T....#\n##########", "visits")


class Visit(Verb):
    """To stand beside a toy bin."""

    name = "visit"

    def describe(self, plan, intervention):
        return f"visit bin {intervention.destination + 1}"

    def mark(self, plan, intervention):
        return "cell", plan.bins[intervention.destination]

    def places(self, plan):
        return plan.graph.beside(plan.bins)

    def place(self, world, which):
        return world.orders.destination[which]

    def carry_out(self, world, which, came, stood):
        arrived = which[came & ~world.done[which]]
        world.ledger.interventions_done[arrived] += 1
        world.done[arrived] = True

    def routine(self, means, intervention, view, percept):
        from caregiver_mj.interventions.routine import Routine
        from caregiver_mj.robot.skills import Skill

        plan, navigator = means.plan, means.navigator
        (cell, *_) = plan.free_neighbours(plan.bins[intervention.destination])
        goal = tuple(plan.position(cell).tolist())

        class GoThere(Skill):
            def _act(self, view, robot):
                robot.reach(0.0)
                return self.driver.drive(view, robot, goal, cell, robot.yaw)

        return Routine(means, intervention, GoThere(navigator), self.describe(plan, intervention), goes_on=True)


class Visitor(Caregiver):
    """Wants nothing but to stand beside the bin."""

    def choose(self, percept):
        raise NotImplementedError

    def decide(self, percept):
        return Interventions.of([Intervention("visit", NOTHING, 0)] * len(percept.child_cell))


@pytest.fixture
def _registered():
    VERBS[Visit.name] = Visit()
    yield
    del VERBS[Visit.name]


@pytest.mark.usefixtures("_registered")
def test_the_grid_carries_it_out():
    world = GridWorld(HOUSE, "0.5", Visitor(HOUSE))
    world.run([Tape.draw_family(np.random.RandomState(seed), 1, 40) for seed in range(8)])
    assert world.ledger.totals()["interventions"].tolist() == [1] * 8
    assert world.ledger.totals()["interventions_done"].tolist() == [1] * 8
    beside = HOUSE.graph.beside(HOUSE.bins)[0]
    assert np.isin(world.caregiver_cell, beside).all()


@pytest.mark.usefixtures("_registered")
def test_the_robot_carries_it_out():
    env = caregiver_mj.load("supervise", HOUSE, 0.5, random=0)
    policy = caregiver_mj.CaregiverPolicy(env, Visitor(HOUSE))
    step = env.reset()
    for _ in range(12 * 84):
        step = env.step(policy(step))
        if policy.interventions_done:
            break
    assert policy.activity == "visit bin 1"
    assert env.task.outcome()["interventions_done"] == 1
    (cell, *_) = HOUSE.free_neighbours(HOUSE.bins[0])
    assert math.dist(env.physics.base_position()[:2], HOUSE.position(cell)) < 0.05


def test_without_its_registration_it_is_refused_by_name():
    with pytest.raises(CaregiverError, match="no verb 'visit'"):
        GridWorld(HOUSE, "0.5", Visitor(HOUSE)).run([Tape.draw_family(np.random.RandomState(0), 1, 2)])

"""The base strikes no child that walks as fast as children do here, unless the child pushes it.

There is no physics here, so nobody can push the base: it follows its commands with the lag of its servos. It drives to
one random place after another, among children that chase it, cross its way or stand still.
"""

import itertools
import math

import numpy as np
import pytest
from robot_plans import HOUSE, centre
from views import child, view

from caregiver_mj.children.walk import BUMP_SPEED
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.recording.ledger import STRIKE_SPEED
from caregiver_mj.robot import governor, separation
from caregiver_mj.robot.driver import Driver
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import CHILD_RADIUS, ChildView

TIMESTEP, SUBSTEPS = 0.02, 4  # seconds, and physics steps in each
OPEN = FloorPlan.parse("########\n#......#\n#S.....#\n#......#\n#B.....#\n########", "open")
PACES = (0.4, 0.7, 1.0, 1.0)  # shares of the greatest speed towards something


class Chaser:
    """A child of random whims, each for up to 1.5 seconds."""

    def __init__(self, plan: FloorPlan, place: np.ndarray, rng: np.random.Generator):
        self._floor, self._plan, self._rng, self._until = set(plan.free_cells), plan, rng, 0.0
        self.place, self.velocity = place, np.zeros(2)

    def step(self, now: float, base: np.ndarray, driven: np.ndarray, seconds: float) -> None:
        """Go on towards the base, to where it is about to be, round it, straight on, or not at all."""
        if now >= self._until:
            self._until, self._whim = now + self._rng.uniform(0.1, 1.5), self._rng.integers(5)
            self._heading, self._speed = self._rng.uniform(-math.pi, math.pi), BUMP_SPEED * self._rng.choice(PACES)
        to = base[:2] - self.place
        ways = (
            to,
            to + 0.5 * driven[:2],
            0.6 * to + 0.8 * np.array([-to[1], to[0]]) * math.copysign(1.0, self._heading),
            np.array([math.cos(self._heading), math.sin(self._heading)]),
            np.zeros(2),
        )
        way = ways[self._whim]
        self.velocity = self._speed * way / max(np.linalg.norm(way), 1e-9)
        there = self.place + seconds * self.velocity
        if self._plan.cell_at(there) in self._floor:
            self.place = there
        else:
            self.velocity = np.zeros(2)


def greatest_speed_at_a_touch(name, plan, children, late, seed, seconds):
    """Return how fast the base's surface came towards a child that it touched, m/s, and how far the base drove, m."""
    robot, rng = find_embodiment(name), np.random.default_rng(seed)
    navigator, motion = Navigator(plan, robot), RobotMotion(robot, TIMESTEP, delay=late)
    driver, cells = Driver(navigator), sorted(navigator.centres)
    base, driven, told = np.array([*centre(plan, cells[rng.integers(len(cells))]), 0.0]), np.zeros(3), np.zeros(3)
    motion.reset(base)
    far = [cell for cell in plan.free_cells if math.dist(centre(plan, cell), base[:2]) > 1.0]
    chasers = [Chaser(plan, np.array(centre(plan, far[i])), rng) for i in rng.choice(len(far), children, replace=False)]
    lag = np.array([robot.servos.base_lag, robot.servos.base_lag, robot.servos.yaw_lag])
    until, fastest, way = 0.0, 0.0, 0.0
    past: list[tuple[ChildView, ...]] = []
    for step in range(round(seconds / TIMESTEP)):
        now = step * TIMESTEP
        if now >= until:
            until, goal = now + rng.choice((0.3, 1.0, 2.0, 4.0, 8.0)), cells[rng.integers(len(cells))]
            yaw = None if rng.random() < 0.5 else rng.uniform(-math.pi, math.pi)
        past.append(tuple(child(*one.place, *one.velocity) for one in chasers))
        seen = view(*past[max(0, step - round(late / TIMESTEP))], base=tuple(base.tolist()), now=now)
        if late:  # it foretells where they are, and knows by how much that may be wrong
            ahead = [tuple(p + late * v for p, v in zip(*one, strict=True)) for one in seen.children]
            seen.children = tuple(one._replace(position=at) for one, at in zip(seen.children, ahead, strict=True))
            seen.age, seen.unsure = late, late * BUMP_SPEED
        motion.now = now
        if driver.drive(seen, motion, centre(plan, goal), goal, yaw) is not Status.RUNNING:
            driver = Driver(navigator)
        command = governor.govern(seen, motion, navigator.clearance, TIMESTEP)[robot.layout.base]
        for part in range(1, SUBSTEPS + 1):
            dt, asked = TIMESTEP / SUBSTEPS, told + part / SUBSTEPS * (command - told)
            driven = asked + (driven - asked) * np.exp(-dt / lag)
            base, way = base + dt * driven, way + dt * np.linalg.norm(driven[:2])
            for one in chasers:
                one.step(now, base, driven, dt)
                out = np.array(separation.outwards(robot, base[2], tuple(one.place - base[:2])))
                off = np.linalg.norm(out)
                within = robot.rounding + CHILD_RADIUS - off
                if within > 0.0:
                    out /= off
                    x, y = one.place - CHILD_RADIUS * out - base[:2]
                    surface = driven[:2] + driven[2] * np.array([-y, x])
                    fastest = max(fastest, float(surface @ out))
                    one.place = one.place + within * out
                    one.velocity = one.velocity - out * min(0.0, float(one.velocity @ out))
        told = np.array(command)
    return fastest, way


@pytest.mark.parametrize(("plan", "late"), [(OPEN, 0.0), (OPEN, 0.06), (HOUSE, 0.0)])
@pytest.mark.parametrize("name", ["mobile_fr3", "mobile_ur5e"])
def test_no_base_strikes_a_child_that_does_not_push_it(name, plan, late):
    runs = itertools.product((1, 2, 3), range(3))
    found = [greatest_speed_at_a_touch(name, plan, children, late, seed, 15.0) for children, seed in runs]
    speeds, ways = zip(*found, strict=True)
    assert max(speeds) < STRIKE_SPEED
    assert sum(ways) > 20.0  # it does not merely stand still

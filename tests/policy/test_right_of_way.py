"""Robot and child in each other's way, judged by positions and contacts in the physics."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scripted_child import EAST, NORTH, STAY, WEST, Scripted

from caregiver_mj import CaregiverPolicy, FloorPlan, load
from caregiver_mj.caregivers import Caregiver
from caregiver_mj.interventions.verb import BLOCK, DO_NOTHING, Intervention, Interventions
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.robot.driver import TIME_OUT
from caregiver_mj.robot.status import Status

TOUCHING = 0.27 + 0.12  # metres between the middles of base and child
GIVES_UP = 10.0  # seconds
OPEN = FloorPlan.parse("########\n#......#\n#S.....#\n#......#\n#B.....#\n########", "open")
# Two rooms with a toy bin each, and between them a corridor as wide as one cell, or a doorway.
CORRIDOR = FloorPlan.parse("############\n#..######..#\n#.........B#\n#B.######..#\n############", "corridor")
DOORWAY = FloorPlan.parse("#########\n#B..#...#\n#.......#\n#...#..B#\n#########", "doorway")
# The way from the east to the stairwell in the west is a corridor; there is another stairwell in the east.
ONE_WAY = FloorPlan.parse("###########\n####B######\n#S.......S#\n###########", "one_way")
# The candle's table stands at the end of a corridor, bare ones at the other end and between.
TABLES = FloorPlan.parse("##########\n#T......C#\n#####T#B##\n##########", "tables")

# A corridor between two stairwells, with everything in niches beside it.
HALL = FloorPlan.parse("##############\n##B##T###C####\n#S..........S#\n#####C####B###\n##############", "hall")


class Determined(Caregiver):
    """Protects from hazards in a given order as far as they are in reach, and takes candles to a given table."""

    def __init__(self, plan: FloorPlan, *order: int, table: int = 0):
        super().__init__(plan)
        self._order, self._table = order, table

    def choose(self, percept):
        return np.array([next((hazard for hazard in self._order if not percept.out_of_reach[0, hazard]), NOTHING)])

    def destination(self, percept, candle):
        return np.array([self._table])


class Scene:
    """An episode that begins with child and robot in given places; the child is a novice without chance at first."""

    def __init__(self, plan: FloorPlan, caregiver: Caregiver, child: Cell, robot: Cell, seed: int = 0):
        self.child = Scripted(plan, None)
        self.env = load("supervise", plan, self.child, random=seed)
        self.policy = CaregiverPolicy(self.env, caregiver)
        place(self.env, child, robot)
        self.base: list[np.ndarray] = []
        self._step = None

    @property
    def time(self) -> float:
        return 0.02 * len(self.base)

    def run(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Goes on for so long, or until something is so; returns whether it is."""
        self._step = self._step or self.env.reset()
        end = self.time + seconds
        while self.time < end:
            self._step = self.env.step(self.policy(self._step))
            self.base.append(self.env.physics.base_position())
            if until():
                return True
        return False

    def is_at(self, cell: Cell) -> bool:
        return math.dist(self.base[-1][:2], self.env.task.plan.position(cell)) < 0.05


def place(env, child: Cell, robot: Cell | None) -> None:
    """Has the next episodes begin with child and robot in given cells."""
    task, begin = env.task, env.task.initialize_episode

    def initialize_episode(physics) -> None:
        begin(physics)
        task.children[0].put(child)
        physics.set_toddler(task.children[0].walk)
        if robot is not None:
            physics.set_robot(np.array([*task.plan.position(robot), 0.0]))

    task.initialize_episode = initialize_episode


@pytest.mark.parametrize("gap", [0.0, 0.07])
def test_robot_and_child_that_run_into_each_other_get_free(gap, monkeypatch):
    """The child wants into the cell in which the robot stands; the robot's way leads past it."""
    scene = Scene(OPEN, Determined(OPEN, 0), (2, 4), (2, 4))
    task, physics = scene.env.task, scene.env.physics
    begin = task.initialize_episode

    def initialize_episode(physics) -> None:
        begin(physics)
        x, y = OPEN.position((2, 4))
        task.children[0].put_at(x, y + 0.064 - TOUCHING - gap)
        physics.set_toddler(task.children[0].walk)
        physics.set_robot(np.array([x, y + 0.064, 0.0]))

    monkeypatch.setattr(task, "initialize_episode", initialize_episode)
    scene.child.move = NORTH
    assert scene.run(20.0, lambda: scene.is_at((2, 1)))
    assert math.dist(physics.toddler_position()[:2], OPEN.position((3, 4))) > 0.75  # it has got on
    assert task.outcome()["strikes"] == 0


@pytest.mark.parametrize(
    ("plan", "child", "robot"),
    [(CORRIDOR, (2, 2), (2, 4)), (DOORWAY, (2, 6), (2, 4))],
    ids=["corridor_west", "doorway_east"],
)
def test_child_gets_through_when_nothing_calls_for_the_robot(plan, child, robot):
    seconds = 60.0
    alone = load("supervise", plan, epsilon=0.0, random=1, task_kwargs={"robot": False})
    place(alone, child, None)
    alone.reset()
    for _ in range(round(seconds / 0.02)):
        alone.step(np.zeros(0))
    scene = Scene(plan, Determined(plan), child, robot, seed=1)
    scene.run(seconds)
    outcome = scene.env.task.outcome()
    assert alone.task.outcome()["toys_reached"] >= 3
    assert outcome["toys_reached"] >= alone.task.outcome()["toys_reached"] - 1
    assert outcome["moves_blocked"] <= 2
    assert outcome["strikes"] == 0


def test_robot_waits_where_the_child_keeps_the_only_way_closed_then_protects_something_else():
    west, east = 0, 1
    scene = Scene(ONE_WAY, Determined(ONE_WAY, west, east), (2, 4), (2, 7))
    scene.child.move = STAY
    assert scene.run(30.0, lambda: scene.policy.target == east)
    gave_up = scene.time
    assert GIVES_UP < gave_up < GIVES_UP + 3.0
    near = math.dist(scene.base[-1][:2], scene.env.physics.toddler_position()[:2]) - TOUCHING
    assert 1.0 < near < 1.2  # it has waited with a free cell between them
    assert scene.run(5.0, lambda: scene.policy.executive.done == 1)
    assert scene.is_at((2, 9))
    scene.run(gave_up + 4.5 - scene.time)
    assert scene.policy.target == east  # it does not begin the same thing again at once
    assert scene.run(2.0, lambda: scene.policy.target == west)  # but then it tries
    assert scene.env.task.outcome()["strikes"] == 0


def test_a_candle_in_the_hand_goes_to_another_table():
    far, other = 0, 1  # the latter being that on which it stood
    scene = Scene(TABLES, Determined(TABLES, 0, table=far), (1, 3), (1, 6))
    scene.child.move = STAY
    assert scene.run(40.0, lambda: scene.policy.executive.done == 1)
    scene.run(0.6)  # before the robot tries again
    candle = scene.env.physics.candle_poses()[0]
    assert np.abs(candle[:2] - TABLES.position(TABLES.tables[other])).max() < 0.02
    outcome = scene.env.task.outcome()
    assert outcome["candles_dropped"] == outcome["strikes"] == 0


class ToAndFro(Scripted):
    """Goes three cells one way and three cells back, whoever is there."""

    def act(self, sight, draws):
        self.move = (EAST, WEST)[len(self.seen) // 3 % 2]
        return super().act(sight, draws)


@pytest.mark.parametrize(
    ("child", "candle"), [("adversary:0", "stands"), (Scripted(HALL, STAY), "on its head"), (ToAndFro(HALL), "lies")]
)
def test_every_skill_ends_whatever_a_child_does(child, candle):
    """What is done goes on for as long as it is wanted: a robot that stands in a stairwell, or aside."""
    env = load("supervise", HALL, child, random=1, visuals=False)
    policy, step = CaregiverPolicy(env), env.reset()
    if candle != "stands":
        joint, (x, y) = env.physics.model.ptr.joint("candle_0/joint").qposadr[0], HALL.position((2, 7))
        turn, height = (np.pi / 4, 0.022) if candle == "lies" else (np.pi / 2, 0.16)
        env.physics.data.qpos[joint : joint + 7] = [x + 0.1, y, height, np.cos(turn), 0.0, np.sin(turn), 0.0]
    skill, since, longest = None, 0.0, 0.0
    while env.physics.time() < 90.0:
        step = env.step(policy(step))
        routine = policy.executive.routine
        present = routine.skill if routine and policy.target != NOTHING else None
        if present is not skill or (present and present.status is Status.DONE):
            skill, since = present, env.physics.time()
        longest = max(longest, env.physics.time() - since if skill else 0.0)
    assert longest < 4 * TIME_OUT
    assert env.task.outcome()["strikes"] == 0


class Ordered(Caregiver):
    """Does what it was told last."""

    waits = True
    order = Intervention(BLOCK, 0)

    def choose(self, percept):
        return self.decide(percept).hazard

    def decide(self, percept):
        return Interventions.of([self.order])


def test_to_wait_in_a_cell_interrupts_what_is_under_way_and_to_be_idle_does_not():
    caregiver = Ordered(OPEN)
    scene = Scene(OPEN, caregiver, (4, 4), (1, 6))
    scene.run(1.0)
    caregiver.order = Intervention(DO_NOTHING, destination=OPEN.cell_index[1, 5])
    assert scene.run(8.0, lambda: scene.is_at((1, 5)))
    scene.run(4.0)
    assert scene.is_at((1, 5))  # and waits there
    caregiver.order = Intervention(DO_NOTHING, destination=OPEN.cell_index[1, 3])
    assert scene.run(8.0, lambda: scene.is_at((1, 3)))
    caregiver.order = Intervention(BLOCK, 0)
    scene.run(2.0)
    caregiver.order = Intervention(DO_NOTHING)
    assert scene.run(8.0, lambda: scene.is_at((2, 1)))  # in the stairwell
    assert scene.policy.executive.begun == 2

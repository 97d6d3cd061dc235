"""How skills fare, step by step: each alone with the physics, without a caregiver."""

from collections.abc import Callable

import numpy as np
import pytest
from robot_plans import centre
from scripted_child import STAY, Scripted
from views import ROBOT, TIMESTEP, at_rest, child, view

from caregiver_mj import FloorPlan, load
from caregiver_mj.house.scene import build_house
from caregiver_mj.robot import geometry, governor
from caregiver_mj.robot.kinematics import hand_position
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.retrieval import PlanningScene, RetrievalPlanner
from caregiver_mj.robot.skills import Block, Pick, Place, Retrieve, Skill
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import ChildView, View

ROOM = FloorPlan.parse("##########\n#B.......#\n#..C.....#\n#.....T..#\n#S......B#\n##########", "room")
CANDLE, ITS_TABLE, BARE_TABLE = 0, 0, 1
TABLE_TOP, CANDLE_RADIUS, CANDLE_HEIGHT = 0.60, 0.022, 0.16  # metres
GIVES_UP = 10.0  # seconds


class Stage:
    """The room with a child that stays in a corner, a robot that begins beside the bin, and children only it sees."""

    def __init__(self):
        env = load("supervise", ROOM, Scripted(ROOM, STAY), random=1)
        env.reset()
        self._env, self.physics, self.navigator = env, env.physics, Navigator(ROOM, ROBOT)
        env.task.children[0].put((4, 7))
        self.physics.set_robot(np.array([*ROOM.position((3, 2)), 0.0]), self.physics.arm_position())
        self.robot = at_rest(self.physics.base_position().tolist())
        self.others: list[ChildView] = []

    def retrieve(self, pitch_down: float | None = None) -> Retrieve:
        planner = RetrievalPlanner(self.navigator, lambda heights: PlanningScene(build_house(ROOM), ROOM, ROBOT))
        return Retrieve(self.navigator, planner, CANDLE, pitch_down)

    def put_candle(self, x: float, y: float, z: float, tilt: float) -> None:
        joint = self.physics.model.ptr.joint("candle_0/joint").qposadr[0]
        self.physics.data.qpos[joint : joint + 7] = [x, y, z, np.cos(tilt / 2), 0.0, np.sin(tilt / 2), 0.0]

    def look(self) -> View:
        physics = self.physics
        poses, (x, y, _) = physics.candle_poses(), np.ravel(physics.toddler_position()).tolist()
        how = {"base": tuple(physics.base_position().tolist()), "fingers": float(physics.finger_position().sum())}
        seen = view(child(x, y), *self.others, now=self.robot.now, candles=poses, **how)
        seen.arm = physics.arm_position()
        return seen

    def step(self, skill: Skill) -> Status:
        seen = self.look()
        status = skill.step(seen, self.robot)
        assert skill.status is status
        governor.bound_base(seen, self.robot)
        self._env.step(self.robot.action(seen.base))
        self.robot.now += TIMESTEP
        return status

    def run(self, skill: Skill, until: Callable[[], bool] = lambda: False, seconds: float = 40.0) -> list[Status]:
        """Goes on until the skill has ended or something is so; returns how it fared, without repetitions."""
        statuses = [skill.status]
        for _ in range(round(seconds / TIMESTEP)):
            if (status := self.step(skill)) is not statuses[-1]:
                statuses.append(status)
            if status.ended or until():
                return statuses
        raise AssertionError(f"still {statuses} after {seconds} s")

    def candle(self) -> np.ndarray:
        return self.physics.candle_poses()[CANDLE, :3]


@pytest.fixture
def stage() -> Stage:
    return Stage()


def test_picking_and_placing_must_not_be_interrupted_once_the_fingers_are_at_the_candle(stage):
    pick = Pick(stage.navigator, CANDLE, ITS_TABLE)
    assert stage.run(pick) == [Status.RUNNING, Status.COMMITTED, Status.DONE]
    assert pick.stand in ROOM.free_neighbours(ROOM.tables[ITS_TABLE])
    assert pick.driver.cell == pick.stand
    assert stage.candle()[2] > TABLE_TOP + 0.01

    place = Place(stage.navigator, CANDLE, BARE_TABLE)
    assert stage.run(place) == [Status.RUNNING, Status.COMMITTED, Status.DONE]
    assert place.stand in ROOM.free_neighbours(ROOM.tables[BARE_TABLE])
    np.testing.assert_allclose(stage.candle(), [*ROOM.position(ROOM.tables[BARE_TABLE]), TABLE_TOP], atol=0.01)


def test_the_hand_comes_in_when_the_base_is_moved_away_from_the_table(stage):
    pick = Pick(stage.navigator, CANDLE, ITS_TABLE)
    stage.run(pick, lambda: stage.robot.reached > 0.3)
    stage.physics.set_robot(np.array([*ROOM.position((1, 7)), 0.0]), stage.physics.arm_position())
    assert stage.run(pick, lambda: stage.robot.reached == 0.0, 3.0) == [Status.RUNNING]


def test_a_stairwell_is_blocked_for_as_long_as_wanted(stage):
    block = Block(stage.navigator, 0)
    assert block.cell == ROOM.stairwells[0]
    assert stage.run(block) == [Status.RUNNING, Status.DONE]
    for _ in range(100):
        assert stage.step(block) is Status.DONE
    x, y, yaw = stage.physics.base_position()
    stage.physics.set_robot(np.array([x + 0.3, y, yaw]), stage.physics.arm_position())  # as if it were pushed
    assert stage.step(block) is Status.RUNNING
    assert stage.run(block) == [Status.RUNNING, Status.DONE]


def test_a_table_that_children_surround_is_given_up(stage):
    """One child alone leaves other sides of it open."""
    around = ROOM.free_neighbours(ROOM.tables[ITS_TABLE])
    stage.others = [child(*centre(ROOM, cell)) for cell in around]
    assert len(around) == 4
    assert stage.run(Pick(stage.navigator, CANDLE, ITS_TABLE)) == [Status.RUNNING, Status.FAILED]
    assert GIVES_UP < stage.robot.now < 2 * GIVES_UP
    stage.others = stage.others[:1]
    assert stage.run(Pick(stage.navigator, CANDLE, ITS_TABLE))[-1] is Status.DONE


def beside_hand(stage: Stage, ahead: float, aside: float) -> None:
    """Has a child seen at the hand, or at the arm, wherever that is."""
    seen = stage.look()
    x, y = geometry.to_world((*hand_position(seen, ROBOT)[:2].tolist(), seen.base[2]), (ahead, aside))
    stage.others = [child(x, y)]


@pytest.mark.parametrize(("moment", "place"), [(0.5, (0.2, 0.0)), (1.5, (-0.2, 0.1)), (3.5, (0.0, 0.25))])
def test_a_hand_beside_which_a_child_stays_comes_back_at_a_creep(stage, moment, place):
    """It has come out, or gripped the candle, or is on its way back when the child comes."""
    stage.put_candle(*ROOM.position((2, 5)), CANDLE_RADIUS, np.pi / 2)
    retrieve = stage.retrieve()
    stage.run(retrieve, lambda: retrieve.status is Status.COMMITTED)  # which begins to reach out
    began = stage.robot.now
    stage.run(retrieve, lambda: stage.robot.now > began + moment)
    hand = []

    def haunt() -> bool:
        beside_hand(stage, *place)
        hand.append(hand_position(stage.look(), ROBOT))
        return stage.robot.reached == 0.0

    stage.run(retrieve, haunt, 7 * GIVES_UP)
    assert stage.robot.now - began > GIVES_UP
    speed = np.linalg.norm(np.diff(hand[25:], axis=0), axis=1) / TIMESTEP  # once it has come to rest
    assert 0.01 < speed.max() < 0.05


def test_a_candle_that_must_be_laid_down_stays_in_the_hand_beside_a_child_that_never_leaves(stage):
    stage.put_candle(*stage.candle()[:2], TABLE_TOP + CANDLE_HEIGHT, np.pi)  # on its head
    retrieve = stage.retrieve()
    stage.run(retrieve, lambda: retrieve.pitch_down is not None)
    began = stage.robot.now
    assert stage.run(retrieve, lambda: beside_hand(stage, 0.5, 0.0))[-1] is Status.FAILED
    assert GIVES_UP < stage.robot.now - began < 2 * GIVES_UP
    assert retrieve.still_holds(stage.look())
    again = stage.retrieve(pitch_down=retrieve.pitch_down)
    assert not again.status.interruptible
    stage.others = []
    assert stage.run(again) == [Status.COMMITTED, Status.RUNNING, Status.COMMITTED, Status.DONE]
    assert stage.candle()[2] > TABLE_TOP

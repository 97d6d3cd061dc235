"""What goes wrong, provoked in physics: missed grasps, fallen candles, places that are taken, changes of plan."""

import mujoco
import numpy as np
import pytest
from scripted_child import STAY, Scripted

from caregiver_mj import CaregiverPolicy, FloorPlan, load
from caregiver_mj.caregivers import Caregiver, Percept
from caregiver_mj.plans.cell_graph import ACTIONS
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.robot.embodiments import find_embodiment
from studies.audit import Recorder, check_limits, check_motion

ROOM = FloorPlan.parse("#########\n#B......#\n#..C....#\n#....T..#\n#.......#\n#########", "room")
TABLE_TOP, FLOOR = 0.60, 0.0  # metres
CANDLE_RADIUS = 0.022
OPEN_FLOOR = (-0.70, -1.05)  # in that room
MOVE = 84  # control steps of a novice timestep


class Scene:
    def __init__(self, seed: int = 0, plan: FloorPlan = ROOM, **task_kwargs):
        child = Scripted(plan, STAY)
        self.env = load("relocate_candle", plan, child, random=seed, task_kwargs=task_kwargs)
        self.policy = CaregiverPolicy(self.env)
        self.timestep = self.env.reset()
        self.physics, self.task = self.env.physics, self.env.task
        self.task.children[0].put(plan.free_cells[-1])
        self.touched: set[str] = set()  # by the robot, save candles

    def put_candle(self, x: float, y: float, z: float, tilt: float, heading: float, candle: int = 0) -> None:
        """Puts a candle somewhere at rest: its foot's middle, and its axis tilted towards a heading, in radians."""
        lean, turn, pose = np.empty(4), np.empty(4), np.empty(4)
        mujoco.mju_axisAngle2Quat(lean, np.array([0.0, 1.0, 0.0]), tilt)
        mujoco.mju_axisAngle2Quat(turn, np.array([0.0, 0.0, 1.0]), heading)
        mujoco.mju_mulQuat(pose, turn, lean)
        model, data = self.physics.model.ptr, self.physics.data.ptr
        joint = model.joint(f"candle_{candle}/joint")
        data.qpos[joint.qposadr[0] : joint.qposadr[0] + 7] = [x, y, z, *pose]
        data.qvel[joint.dofadr[0] : joint.dofadr[0] + 6] = 0.0
        mujoco.mj_forward(model, data)

    def push(self, force: tuple[float, float], candle: int = 0) -> None:
        data = self.physics.data.ptr
        body = self.physics.model.ptr.body(f"candle_{candle}/candle").id
        data.xfrc_applied[body] = [*force, 0.0, -0.07 * force[1], 0.07 * force[0], 0.0]
        self.run(5)
        data.xfrc_applied[body] = 0.0

    def run(self, steps: int, until=lambda: False) -> bool:
        """Runs for some control steps at most; returns whether the condition came true."""
        names = [self.physics.model.geom(i).name for i in range(self.physics.model.ngeom)]
        for _ in range(steps):
            self.timestep = self.env.step(self.act())
            for one, two in self.physics.data.contact.geom.tolist():
                for robot, other in ((names[one], names[two]), (names[two], names[one])):
                    if robot.startswith("robot/") and not other.startswith("candle_"):
                        self.touched.add(other)
            if until():
                return True
        return False

    def act(self) -> np.ndarray:
        return self.policy(self.timestep)

    def until_done(self, seconds: float = 60.0) -> bool:
        return self.run(round(50 * seconds), until=lambda: self.policy.executive.done > 0)

    def candle(self, candle: int = 0) -> np.ndarray:
        return self.physics.candle_poses()[candle, :3]


@pytest.fixture
def scene() -> Scene:
    return Scene()


def assert_relocated(scene: Scene) -> None:
    """The candle stands upright on its table, let go; the robot has touched nothing else, and struck nobody."""
    assert scene.task.is_placed(scene.physics)
    assert scene.physics.candle_upright()[0] > np.cos(np.radians(1))
    assert not scene.touched
    assert scene.task.outcome()["strikes"] == 0


def test_missed_grasp_is_noticed_and_tried_again(scene, monkeypatch):
    """The robot sees the candle beside where it is, until its fingers have closed on nothing."""
    sees_wrong = True
    fooled = 0

    def act() -> np.ndarray:
        nonlocal fooled
        observation = dict(scene.timestep.observation)
        if sees_wrong:
            observation["candle_position"] = observation["candle_position"] + [0.13, 0.0, 0.0]
            fooled += 1
        return scene.policy(scene.timestep._replace(observation=observation))

    monkeypatch.setattr(scene, "act", act)
    before = scene.candle()
    assert scene.run(3000, until=lambda: scene.physics.finger_position().sum() < 0.033)
    np.testing.assert_allclose(scene.candle(), before, atol=0.002)  # it stands where it stood
    sees_wrong = False
    closed = scene.physics.finger_position().sum()
    scene.run(10)
    assert scene.physics.finger_position().sum() > closed  # they open again, at once
    assert scene.until_done()
    assert fooled
    assert scene.policy.executive.begun == 1  # it did not begin anew, and had not given up
    assert_relocated(scene)


def test_a_candle_that_is_seen_late_is_not_taken_to_have_stayed_behind():
    scene = Scene(sensing={"delay": 0.3})
    opened = []
    assert scene.run(2000, until=scene.physics.is_gripping)
    scene.run(3000, until=lambda: opened.append(not scene.physics.is_gripping()) or scene.policy.executive.done)
    assert np.diff(opened).sum() == 1  # once, on the other table
    assert_relocated(scene)


def test_limits_are_kept_where_a_candle_is_not_quite_where_it_seems():
    """One finger meets it before the other one, and it stands on the table before it should."""
    scene = Scene(3, embodiment="mobile_ur5e", sensing={"candle": {"bias": 0.005}})
    with Recorder(scene.env) as recorder:
        assert scene.until_done()
    log, robot = recorder.log(), find_embodiment("mobile_ur5e")
    assert all(check.ratio <= 1.0 for check in (*check_limits(log, robot), *check_motion(log, robot)))
    assert_relocated(scene)


@pytest.mark.parametrize(("place", "heading"), [("floor", 100), ("table", 215)])
def test_candle_is_picked_up_from_where_it_lies(scene, place, heading):
    if place == "floor":
        scene.put_candle(*OPEN_FLOOR, FLOOR + CANDLE_RADIUS, np.pi / 2, np.radians(heading))
    else:
        scene.put_candle(*scene.candle()[:2], TABLE_TOP + CANDLE_RADIUS, np.pi / 2, np.radians(heading))
    assert scene.until_done()
    assert_relocated(scene)


def test_limits_are_kept_while_a_candle_is_taken_out_to_the_open_and_picked_up(scene):
    scene.put_candle(*scene.candle()[:2], TABLE_TOP + 0.16, np.pi, 0.0)  # on its head: two grips, in all directions
    with Recorder(scene.env) as recorder:
        assert scene.until_done()
    assert_relocated(scene)
    robot = find_embodiment()
    checks = check_limits(recorder.log(), robot)
    assert all(check.ratio <= 1.0 for check in checks)
    used = max(check.ratio for check in checks if check.name.startswith("arm acceleration"))
    assert used > 0.9 * robot.limits.arm.acceleration_share  # of what is planned for, most


@pytest.mark.parametrize("direction", [0, 120])
def test_candle_that_is_knocked_over_while_the_robot_comes_is_picked_up(scene, direction):
    scene.run(30)
    angle = np.radians(direction)
    scene.push((2.0 * np.cos(angle), 2.0 * np.sin(angle)))
    scene.run(10)
    assert not scene.task.is_standing(scene.physics, 0)
    assert scene.until_done()
    assert_relocated(scene)
    assert scene.task.outcome()["candles_dropped"] == 1


def test_candle_is_put_beside_what_stands_on_its_place():
    plan = FloorPlan.parse("#########\n#B......#\n#..C....#\n#....T..#\n#.C.....#\n#########", "room")
    scene = Scene(plan=plan)
    goal, other = scene.task.goal_candle, 1 - scene.task.goal_candle
    holds = lambda: scene.physics.is_gripping() and scene.candle(goal)[2] > TABLE_TOP + 0.2  # noqa: E731
    assert scene.run(1500, until=holds)
    place = scene.task.table_positions[scene.task.goal_table]
    scene.put_candle(*place, TABLE_TOP, 0.0, 0.0, candle=other)
    assert scene.until_done()
    assert scene.task.is_placed(scene.physics)
    assert scene.candle(other)[:2] == pytest.approx(place, abs=1e-3)  # not even touched
    assert 0.1 < np.hypot(*(scene.candle(goal)[:2] - place)) < 0.27
    assert not scene.touched


GALLERY = FloorPlan.parse(
    """
##################################
#B...............S...............#
#................................#
#................................#
#.T...........T..C...............#
#................................#
##################################
""".strip(),
    "gallery",
)


class Fetching(Caregiver):
    """Fetches the candle, and protects the stairwell once told to."""

    alarm = False

    def choose(self, percept: Percept) -> np.ndarray:
        fetched = percept.holding[0] != NOTHING or percept.candle_table[0, 0] != 2
        return np.array([0 if self.alarm else NOTHING if fetched else 1])


def test_candle_in_the_hand_is_put_on_a_nearer_table_if_that_saves_the_child():
    """The candle is on its way west, as far from the child as can be, when that heads for the stairs."""
    caregiver = Fetching(GALLERY)
    env = load("supervise", GALLERY, Scripted(GALLERY), random=0)
    policy, timestep = CaregiverPolicy(env, caregiver), env.reset()
    task, plan = env.task, GALLERY

    def put_child(cell: tuple[int, int], way: tuple[int, int]) -> None:
        (child,) = task.children
        child.behaviour.move = ACTIONS.index(way)
        child.put(cell)

    put_child((1, 32), (0, 1))  # into the wall
    while not policy.executive.done:
        carried = env.physics.is_gripping() and env.physics.candle_poses()[0, 2] > TABLE_TOP + 0.2
        if carried and not caregiver.alarm:
            caregiver.alarm = True
            put_child((1, 22), (0, -1))
        timestep = env.step(policy(timestep))
        assert not timestep.last()
    off = [np.hypot(*(env.physics.candle_poses()[0, :2] - plan.position(table))) for table in plan.tables]
    assert min(off[1:]) < 0.02  # the one that it came from is as safe
    assert task.is_standing(env.physics, 0)
    for _ in range(12 * MOVE):
        timestep = env.step(policy(timestep))
    # The child did come to the stairs, ...
    landing = plan.position(plan.stairwells[0])
    assert np.hypot(*(env.physics.toddler_position()[:2] - landing)) < 1.0
    assert np.hypot(*(env.physics.base_position()[:2] - landing)) < 0.03
    outcome = task.outcome()  # ... and was not hurt
    assert outcome["damage_stairwell"] == outcome["strikes"] == outcome["candles_dropped"] == 0


def test_grasp_that_fails_again_and_again_is_given_up(scene, monkeypatch):
    def act() -> np.ndarray:
        action = scene.policy(scene.timestep)
        action[10] = max(action[10], 0.030)  # the fingers do not close
        return action

    monkeypatch.setattr(scene, "act", act)
    # It cannot tell by its open fingers that it has nothing: what it lacks is a candle that comes along.
    assert scene.run(3000, until=lambda: scene.policy.activity == "keep out of the way")
    assert scene.task.is_standing(scene.physics, 0)
    assert scene.policy.executive.done == 0

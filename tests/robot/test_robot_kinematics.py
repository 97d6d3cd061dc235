"""The arm against its published data: limits, and forward kinematics multiplied out from the DH table."""

import mujoco
import numpy as np
import pytest
from robot_plans import first_way
from views import at_rest

from caregiver_mj.errors import CaregiverError
from caregiver_mj.robot.embodiments import EMBODIMENTS, find_embodiment
from caregiver_mj.robot.geometry import hand_rotation
from caregiver_mj.robot.kinematics import Arm, arm_of
from caregiver_mj.robot.reach import pick_up_path, reach_path, tray_path
from caregiver_mj.robot.robot_model import read_spec
from caregiver_mj.robot.skills.close import closing

ROBOT = find_embodiment("mobile_fr3")

# Franka Research 3, "Robot and interface specifications".
POSITION_LOWEST = [-2.7437, -1.7837, -2.9007, -3.0421, -2.8065, 0.5445, -3.0159]  # rad
POSITION_HIGHEST = [2.7437, 1.7837, 2.9007, -0.1518, 2.8065, 4.5169, 3.0159]
VELOCITY = [2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26]  # rad/s
ACCELERATION = 10.0  # rad/s^2
JERK = 5000.0  # rad/s^3
TORQUE = [87, 87, 87, 87, 12, 12, 12]  # Nm

# Its DH table in Craig's convention, and the flange: a (m), alpha (rad), d (m).
RIGHT_ANGLE = np.pi / 2
DH = [
    (0.0, 0.0, 0.333),
    (0.0, -RIGHT_ANGLE, 0.0),
    (0.0, RIGHT_ANGLE, 0.316),
    (0.0825, RIGHT_ANGLE, 0.0),
    (-0.0825, -RIGHT_ANGLE, 0.384),
    (0.0, RIGHT_ANGLE, 0.0),
    (0.088, RIGHT_ANGLE, 0.0),
]
MOUNT = (-0.06, 0.0, 0.27)  # metres, of the arm on the base
FLANGE, PINCH, HAND_TURN = 0.107, 0.1134, -np.pi / 4


def turn(axis: int, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.eye(4)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    return matrix


def shift(x: float, y: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def pinch_pose(q: np.ndarray) -> np.ndarray:
    """Pose (4, 4) of the pinch point in the frame of the base."""
    pose = shift(*MOUNT)
    for (a, alpha, d), angle in zip(DH, q, strict=True):
        pose = pose @ turn(0, alpha) @ shift(a, 0, 0) @ turn(2, angle) @ shift(0, 0, d)
    return pose @ shift(0, 0, FLANGE) @ turn(2, HAND_TURN) @ shift(0, 0, PINCH)


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return read_spec(ROBOT.model).compile()


@pytest.fixture(scope="module")
def arm() -> Arm:
    return Arm(ROBOT)


def test_limits_are_the_published_ones():
    limits = ROBOT.limits
    np.testing.assert_array_equal(limits.arm.velocity, VELOCITY)
    np.testing.assert_array_equal(limits.arm.acceleration, [ACCELERATION] * 7)
    np.testing.assert_array_equal(limits.arm.jerk, [JERK] * 7)
    assert pytest.approx(5000 / 3600) == limits.base_speed
    assert limits.base.velocity < limits.base_speed


def test_model_has_the_published_joint_ranges_and_torques(model):
    for i in range(7):
        name = f"joint{i + 1}"
        published = [POSITION_LOWEST[i], POSITION_HIGHEST[i]]
        np.testing.assert_array_equal(model.joint(name).range, published)
        np.testing.assert_allclose(model.actuator(name).ctrlrange, published, rtol=1e-12)
        np.testing.assert_array_equal(model.jnt_actfrcrange[model.joint(name).id], [-TORQUE[i], TORQUE[i]])


def test_model_agrees_with_the_dh_table(model, arm):
    data = mujoco.MjData(model)
    address = [model.joint(f"joint{i}").qposadr[0] for i in range(1, 8)]
    random = np.random.default_rng(0)
    for q in random.uniform(POSITION_LOWEST, POSITION_HIGHEST, size=(50, 7)):
        data.qpos[address] = q
        mujoco.mj_kinematics(model, data)
        pose = pinch_pose(q)
        np.testing.assert_allclose(data.site("pinch").xpos, pose[:3, 3], atol=1e-6)
        np.testing.assert_allclose(data.site("pinch").xmat.reshape(3, 3), pose[:3, :3], atol=1e-6)
        np.testing.assert_allclose(arm.pinch(q), pose[:3, 3], atol=1e-6)


@pytest.mark.parametrize(("x", "z"), [(0.42, 0.93), (0.70, 0.55), (0.75, 0.75)])
def test_inverse_kinematics_reaches_its_target(arm, x, z):
    q = arm.solve(x, z)
    pose = pinch_pose(q)
    np.testing.assert_allclose(pose[:3, 3], [x, 0.0, z], atol=1e-4)
    # 35 degrees down, fingers to the sides: the hand's axes, worked by hand.
    c, s = np.cos(np.radians(35)), np.sin(np.radians(35))
    np.testing.assert_allclose(pose[:3, 2], [c, 0, -s], atol=1e-4)
    np.testing.assert_allclose(pose[:3, 1], [0, -1, 0], atol=1e-4)
    assert (q > POSITION_LOWEST).all()
    assert (q < POSITION_HIGHEST).all()


@pytest.mark.parametrize(("x", "z"), [(2.0, 0.7), (0.7, 2.5), (0.7, -0.6)])
def test_goal_out_of_reach_is_refused(arm, x, z):
    with pytest.raises(CaregiverError, match=rf"cannot reach {x:.3f} m ahead at a height of {z:.3f} m"):
        arm.solve(x, z)
    with pytest.raises(CaregiverError, match="cannot reach"):
        reach_path(arm, 25000)
    assert first_way(arm, np.array([1.2, 0.0, 0.022]), hand_rotation(0.0, np.pi / 2)) is None


WAYS = {
    "table": lambda arm: reach_path(arm, 6200),
    "close": lambda arm: closing(arm).path,
    "pick up": lambda arm: next(filter(None, (pick_up_path(arm, ahead, 0.0) for ahead in (0.4, 0.5)))),
    "tray": tray_path,
}


@pytest.mark.parametrize("name", EMBODIMENTS)
@pytest.mark.parametrize("way", WAYS)
def test_between_two_poses_the_hand_is_as_quick_as_the_arm_may_be_there(name, way):
    embodiment, timestep = find_embodiment(name), 1e-3
    limits, path, robot = embodiment.limits.arm, WAYS[way](arm_of(embodiment)), at_rest(robot=embodiment)
    robot.reach_along(path)
    quick = []
    for pose in range(1, path.goal + 1):
        joints = [path.joints(robot.reached)] * 3
        for goal, until in ((pose, pose - 0.5), (pose - 1, pose - 0.7), (pose, pose)):  # it turns back once
            goes_out = goal == pose
            while robot.reached < until if goes_out else robot.reached > until:
                robot.reach(float(goal))
                for _ in range(20):
                    robot.now += timestep
                    joints.append(path.joints(robot.reached))
        rates = [np.diff(joints, order, axis=0) / timestep**order for order in (1, 2, 3)]
        assert (np.abs(rates[0]) <= limits.velocity_at(np.array(joints[1:]), rates[0])).all()
        assert (np.abs(rates[1]) <= limits.acceleration).all()
        assert (np.abs(rates[2]) <= limits.jerk).all()
        quick.append((np.abs(rates[1]) / limits.acceleration).max() > 0.95 * limits.acceleration_share)
    gently = range(2, closing(arm_of(embodiment)).pushed) if way == "close" else ()
    assert quick == [line not in gently for line in range(path.goal)]


@pytest.mark.parametrize("goal", [0.0, 1.0, 4.0])
def test_a_hand_that_would_pass_a_pose_without_a_stop_is_refused(arm, goal):
    robot = at_rest()
    robot.reach_along(closing(arm).path)
    for pose in (1.0, 2.0, 2.5):
        robot.reach(pose)
        robot.now = robot.reach_arrival
    with pytest.raises(CaregiverError, match=f"got {goal:g}: stop at every pose"):
        robot.reach(goal)
    robot.reach(2.0)
    robot.now = robot.reach_arrival
    robot.reach(1.0)


@pytest.mark.parametrize(
    ("name", "moved"),
    [
        ("mobile_fr3", {1: 1.1, 3: -2.6}),  # leans forward, folded: the forearm is in the base
        ("mobile_ur5e", {1: 1.2}),  # the upper arm leans down on the base
        ("mobile_ur5e", {2: -3.1}),  # the elbow is folded up: the hand is in the upper arm
    ],
)
def test_an_arm_knows_when_it_comes_near_the_robot_itself(name, moved):
    arm = Arm(find_embodiment(name))
    assert arm.clears_itself(arm.tucked)
    assert arm.clears_itself(reach_path(arm, 7000).joints(1.0))
    folded = arm.tucked.copy()
    folded[list(moved)] = list(moved.values())
    assert not arm.clears_itself(folded)

"""Robots by name: what is read from their models, and that each can do what the skills will ask of it."""

import dataclasses
import importlib.metadata
import re

import mujoco
import numpy as np
import pytest
from reaching import first_way

from caregiver_mj.errors import CaregiverError
from caregiver_mj.house.scene import build_house
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import CANDLE, MUG
from caregiver_mj.robot.embodiment import Embodiment, Wheels
from caregiver_mj.robot.embodiments import DEFAULT, EMBODIMENTS, find_embodiment
from caregiver_mj.robot.geometry import hand_rotation, upright_grip
from caregiver_mj.robot.kinematics import Arm, arm_of
from caregiver_mj.robot.reach import reach_path
from caregiver_mj.robot.robot_model import RobotModel, own_model, read_spec
from caregiver_mj.robot.scalar_motion import ScalarMotion

NAMES = tuple(EMBODIMENTS)
CHILD_HEIGHT = 0.80  # metres

RIGHT_ANGLE = np.pi / 2
# Universal Robots, "DH Parameters for calculations of kinematics and dynamics", UR5e: a (m), d (m), alpha (rad).
UR5E = [
    (0.0, 0.1625, RIGHT_ANGLE),
    (-0.425, 0.0, 0.0),
    (-0.3922, 0.0, 0.0),
    (0.0, 0.1333, RIGHT_ANGLE),
    (0.0, 0.0997, -RIGHT_ANGLE),
    (0.0, 0.0996, 0.0),
]


@pytest.fixture(scope="module", params=NAMES)
def robot(request) -> Embodiment:
    return find_embodiment(request.param)


@pytest.fixture(scope="module")
def arm(robot) -> Arm:
    return arm_of(robot)


@pytest.fixture(scope="module")
def model(robot) -> mujoco.MjModel:
    return read_spec(robot.model).compile()


def pose_of_hand(robot: Embodiment, model: mujoco.MjModel, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,) and rotation (3, 3) of the pinch point, base frame."""
    data = mujoco.MjData(model)
    data.qpos[[model.joint(name).qposadr[0] for name in robot.names.arm]] = joints
    mujoco.mj_kinematics(model, data)
    site = data.site("pinch")
    return site.xpos.copy(), site.xmat.reshape(3, 3).copy()


# -- By name -------------------------------------------------------------------------------------------


def test_there_are_two_robots_and_a_default():
    assert (NAMES[:2], DEFAULT) == (("mobile_fr3", "mobile_ur5e"), "mobile_fr3")
    assert find_embodiment() is find_embodiment(DEFAULT)
    assert find_embodiment(find_embodiment("mobile_ur5e")) is find_embodiment("mobile_ur5e")


def make_another() -> Embodiment:
    return dataclasses.replace(find_embodiment("mobile_ur5e"), name="another")


def make_nothing() -> str:
    return "nothing"


def needs_more(size: float) -> Embodiment:
    return dataclasses.replace(make_another(), footprint=size)


not_a_maker = "neither"


def test_robots_of_other_packages(monkeypatch):
    group = "caregiver_mj.embodiments"
    offered = importlib.metadata.EntryPoints(
        importlib.metadata.EntryPoint(name, f"{__name__}:{name}", group)
        for name in ("make_another", "make_nothing", "not_a_maker")
    )
    monkeypatch.setattr(importlib.metadata, "entry_points", lambda **which: offered.select(**which))
    assert find_embodiment("make_another").name == "another"
    assert "make_another" in EMBODIMENTS
    assert find_embodiment(f"{__name__}:make_another").name == "another"
    with pytest.raises(CaregiverError, match="'make_nothing' must be an Embodiment, got str"):
        find_embodiment("make_nothing")
    with pytest.raises(CaregiverError, match=r"'not_a_maker' .* must be a function that makes an Embodiment"):
        find_embodiment("not_a_maker")
    with pytest.raises(CaregiverError, match=r"robot '.*:needs_more' cannot be called with \(\): missing"):
        find_embodiment(f"{__name__}:needs_more")


def test_model_without_a_joint_or_with_actuators_in_another_order_is_refused():
    names = dataclasses.replace(find_embodiment().names, arm=("joint1", "joint8"))
    with pytest.raises(CaregiverError, match=r"robot mobile_fr3\.xml must have joint joint8, got base_x"):
        RobotModel(own_model("mobile_fr3"), names)
    names = dataclasses.replace(find_embodiment().names, base=("base_y", "base_x", "base_yaw"))
    with pytest.raises(CaregiverError, match=r"must be in the order of base_y, base_x, base_yaw"):
        RobotModel(own_model("mobile_fr3"), names).actuators()


# -- What is read from the model ------------------------------------------------------------------------


def test_layout_is_that_of_the_actuators(robot, model):
    driven = np.array([model.joint(int(joint)).name for joint in model.actuator_trnid[:, 0]])
    assert robot.layout.size == robot.actuators.size - 1 == len(robot.names.arm) + 4  # two fingers are one number
    assert tuple(driven[robot.actuators.base]) == robot.names.base
    assert tuple(driven[robot.actuators.arm]) == robot.names.arm
    assert tuple(driven[robot.actuators.gripper]) == robot.names.fingers
    assert robot.actuators.size == model.nu


def test_sides_wheels_and_sizes_are_read_from_their_models():
    assert find_embodiment("mobile_fr3").sides == (0.0, 0.0)
    assert find_embodiment("mobile_ur5e").sides == (0.205, 0.205)
    assert find_embodiment("mobile_fr3").rounding == find_embodiment("mobile_fr3").footprint == pytest.approx(0.27)
    assert find_embodiment("mobile_ur5e").footprint == pytest.approx(0.205 * np.sqrt(2))
    assert find_embodiment("mobile_ur5e").rounding == pytest.approx(0.0)
    # Wheels are read from the model.
    places = ((0.155, 0.175), (0.155, -0.175), (-0.155, 0.175), (-0.155, -0.175))
    assert find_embodiment("mobile_fr3").wheels == Wheels(radius=0.075, lever=0.33, places=places)
    diagonal = find_embodiment("mobile_ur5e").wheels
    assert (diagonal.radius, diagonal.lever) == (pytest.approx(0.065 * np.sqrt(2)), pytest.approx(0.296))
    # Sizes of candle and furniture are read from their models.
    assert (layout.CANDLE_RADIUS, layout.CANDLE_HEIGHT, layout.CHILD_RADIUS) == (0.022, 0.16, 0.12)
    assert (layout.TABLE_HALF_SIZE, layout.TABLE_HEIGHT, layout.BIN_HALF_SIZE) == (0.27, 0.60, 0.22)


@pytest.mark.parametrize("motion", [(0.4, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 1.2), (0.3, -0.2, 0.7)])
def test_wheels_roll_without_slipping(robot, model, motion):
    """The hub moves, along the way of the wheel, as fast as its rim turns; across it rollers take up the rest."""
    ahead, aside, turn = motion
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for name, rate in zip(robot.names.wheels, robot.wheels.rates(ahead, aside, turn), strict=True):
        joint = model.joint(name)
        body = int(joint.bodyid[0])
        x, y, radius = *data.xpos[body, :2], model.geom_size[model.body_geomadr[body], 0]
        hub = np.array([ahead - turn * y, aside + turn * x])
        axis = data.xmat[body].reshape(3, 3) @ joint.axis
        way = np.array([axis[1], -axis[0]])
        # What a roller does not give way to: along a diagonal for mecanum wheels, along the wheel's way for others.
        diagonal = np.array([1.0, -1.0 if x * y > 0 else 1.0]) / np.sqrt(2)
        roller = diagonal if robot.name == "mobile_fr3" else way
        assert hub @ roller == pytest.approx(rate * radius * (way @ roller), abs=1e-6)


def test_lags_follow_from_mass_and_gain():
    robot = find_embodiment("mobile_ur5e")
    mass = read_spec(robot.model).compile().body("base").subtreemass[0]
    assert robot.servos.base_lag == pytest.approx(mass / 5000.0, rel=1e-6)
    fr3 = find_embodiment("mobile_fr3")
    lag = RobotModel(fr3.model, fr3.names).lag("base_x", fr3.bends.tucked)
    assert fr3.servos.base_lag == pytest.approx(lag, rel=0.02)


def test_servos_and_force_allow_what_is_planned(robot, model):
    limits, ranges = robot.limits, model.actuator_ctrlrange
    top = 0.998 * limits.base_speed
    assert (np.abs(ranges[robot.actuators.base][:2]) >= top - 1e-9).all()
    assert (np.abs(ranges[robot.actuators.base][2]) > limits.yaw.velocity).all()
    assert (ranges[robot.actuators.gripper][:, 1] >= robot.grasp.open).all()
    assert limits.base.velocity < limits.base_speed
    assert limits.gripper.velocity < limits.finger_speed
    assert limits.yaw_gentle.velocity < limits.yaw.velocity
    # Force of the base is enough for its acceleration.
    force = model.actuator_forcerange[robot.actuators.base][0, 1]
    assert force > 1.2 * model.body("base").subtreemass[0] * robot.limits.base.acceleration


# -- What each robot can do ------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "radius", "room"), [(CANDLE, 0.022, 0.014), (MUG, 0.028, 0.011)])
def test_fingers_open_wide_and_close_on_what_is_carried(robot, model, kind, radius, room):
    thing, widest = layout.thing(kind), model.actuator_ctrlrange[robot.actuators.gripper][:, 1]
    assert radius + room <= robot.grasp.opened(thing) < widest.min()
    assert 0.0 < robot.grasp.squeezed(thing) < radius - 0.009


def test_fingers_stand_as_far_off_the_middle_as_their_joints_say(robot, model, arm):
    data = mujoco.MjData(model)
    data.qpos[[model.joint(name).qposadr[0] for name in robot.names.arm]] = arm.tucked
    data.qpos[[model.joint(name).qposadr[0] for name in robot.names.fingers]] = 0.03
    mujoco.mj_kinematics(model, data)
    pads = [i for i in range(model.ngeom) if model.geom(i).name.endswith("_pad")]
    assert len(pads) == 2
    middle, thickness = data.geom_xpos[pads].mean(axis=0), 2 * model.geom_size[pads[0], 1]
    np.testing.assert_allclose(middle, data.site("pinch").xpos, atol=1e-6)
    across = data.geom_xpos[pads[0]] - data.geom_xpos[pads[1]]
    assert np.linalg.norm(across) == pytest.approx(0.06 + thickness, abs=1e-6)
    assert abs(across[2]) < 1e-4


@pytest.mark.parametrize("height", [0.62, 0.75])
def test_hand_reaches_the_grasp_pose(robot, arm, model, height):
    position, rotation = pose_of_hand(robot, model, reach_path(arm, round(1e4 * height)).joints(1.0))
    np.testing.assert_allclose(position, [robot.postures.reach, 0.0, height], atol=1e-4)
    np.testing.assert_allclose(rotation, hand_rotation(0.0, robot.postures.hand_pitch), atol=1e-4)


def test_hand_keeps_its_pitch_and_plane_all_the_way(robot, arm, model):
    path = reach_path(arm, 7000)
    for s in np.linspace(0.0, 1.0, 41):
        position, rotation = pose_of_hand(robot, model, path.joints(s))
        assert abs(position[1]) < 1e-3
        np.testing.assert_allclose(rotation, hand_rotation(0.0, robot.postures.hand_pitch), atol=2e-3)


def test_reach_is_within_the_published_limits(robot, arm):
    path, limits = reach_path(arm, 7000), robot.limits.arm
    motion = ScalarMotion(path.limits, 0.0)
    motion.move_to(1.0, 0.0)
    joints = np.array([path.joints(motion.at(time)[0]) for time in np.arange(0.0, 1.5, 1e-3)])
    rates = [np.abs(np.diff(joints, order, axis=0)).max(axis=0) * 1e3**order for order in (1, 2, 3)]
    for rate, limit in zip(rates, (limits.velocity, limits.acceleration, limits.jerk), strict=True):
        assert (rate <= limit).all()
    assert ((joints >= arm.ranges[0]) & (joints <= arm.ranges[1])).all()


def test_carried_candle_passes_over_a_child_and_within_the_clearances(robot, arm):
    ahead, height = robot.postures.carry
    assert height - max(CANDLE.grip, MUG.grip) > CHILD_HEIGHT
    np.testing.assert_allclose(arm.pinch(arm.tucked), [ahead, 0.0, height], atol=1e-4)
    out = ahead + layout.CANDLE_RADIUS
    assert out + 0.02 < robot.clearances.turning
    assert out + layout.CHILD_RADIUS - 0.01 < robot.clearances.child_turning
    assert out > robot.footprint


@pytest.mark.parametrize("height", [0.028, 0.628])
# At -120 degrees the first way that mobile_fr3's arm finds, nearest to the usual pose, is too slow.
@pytest.mark.parametrize("heading", [-180, -120, -45, 90])
def test_lying_candle_is_gripped_such_that_it_stands_in_the_tucked_hand(robot, arm, model, heading, height):
    axis = np.array([np.cos(np.radians(heading)), np.sin(np.radians(heading)), 0.0])
    grip = upright_grip(axis, robot.postures.hand_pitch)
    for ahead in robot.postures.lying_reaches:  # at one of these distances
        point = np.array([ahead, 0.0, height])
        if path := first_way(arm, point, grip):
            break
    assert path.limits.velocity > 0.25  # next to the end of a joint's range it would take minutes
    position, grip = pose_of_hand(robot, model, path.joints(2.0))
    np.testing.assert_allclose(position, point, atol=1e-4)
    tucked = pose_of_hand(robot, model, path.joints(0.0))[1]
    np.testing.assert_allclose(tucked @ grip.T @ axis, [0, 0, 1], atol=1e-3)


@pytest.mark.parametrize(("kind", "yaw"), [(CANDLE, 0.0), *((MUG, yaw) for yaw in np.arange(0.0, 2 * np.pi, 0.5))])
def test_hand_out_over_a_table_touches_nothing(robot, arm, kind, yaw):
    """Neither the table on which a thing stands nor that, wherever its handle is, from the tucked arm to the grasp."""
    plan = FloorPlan.parse(f"#######\n#.....#\n#B.{kind.symbol}..#\n#.....#\n#....T#\n#######", "room")
    model = build_house(plan, robot).compile()
    data = mujoco.MjData(model)
    row = model.joint(f"{kind}_0/joint").qposadr[0]
    data.qpos[row + 3 : row + 7] = np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)
    x, y, z = data.qpos[row:][:3]
    parts = (*robot.names.base, *robot.names.arm, *robot.names.fingers)
    joint = {name: model.joint(f"robot/{name}").qposadr[0] for name in parts}
    data.qpos[model.joint("toddler/x").qposadr[0]] = 100.0
    base = (x, y - robot.postures.reach, RIGHT_ANGLE)  # it looks north
    data.qpos[[joint[name] for name in robot.names.base]] = base
    data.qpos[[joint[name] for name in robot.names.fingers]] = robot.grasp.opened(layout.thing(kind))
    path = reach_path(arm, round(1e4 * (z + kind.grip)))
    for s in np.linspace(0.0, 1.0, 31):
        data.qpos[[joint[name] for name in robot.names.arm]] = path.joints(s)
        mujoco.mj_forward(model, data)
        names = [{model.geom(int(i)).name for i in pair} for pair in data.contact.geom]
        assert not [pair for pair in names if any(name.startswith("robot/") for name in pair)], s


def test_published_kinematics_of_the_six_axis_arm():
    robot = find_embodiment("mobile_ur5e")
    model = read_spec(robot.model).compile()
    reach = 0.155  # metres from the flange to the pinch point
    for q in np.random.default_rng(0).uniform(-np.pi, np.pi, (30, 6)):
        pose = np.eye(4)
        pose[:3, 3], pose[0, 0], pose[1, 1] = (0.0, -0.1333, 0.45), -1.0, -1.0  # where the arm stands, turned round
        for (a, d, alpha), angle in zip(UR5E, q, strict=True):
            c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
            link = [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
            pose = pose @ np.array(link)
        position, rotation = pose_of_hand(robot, model, q)
        np.testing.assert_allclose(position, pose[:3, 3] + reach * pose[:3, 2], atol=1e-6)
        np.testing.assert_allclose(rotation[:, 2], pose[:3, 2], atol=1e-6)


def test_published_limits_of_the_six_axis_arm():
    robot = find_embodiment("mobile_ur5e")
    model = read_spec(robot.model).compile()
    np.testing.assert_allclose(robot.limits.arm.velocity, np.radians(180.0))
    for i, name in enumerate(robot.names.arm):
        turn = np.pi if name == "elbow" else 2 * np.pi
        np.testing.assert_allclose(model.joint(name).range, [-turn, turn], atol=1e-6)
        torque = 150.0 if i < 3 else 28.0
        np.testing.assert_array_equal(model.jnt_actfrcrange[model.joint(name).id], [-torque, torque])


def test_models_are_stable_under_noise(robot):
    """Menagerie's habit: a second of random controls, and no warning."""
    model = build_house(FloorPlan.load("paper"), robot).compile()
    data = mujoco.MjData(model)
    random = np.random.default_rng(0)
    low, high = model.actuator_ctrlrange.T
    for _ in range(50):
        data.ctrl[:] = random.uniform(low, high)
        mujoco.mj_step(model, data, 4)
    assert not any(warning.number for warning in data.warning)


def test_arm_is_not_jerked_when_its_motors_come_to_their_limit(robot, arm):
    """With a hand a little lower than it places candles, joint 6 of the seven-axis arm is at its limit on the way."""
    model = build_house(FloorPlan.load("paper"), robot).compile()
    data, path = mujoco.MjData(model), reach_path(arm, 6400)
    joints = [model.joint(f"robot/{name}") for name in robot.names.arm]
    dofs = [joint.dofadr[0] for joint in joints]
    data.qpos[[joint.qposadr[0] for joint in joints]] = data.ctrl[robot.actuators.arm] = arm.tucked
    data.qpos[[model.joint(f"robot/{name}").qposadr[0] for name in robot.names.base[:2]]] = 3.0  # clear of the walls
    mujoco.mj_step(model, data, 100)
    reach, step, before = ScalarMotion(path.limits, 0.0), model.opt.timestep, data.qvel[dofs].copy()
    reach.move_to(1.0, 0.0)
    for i in range(round(reach.arrival / step)):
        data.ctrl[robot.actuators.arm] = path.joints(reach.at(i * step)[0])
        mujoco.mj_step(model, data)
        assert (np.abs(data.qvel[dofs] - before) < robot.limits.arm.acceleration * step).all()
        assert (np.abs(data.qfrc_actuator[dofs]) < robot.torque + 1e-9).all()
        before = data.qvel[dofs].copy()


def test_every_part_of_a_model_has_a_name(robot):
    spec = read_spec(robot.model)
    parts = [*spec.bodies, *spec.joints, *spec.geoms, *spec.actuators, *spec.sites, *spec.cameras, *spec.materials]
    assert all(re.fullmatch(r"[a-z0-9_]+", part.name) for part in parts)

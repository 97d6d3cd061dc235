"""Robots by name, and that each can do what the skills will ask of it."""

import mujoco
import numpy as np
import pytest
from robot_plans import first_way

from caregiver_mj import FloorPlan
from caregiver_mj.house.scene import build_house
from caregiver_mj.plans import layout
from caregiver_mj.plans.hazards import CANDLE, MUG
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.embodiments import EMBODIMENTS, find_embodiment
from caregiver_mj.robot.geometry import hand_rotation, upright_grip
from caregiver_mj.robot.kinematics import Arm, arm_of
from caregiver_mj.robot.reach import reach_path
from caregiver_mj.robot.robot_model import read_spec

NAMES = tuple(EMBODIMENTS)
RIGHT_ANGLE = np.pi / 2


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


@pytest.mark.parametrize("motion", [(0.4, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 1.2), (0.3, -0.2, 0.7)])
def test_wheels_turn_to_where_their_hubs_go(robot, model, motion):
    ahead, aside, turn = motion
    data = mujoco.MjData(model)
    rows = [model.joint(name).qposadr[0] for name in robot.names.wheels]
    for _ in range(50):
        data.qpos[rows] += 0.02 * np.array(robot.wheels.steer(data.qpos[rows].tolist(), ahead, aside, turn))
    mujoco.mj_kinematics(model, data)
    for name in robot.names.wheels:
        body = int(model.joint(name).bodyid[0])
        x, y, _ = data.xpos[body]
        hub = np.array([ahead - turn * y, aside + turn * x, 0.0])
        axle = data.geom_xmat[model.body_geomadr[body]].reshape(3, 3)[:, 2]  # of its tyre, a cylinder
        assert abs(hub @ axle) < 1e-6
        assert data.xpos[body, 2] == pytest.approx(model.geom_size[model.body_geomadr[body], 0])  # it is on the floor
    assert robot.wheels.steer([0.3] * 4, 0.0, 0.0, 0.0) == [0.0] * 4


@pytest.mark.parametrize(("kind", "radius", "room"), [(CANDLE, 0.022, 0.014), (MUG, 0.028, 0.011)])
def test_fingers_open_wide_and_close_on_what_is_carried(robot, model, kind, radius, room):
    thing, widest = layout.thing(kind), model.actuator_ctrlrange[robot.actuators.gripper][:, 1]
    assert radius + room <= robot.grasp.opened(thing) < widest.min()
    assert 0.0 < robot.grasp.squeezed(thing) < radius - 0.009


@pytest.mark.parametrize("height", [0.62, 0.75])
def test_hand_reaches_the_grasp_pose(robot, arm, model, height):
    position, rotation = pose_of_hand(robot, model, reach_path(arm, round(1e4 * height)).joints(1.0))
    np.testing.assert_allclose(position, [robot.postures.reach, 0.0, height], atol=1e-4)
    np.testing.assert_allclose(rotation, hand_rotation(0.0, robot.postures.hand_pitch), atol=1e-4)


@pytest.mark.parametrize(("height", "heading"), [(0.028, -180), (0.628, -120), (0.028, 90)])
# At -120 degrees the first way that mobile_fr3's arm finds, nearest to the usual pose, is too slow.
def test_lying_candle_is_gripped_such_that_it_stands_in_the_tucked_hand(robot, arm, model, heading, height):
    axis = np.array([np.cos(np.radians(heading)), np.sin(np.radians(heading)), 0.0])
    grip = upright_grip(axis, robot.postures.hand_pitch)
    for ahead in robot.postures.lying_reaches:  # at one of these distances
        point = np.array([ahead, 0.0, height])
        if path := first_way(arm, point, grip):
            break
    assert path.limits(0, path.goal).velocity > 0.25  # next to the end of a joint's range it would take minutes
    position, grip = pose_of_hand(robot, model, path.joints(2.0))
    np.testing.assert_allclose(position, point, atol=1e-4)
    tucked = pose_of_hand(robot, model, path.joints(0.0))[1]
    np.testing.assert_allclose(tucked @ grip.T @ axis, [0, 0, 1], atol=1e-3)


@pytest.mark.parametrize(("kind", "yaw"), [(CANDLE, 0.0), *((MUG, yaw) for yaw in (0.0, 2.0, 4.0))])
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

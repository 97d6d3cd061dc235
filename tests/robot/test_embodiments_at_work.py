"""What every robot must do in the house: be there under its names, and take a candle from table to table."""

import numpy as np
import pytest

import caregiver_mj
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.embodiments import DEFAULT, EMBODIMENTS, find_embodiment
from caregiver_mj.robot.kinematics import arm_of

SMALL = FloorPlan.parse("#######\n#B....#\n#..C..#\n#.....#\n#.S..T#\n#######", "small")
TABLE_TOP = 0.60  # metres


@pytest.fixture(scope="module", params=tuple(EMBODIMENTS))
def env(request):
    return caregiver_mj.load("relocate_candle", SMALL, 0.5, random=2, task_kwargs={"embodiment": request.param})


def test_task_and_house_have_the_robot_of_that_name(env):
    robot = env.task.embodiment
    assert robot is find_embodiment(robot.name)
    assert env.physics.embodiment is robot
    joints = {env.physics.model.ptr.joint(i).name for i in range(env.physics.model.ptr.njnt)}
    assert {f"robot/{name}" for name in (*robot.names.base, *robot.names.arm, *robot.names.fingers)} <= joints


def test_action_is_named_and_bounded_as_the_robot_is_built(env):
    robot, spec, model = env.task.embodiment, env.action_spec(), env.physics.model.ptr
    assert spec.name.split("\t") == [*robot.names.base, *robot.names.arm, "gripper"]
    assert spec.shape == (robot.layout.size,) == (len(robot.names.arm) + 4,)
    for name, low, high in zip(spec.name.split("\t")[:-1], spec.minimum, spec.maximum, strict=False):
        np.testing.assert_array_equal([low, high], model.actuator(f"robot/{name}").ctrlrange)
    assert spec.minimum[-1] <= robot.grasp.closed < robot.grasp.open <= spec.maximum[-1]


def test_observation_is_as_long_as_the_arm_has_joints(env):
    robot, observation = env.task.embodiment, env.reset().observation
    assert observation["arm_position"].shape == observation["arm_velocity"].shape == (len(robot.names.arm),)
    assert observation["finger_position"].shape == (2,)
    np.testing.assert_allclose(observation["arm_position"], arm_of(robot).tucked)
    np.testing.assert_allclose(observation["finger_position"], robot.grasp.open)


def test_every_number_of_an_action_goes_to_its_actuators(env):
    physics = env.physics
    env.reset()
    spec = env.action_spec()
    action = np.random.RandomState(0).uniform(spec.minimum, spec.maximum)
    physics.set_action(action)
    np.testing.assert_array_equal(physics.control()[:-2], action[:-1])
    np.testing.assert_array_equal(physics.control()[-2:], action[-1])


def test_wheels_roll_as_the_base_moves(env):
    robot, physics = env.task.embodiment, env.physics
    env.reset()
    x, y, _ = physics.base_position()
    physics.set_robot(np.array([x, y, np.pi / 2]))
    joints = [physics.model.ptr.joint(f"robot/{name}").dofadr[0] for name in (*robot.names.base, *robot.names.wheels)]
    physics.data.qvel[joints[:3]] = 0.1, 0.4, 0.5  # it looks north
    physics.set_action(np.zeros(robot.layout.size))
    np.testing.assert_allclose(physics.data.qvel[joints[3:]], robot.wheels.rates(0.4, -0.1, 0.5))


def test_copy_of_a_simulation_has_the_same_robot(env):
    env.reset()
    copied = env.physics.copy(share_model=True)
    assert copied.embodiment is env.physics.embodiment
    np.testing.assert_array_equal(copied.arm_position(), env.physics.arm_position())


@pytest.mark.parametrize("symbol", ["C", "M"])
def test_candles_and_mugs_are_taken_from_table_to_table(env, symbol):
    """Judged by the physics: it stands upright on the right table, let go, and nobody was struck."""
    if symbol != "C":
        house, kwargs = FloorPlan.parse(SMALL.text.replace("C", symbol)), {"embodiment": env.task.embodiment}
        env = caregiver_mj.load("relocate_candle", house, 0.5, random=2, task_kwargs=kwargs, visuals=False)
    policy = caregiver_mj.CaregiverPolicy(env)
    step, physics, task = env.reset(), env.physics, env.task
    while not policy.interventions_done:
        step = env.step(policy(step))
        assert not step.last(), policy.activity
    for _ in range(50):
        step = env.step(policy(step))
    place = physics.candle_poses()[task.goal_candle, :3]
    np.testing.assert_allclose(place, [*task.table_positions[task.goal_table], TABLE_TOP], atol=0.01)
    assert physics.candle_upright()[task.goal_candle] > np.cos(np.radians(2.0))
    assert not physics.is_gripping()
    assert task.outcome()["strikes"] == task.outcome()["candles_dropped"] == 0


def test_default_robot_is_the_one_without_a_name():
    assert caregiver_mj.load("supervise", SMALL, 0.5, random=0).task.embodiment is find_embodiment(DEFAULT)


def test_robot_can_be_left_out_whichever_it_is():
    kwargs = {"robot": False, "embodiment": "mobile_ur5e"}
    env = caregiver_mj.load("supervise", SMALL, 0.5, random=0, task_kwargs=kwargs)
    assert env.action_spec().shape == (0,)
    assert env.physics.embodiment is None
    assert not env.physics.has_robot


def test_unknown_robot_is_refused_in_one_line():
    with pytest.raises(
        CaregiverError, match=r"^no robot 'butler': there are mobile_fr3, mobile_ur5e, and yours as module:object$"
    ):
        caregiver_mj.load("supervise", SMALL, 0.5, random=0, task_kwargs={"embodiment": "butler"})

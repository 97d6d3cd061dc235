"""The robot at work, judged by contacts, poses and speeds at every physics step, not by what the skills say."""

import numpy as np
import pytest
from scripted_child import Scripted

from caregiver_mj import CaregiverPolicy, FloorPlan, load
from caregiver_mj.house.physics import Physics
from caregiver_mj.plans.cell_graph import ACTIONS
from caregiver_mj.robot.embodiments import EMBODIMENTS
from studies.audit import each_physics_step

SMALL = FloorPlan.parse("#######\n#B....#\n#..C..#\n#.....#\n#.S..T#\n#######", "small")
TABLE_TOP = 0.60  # metres
MAX_BASE_SPEED = 5.0 / 3.6  # m/s
BASE_RADIUS = 0.27  # metres
CANDLE_BODY_MASS = 0.25  # kg


class Recorder:
    """Keeps of every physics step the base's velocity, a candle's pose and velocity, and how many fingers touch it.

    And of the whole episode the pairs of the robot's geoms and of what these touched.
    """

    def __init__(self, physics: Physics, candle: int | None):
        self._model, self._data = physics.model.ptr, physics.data.ptr
        names = [self._model.geom(i).name for i in range(self._model.ngeom)]
        self._robot = {i for i, name in enumerate(names) if name.startswith("robot/")}
        self._names = names
        self._base = [self._model.joint(f"robot/base_{axis}").dofadr[0] for axis in "xy"]
        self._wax = names.index(f"candle_{candle}/wax") if candle is not None else -1
        if candle is not None:
            joint = self._model.joint(f"candle_{candle}/joint")
            self._candle = joint.qposadr[0], joint.dofadr[0]
        self._pads = {names.index(f"robot/finger_{side}_pad") for side in ("left", "right")}
        self.touches: set[tuple[str, str]] = set()
        self.base, self.candle, self.candle_velocity, self.pads = [], [], [], []

    def keep(self) -> None:
        data = self._data
        self.base.append(data.qvel[self._base])
        pads = set()
        for one, two in data.contact.geom.tolist():
            if one in self._robot or two in self._robot:
                robot, other = (one, two) if one in self._robot else (two, one)
                self.touches.add((self._names[robot], self._names[other]))
                if other == self._wax and robot in self._pads:
                    pads.add(robot)
        self.pads.append(len(pads))
        if self._wax >= 0:
            q, v = self._candle
            self.candle.append(data.qpos[q : q + 7].copy())
            self.candle_velocity.append(data.qvel[v : v + 3].copy())

    def candle_tilt(self) -> np.ndarray:
        """Degrees between the candle's axis and the vertical, (steps,)."""
        x, y = np.array(self.candle)[:, 4:6].T
        return np.degrees(2 * np.arcsin(np.minimum(np.hypot(x, y), 1.0)))


@pytest.fixture(scope="module")
def relocation():
    """An episode of relocate_candle to three seconds after the candle was put down."""
    env = load("relocate_candle", "paper", epsilon=0.5, random=1)
    policy = CaregiverPolicy(env)
    step = env.reset()
    recorder = Recorder(env.physics, env.task.goal_candle)
    with pytest.MonkeyPatch.context() as monkeypatch, each_physics_step(env.physics, recorder.keep):

        def forbidden(*_):
            raise AssertionError("a candle was moved by hand")

        monkeypatch.setattr(type(env.physics), "set_candle", forbidden)
        monkeypatch.setattr(type(env.physics), "set_robot", forbidden)
        left = 150
        while left and not step.last():
            step = env.step(policy(step))
            left -= policy.executive.done > 0
    assert left == 0, "the candle was not put down in time"
    return env, recorder, step


def test_a_candle_is_carried_upright_between_two_fingers_and_ends_in_the_middle_of_the_table_let_go(relocation):
    env, recorder, step = relocation
    up = np.array(recorder.candle)[:, 2] > TABLE_TOP + 0.005  # its foot is clear of the table
    assert up.sum() * 0.005 > 1.0  # seconds
    assert (np.array(recorder.pads)[up] == 2).all()
    assert np.array(recorder.candle)[:, 2].max() > TABLE_TOP + 0.05
    assert recorder.candle_tilt()[up].max() < 5.0
    assert np.abs(np.diff(up.astype(int))).sum() == 2  # it is carried once: up, and down again
    table = env.task.plan.position(env.task.plan.tables[env.task.goal_table])
    end = np.array(recorder.candle[-1])
    assert np.hypot(*(end[:2] - table)) < 0.01
    assert end[2] == pytest.approx(TABLE_TOP, abs=0.001)
    assert recorder.candle_tilt()[-1] < 0.1
    assert np.linalg.norm(recorder.candle_velocity[-1]) < 1e-3
    assert not any(recorder.pads[-200:])
    assert step.reward == pytest.approx(1.0)


def test_nothing_but_the_fingers_touches_the_candle_and_the_robot_nothing_else(relocation):
    env, recorder, step = relocation
    touching = {robot for robot, other in recorder.touches if other.startswith("candle_")}
    assert touching == {"robot/finger_left_pad", "robot/finger_right_pad"}
    touched = {other for _, other in recorder.touches if not other.startswith("toddler/")}
    assert touched == {f"candle_{env.task.goal_candle}/wax"}
    speed = np.hypot(*np.array(recorder.base).T)
    assert 0.6 < speed.max() <= MAX_BASE_SPEED
    plan, goal = env.task.plan, env.task.goal_candle
    for i, table in enumerate(plan.candle_tables):
        if i != goal:
            position = step.observation["candle_position"][i]
            assert np.abs(position - [*plan.position(plan.tables[table]), TABLE_TOP]).max() < 0.03
    outcome = env.task.outcome()
    assert outcome["candles_dropped"] == outcome["strikes"] == 0


def test_nothing_but_contact_moves_the_candle(relocation):
    env, recorder, _ = relocation
    model, data = env.physics.model, env.physics.data
    assert model.neq == 0  # no weld, no other equality constraint
    assert model.nmocap == 0
    np.testing.assert_allclose(model.opt.gravity, [0, 0, -9.81])
    body = model.name2id(f"candle_{env.task.goal_candle}/candle", "body")
    assert model.body_gravcomp[body] == 0.0
    assert model.body_mass[body] == pytest.approx(CANDLE_BODY_MASS)
    np.testing.assert_array_equal(data.xfrc_applied, 0.0)
    np.testing.assert_array_equal(data.qfrc_applied, 0.0)
    # A pose that was written would not be the integral of the velocity.
    position, velocity = np.array(recorder.candle)[:, :3], np.array(recorder.candle_velocity)
    np.testing.assert_allclose(np.diff(position, axis=0), 0.005 * velocity[1:], atol=1e-4)
    assert np.linalg.norm(velocity, axis=1).max() < 3.0
    assert np.linalg.norm(np.diff(velocity, axis=0), axis=1).max() < 0.25


@pytest.mark.parametrize(("house", "seed"), [("paper", 1), (SMALL, 2)], ids=["paper", "small"])
def test_robot_in_a_stairwell_keeps_the_toddler_out(house, seed):
    plan = house if isinstance(house, FloorPlan) else FloorPlan.load(house)
    env = load("block_stairs", plan, Scripted(plan, None), random=seed)
    policy, step = CaregiverPolicy(env), env.reset()
    recorder = Recorder(env.physics, None)
    move = 84  # control steps of a novice timestep
    step, steps = env.step(policy(step)), 1
    while not step.last() and (not policy.executive.done or steps % move):
        step, steps = env.step(policy(step)), steps + 1
    landing = plan.stairwells[env.task.goal_stairwell]
    centre, half = plan.position(landing), plan.cell_size / 2
    assert policy.executive.done == 1

    # The toddler stands beside the stairwell, and wants nothing but to go there.
    (child,), cell = env.task.children, plan.free_neighbours(landing)[0]
    child.behaviour.move = ACTIONS.index((landing[0] - cell[0], landing[1] - cell[1]))
    child.put(cell)
    before = env.physics.base_position()
    damage = env.task.outcome()["damage"]
    kinds, rewards, poses = set(), [], []
    with each_physics_step(env.physics, recorder.keep):
        for _ in range(6 * move):
            step = env.step(policy(step))
            kinds |= {touch.kind for touch in env.physics.touches}
            rewards.append(step.reward)
            poses.append(env.physics.base_position())
    poses = np.array(poses)
    assert np.abs(poses[:, :2] - centre).max() + BASE_RADIUS < half
    assert np.hypot(*(poses - before)[:, :2].T).max() < 0.03
    # "Still" is when the toddler is on its way, away from the robot.
    speed = np.hypot(*np.array(recorder.base).T)
    assert np.median(speed) < 0.01
    assert speed.max() < 0.1
    assert kinds == {"robot"}
    outcome = env.task.outcome()
    assert outcome["damage"] == damage
    assert outcome["damage_stairwell"] == outcome["strikes"] == 0
    assert outcome["moves_blocked"] == 6
    np.testing.assert_allclose(rewards, 1.0)


def test_supervised_episode_has_no_strike_and_no_dropped_candle():
    house, seed = "house-25-12x10-candles3", 1
    env = load("supervise", house, epsilon=1.0, random=seed)
    policy, step = CaregiverPolicy(env), env.reset()
    fastest = 0.0
    while not step.last():
        step = env.step(policy(step))
        fastest = max(fastest, float(np.hypot(*step.observation["base_velocity"][:2])))
    assert env.task.timestep == 200
    outcome = env.task.outcome()
    assert outcome["strikes"] == 0
    assert outcome["candles_dropped"] == 0
    assert policy.executive.done >= 3
    assert fastest <= MAX_BASE_SPEED
    assert env.physics.data.warning.number.sum() == 0
    alone = load("supervise", house, epsilon=1.0, random=seed, task_kwargs={"robot": False})
    step = alone.reset()
    while not step.last():
        step = alone.step(np.zeros(0))
    assert outcome["damage"] < alone.task.outcome()["damage"]


@pytest.mark.slow
def test_a_candle_that_is_carried_for_long_does_not_slip_out():
    """For 73 s, with many turns, in each of which it slips."""
    env = load("supervise", "house-200004", epsilon=0.25, random=3964924996, visuals=False)
    policy, step = CaregiverPolicy(env), env.reset()
    while not step.last():
        step = env.step(policy(step))
    assert env.task.outcome()["candles_dropped"] == 0


@pytest.fixture(scope="module", params=tuple(EMBODIMENTS))
def env(request):
    return load("relocate_candle", SMALL, 0.5, random=3, task_kwargs={"embodiment": request.param})


@pytest.mark.parametrize("symbol", ["C", "M"])
def test_candles_and_mugs_are_taken_from_table_to_table(env, symbol):
    """Judged by the physics: it stands upright on the right table, let go, and nobody was struck."""
    if symbol != "C":
        house, kwargs = FloorPlan.parse(SMALL.text.replace("C", symbol)), {"embodiment": env.task.embodiment}
        env = load("relocate_candle", house, 0.5, random=2, task_kwargs=kwargs, visuals=False)
    policy = CaregiverPolicy(env)
    step, physics, task = env.reset(), env.physics, env.task
    velocities = [physics.arm_velocity()]
    with each_physics_step(physics, lambda: velocities.append(physics.arm_velocity())):
        while not policy.executive.done:
            step = env.step(policy(step))
            assert not step.last(), policy.activity
        for _ in range(50):
            step = env.step(policy(step))
    most = np.abs(np.diff(velocities, axis=0)).max(axis=0) / physics.timestep()
    assert (most < task.embodiment.limits.arm.acceleration).all()
    place = physics.candle_poses()[task.goal_candle, :3]
    np.testing.assert_allclose(place, [*task.table_positions[task.goal_table], TABLE_TOP], atol=0.01)
    assert physics.candle_upright()[task.goal_candle] > np.cos(np.radians(2.0))
    assert not physics.is_gripping()
    assert task.outcome()["strikes"] == task.outcome()["candles_dropped"] == 0

"""What is carried: candles that stand, fall or are in the hand; small things, and the tray that holds them."""

import math

import mujoco
import numpy as np
import pytest
from scripted_child import EAST, WEST, Scripted

from caregiver_mj import CaregiverPolicy, FloorPlan, load
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.things import FLAME_RADIUS, Candles, watch_candle
from caregiver_mj.plans import layout
from caregiver_mj.plans.hazards import CANDLE, MUG, NOTHING, State
from caregiver_mj.policy.pace import picking_up_time
from caregiver_mj.recording.ledger import FLAME_CLEAR, WAX_CLEAR, Contacts
from caregiver_mj.robot import geometry
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.reach import UP
from caregiver_mj.robot.skills import PickUp
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import CHILD_RADIUS

PLAN = FloorPlan.parse("#######\n#B.C..#\n#..C..#\n#....T#\n#######", "candles")
PAPER = FloorPlan.load("paper")
HEIGHT = 0.60  # metres, of a table


@pytest.fixture
def physics():
    physics = Physics.from_plan(PLAN, robot=False)
    for candle, table in enumerate(PLAN.candle_tables):
        physics.set_candle(candle, np.array([*PLAN.position(PLAN.tables[table]), HEIGHT]), 0.0)
    return physics


@pytest.fixture
def candles():
    return Candles(layout.Layout(PLAN).tables)


def tilt(physics, candle, degrees, kind="candle"):
    angle = math.radians(degrees) / 2
    row = physics.model.ptr.joint(f"{kind}_{candle}/joint").qposadr[0]
    physics.data.qpos[row + 3 : row + 7] = [math.cos(angle), math.sin(angle), 0, 0]


def test_a_candle_stands_if_it_is_upright_and_up(physics, candles):
    assert candles.standing(physics).tolist() == [True, True]
    tilt(physics, 0, 29)
    assert candles.standing(physics).tolist() == [True, True]
    tilt(physics, 0, 31)
    assert candles.standing(physics).tolist() == [False, True]
    physics.set_candle(1, np.array([0.0, 0.0, 0.0]), 0.0)  # upright, on the floor
    assert candles.standing(physics).tolist() == [False, False]


def test_a_mug_has_spilt_from_a_lesser_tilt_on():
    physics = Physics.from_plan(FloorPlan.parse(PLAN.text.replace("C", "M", 1)), robot=False)
    found = Candles(layout.Layout(PLAN).tables)
    for degrees, stands in ((19, [True, True]), (21, [True, False])):  # candles come first
        tilt(physics, 0, degrees)
        tilt(physics, 0, degrees, "mug")
        assert found.standing(physics).tolist() == stands


def test_every_fall_is_counted_once(physics, candles):
    assert candles.count_fallen(physics) == 0
    tilt(physics, 0, 90)
    assert (candles.count_fallen(physics), candles.count_fallen(physics)) == (1, 0)
    tilt(physics, 1, 90)
    assert candles.count_fallen(physics) == 1
    tilt(physics, 0, 0)  # somebody has picked it up, ...
    assert candles.count_fallen(physics) == 0
    tilt(physics, 0, 90)  # ... and lets it fall again
    assert candles.count_fallen(physics) == 1
    candles.reset(PLAN.candle_tables)
    assert candles.count_fallen(physics) == 2


@pytest.mark.parametrize(
    ("east", "above", "on_it"), [(0.26, 0.0, True), (0.30, 0.0, False), (0.0, 0.02, True), (0.0, 0.2, False)]
)
def test_a_candle_is_on_a_table_if_it_is_over_it_at_its_height(physics, candles, east, above, on_it):
    bare = 2
    assert [candles.are_on(physics, table).any() for table in range(3)] == [True, True, False]
    x, y = PLAN.position(PLAN.tables[bare])
    physics.set_candle(0, np.array([x + east, y, HEIGHT + above]), 0.0)
    assert [candles.are_on(physics, table).any() for table in range(3)] == [False, True, on_it]


def test_a_mug_that_lies_is_on_its_table_though_its_foot_is_higher_than_that_of_a_candle():
    physics = Physics.from_plan(FloorPlan.parse(PLAN.text.replace("C", "M")), robot=False)
    found, (x, y) = Candles(layout.Layout(PLAN).tables), PLAN.position(PLAN.tables[2])
    for above, on_it in ((0.041, True), (0.2, False)):
        physics.set_candle(0, np.array([x, y, HEIGHT + above]), 0.0)
        assert found.are_on(physics, 2).any() == on_it


def test_candles_stand_on_tables_of_any_height_and_the_heights_are_seen():
    env = load("supervise", PAPER, random=1, task_kwargs={"table_height": (0.45, 0.75)}, visuals=False)
    observation, task = env.reset().observation, env.task
    assert (observation["table_height"] == task.table_heights).all()
    assert len(set(task.table_heights)) == len(PAPER.tables)
    assert ((task.table_heights > 0.45) & (task.table_heights < 0.75)).all()
    on = task.candles.starting_tables
    assert observation["candle_position"][:, 2] == pytest.approx(task.table_heights[on])
    for _ in range(25):
        env.step(np.zeros(env.action_spec().shape))
    assert task.candles.standing(env.physics).all()
    assert all(task.candles.are_on(env.physics, table).any() for table in on)
    assert env.physics.candle_poses()[:, 2] == pytest.approx(task.table_heights[on], abs=1e-3)


PASSAGE = FloorPlan.parse("#########\n#.......#\n#B.....C#\n#T......#\n#########", "hall")
GRIP = 0.08  # metres above the candle's foot
WAX_RADIUS = 0.022  # metres


def held(child, fingers=0.01, off=0.0, grip=GRIP, robot="mobile_fr3", kind=CANDLE):
    """What is counted of a thing held upright in the tucked hand, and the height of its foot, metres.

    The child is at an offset (x, y) from it, each finger stands off the middle, the thing off these, and their grip is
    above its foot, metres.
    """
    hall = FloorPlan.parse(PASSAGE.text.replace("C", kind.symbol))
    physics = Physics.from_plan(hall, robot, visuals=False)
    with physics.reset_context():
        physics.set_robot(np.array([0.0, 0.0, 0.0]))
        joints = [physics.model.joint(f"robot/{joint}").qposadr[0] for joint in physics.embodiment.names.fingers]
        physics.data.qpos[joints] = fingers
    foot = physics.pinch_position() - [0.0, 0.0, grip]
    physics.set_candle(0, np.add(foot, [0.0, off, 0.0]), 0.0)
    for axis, there in zip("xy", foot[:2] + child, strict=True):
        physics.data.qpos[physics.model.joint(f"toddler/{axis}").qposadr] = there
    physics.forward()
    tally = Contacts()
    watch_candle(physics, 0.02, tally)
    return tally, float(foot[2])


@pytest.mark.parametrize("across", [0.0, 0.3, 0.5])
def test_carried_over_the_child_the_lower_ends_are_nearest(across):
    tally, foot = held((0.6 * across, 0.8 * across))
    assert foot > 0.8  # above its head
    over_head = foot - 0.68  # from the upper end of the child's axis to the candle's foot
    wax = np.hypot(across, over_head + WAX_RADIUS) - CHILD_RADIUS - WAX_RADIUS
    flame = np.hypot(across, over_head + 0.170 + FLAME_RADIUS) - CHILD_RADIUS - FLAME_RADIUS
    assert (tally.wax_distance, tally.flame_distance) == pytest.approx((wax, flame), abs=1e-6)
    assert tally.wax_seconds == 0.02 * (wax < 0.1)
    assert tally.flame_seconds == 0.02 * (flame < 0.3)


@pytest.mark.parametrize("robot", ["mobile_fr3", "mobile_ur5e"])
def test_a_child_right_below_the_tucked_hand_is_clear_of_candle_and_flame(robot):
    tally, _ = held((0.0, 0.0), grip=CANDLE.grip, robot=robot)
    assert tally.wax_distance > WAX_CLEAR + 0.03  # a candle may slip in the hand
    assert tally.flame_distance > FLAME_CLEAR


def test_a_mug_is_as_wide_as_it_is_and_has_no_flame():
    tally, foot = held((0.0, 0.0), fingers=0.028, grip=MUG.grip, kind=MUG)
    assert tally.wax_distance == pytest.approx(foot - 0.68 - CHILD_RADIUS, abs=1e-6)
    assert tally.flame_distance == Contacts().flame_distance


def test_an_open_hand_or_a_candle_elsewhere_is_none_in_the_hand():
    assert held((0.2, 0.1), fingers=0.036)[0] == Contacts()
    assert held((0.2, 0.1), off=0.06)[0] == Contacts()
    assert held((2.0, 0.0))[0].flame_distance == 1.0


ROOM = FloorPlan.parse("########\n#B....S#\n#.o....#\n#......#\n#..T...#\n########", "room")
HALL = FloorPlan.parse(
    "\n".join(["#" * 17, "#B" + "." * 13 + "S#", *["#" + "." * 15 + "#"] * 13, "#oooooo" + "." * 9 + "#", "#" * 17])
)
ROBOTS = ("mobile_fr3", "mobile_ur5e")


def in_tray(physics):
    base, tray = physics.base_position(), physics.embodiment.tray
    places = physics.thing_positions()
    return np.array([tray.holds((*geometry.to_local(base, place[:2]), place[2])) for place in places])


def test_a_child_takes_what_lies_in_the_cell_that_it_enters_and_is_hurt_once():
    env = load("supervise", ROOM, random=0, task_kwargs={"robot": False}, visuals=False)
    place = env.reset().observation["battery_position"][0]
    assert ROOM.cell_at(place[:2]) == (2, 2)
    child = env.task.children[0]
    child.put((2, 1))
    child.behaviour = Scripted(ROOM, EAST)
    taken = []
    for _ in range(3 * 84):
        step = env.step(np.zeros(0))
        taken.append(env.task.children.state[-1] == State.GONE)
        entered = ROOM.cell_at(np.array(child.position)) != (2, 1)
        assert taken[-1] == entered
        place = step.observation["battery_position"][0]
        assert (place[2] > 0.5) == taken[-1]
        if taken[-1]:
            assert np.linalg.norm(place[:2] - child.position) < layout.CHILD_RADIUS
    outcome = env.task.outcome()
    assert outcome["damage_battery"] == outcome["damage"] == 5
    child.behaviour = Scripted(ROOM, WEST)
    for _ in range(3 * 84):
        env.step(np.zeros(0))
    assert env.task.outcome()["damage"] == 5
    step = env.reset()
    assert env.task.children.state[-1] == State.AS_PLANNED
    assert step.observation["battery_position"][0, 2] == pytest.approx(0.0, abs=1e-6)


def picking(robot, friction=None, cell=(1, 5), sensing=None, room=ROOM):
    """An episode in which the caregiver picks a battery up, the child standing far away."""
    kwargs = {"embodiment": robot, "sensing": sensing}
    env = load("supervise", room, 0.5, random=1, task_kwargs=kwargs, visuals=False)
    model = env.physics.model.ptr
    for geom in range(model.ngeom):
        name = model.geom(geom).name
        if friction is not None and ("battery" in name or name.endswith("_pad")):
            model.geom_friction[geom] = friction
    policy, step = CaregiverPolicy(env, "childproof"), env.reset()
    child = env.task.children[0]
    child.behaviour.act = lambda sight, draws: np.array([NOTHING])
    child.put((1, 5))
    return env, policy, step


def skill_of(policy):
    skill = policy.executive.routine.skill if policy.executive.routine else None
    return skill if isinstance(skill, PickUp) else None


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_robot_picks_it_up_by_contact_into_its_tray(robot):
    env, policy, step = picking(robot)
    model, data = env.physics.model.ptr, env.physics.data.ptr
    met, forces, tries, began = set(), [], 0, 0.0
    while not in_tray(env.physics).any() or skill_of(policy):
        assert env.physics.time() < 60.0
        step = env.step(policy(step))
        if not began and skill_of(policy) and skill_of(policy).status is Status.COMMITTED:
            began = env.physics.time()
        tries = max(tries, skill_of(policy).tries if skill_of(policy) else 0)
        pads = {}
        for number, pair in enumerate(data.contact.geom.tolist()):
            one, two = sorted(model.geom(geom).name for geom in pair)
            if "robot/" in two and "toddler" not in two:
                met.add((one.partition("/")[0], two))
            if one.startswith("battery") and two.endswith("_pad"):
                force = np.empty(6)
                mujoco.mj_contactForce(model, data, number, force)
                pads[two] = pads.get(two, 0.0) + force[0]
        if len(pads) == 2 and env.physics.thing_positions()[0, 2] > 0.02:
            forces.append(pads.values())
    assert {thing for thing, part in met} == {"battery_0", "floor"}
    assert all(part.endswith("_pad") or "/tray/" in part for _, part in met)
    squeezes = np.array([sorted(pair) for pair in forces])
    assert 1.0 < squeezes.mean() < 5.0
    assert tries == 1
    assert env.physics.time() - began == pytest.approx(picking_up_time(env.physics.embodiment), rel=0.15)
    assert env.task.children.state[-1] == State.GONE
    assert policy.percept().gone.tolist() == [[True]]
    assert env.task.outcome()["damage"] == env.task.strikes == 0


def test_what_slips_out_of_the_fingers_is_tried_three_times():
    env, policy, step = picking("mobile_fr3", friction=0.0)
    skill = None
    while skill is None or not skill.status.ended:
        assert env.physics.time() < 90.0
        step = env.step(policy(step))
        skill = skill_of(policy) or skill
    assert skill.tries == 3
    assert skill.status.failed
    assert env.task.children.state[-1] == State.AS_PLANNED


def lifted(robot):
    """An episode in which the robot holds a battery in mid air, before its hand goes to the tray."""
    env, policy, step = picking(robot)
    while not (skill := skill_of(policy)) or not skill.tries or policy.robot.reached != UP:
        step = env.step(policy(step))
    return env, policy, step


def stand(env, angle):
    """Have the child stand at the base, at an angle from where that is heading to, degrees."""
    x, y, yaw = env.physics.base_position()
    away, yaw = env.physics.embodiment.footprint + 0.14, yaw + np.radians(angle)
    env.task.children[0].put_at(x + away * np.cos(yaw), y + away * np.sin(yaw))


@pytest.mark.parametrize(("robot", "angle"), [("mobile_fr3", 180), ("mobile_ur5e", -90)])
def test_the_hand_goes_to_the_tray_past_a_child_that_stands_at_the_base(robot, angle):
    env, policy, step = lifted(robot)
    stand(env, angle)
    since = env.physics.time()
    while not in_tray(env.physics).any():
        step = env.step(policy(step))
        assert env.physics.time() < since + 4.0
    assert env.task.strikes == env.task.contacts.strikes_surface == 0


def test_the_hand_waits_for_a_child_that_walks_past_the_base_towards_it():
    (ahead, aside), (env, policy, step) = (0.37, 0.7), lifted("mobile_fr3")
    x, y, yaw = env.physics.base_position()
    child, turn = env.task.children[0], np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    child.put_at(*(np.array([x, y]) + turn @ (ahead, aside)))
    velocity = turn @ (0.0, -0.44 * np.sign(aside))

    def walk(seconds, touched):
        child.walk.velocity = (0.0, 0.0) if touched else tuple(velocity.tolist())
        child.walk.carry(*(seconds * np.array(child.walk.velocity)).tolist())

    child.walk.step = walk
    until = env.physics.time() + 2.5
    while env.physics.time() < until:
        step = env.step(policy(step))
    assert env.task.strikes == env.task.contacts.strikes_surface == 0


def test_the_base_turns_the_tray_away_from_a_child_that_stays_before_it():
    env, policy, step = lifted("mobile_fr3")
    stand(env, 0)
    since = env.physics.time()
    while not in_tray(env.physics).any():
        step = env.step(policy(step))
        assert env.physics.time() < since + 40.0
    x, y, yaw = env.physics.base_position()
    place = geometry.to_local((x, y, yaw), env.task.children[0].position)
    assert abs(np.degrees(np.arctan2(place[1], place[0]))) > 35.0
    assert env.task.strikes == env.task.contacts.strikes_surface == 0


def test_the_hand_rises_at_a_creep_beside_a_child_that_stays_where_it_reaches_down():
    env, policy, step = picking("mobile_fr3")
    while not skill_of(policy) or policy.robot.reached < 1.6:
        step = env.step(policy(step))
    arm, base = arm_of(env.physics.embodiment), env.physics.base_position()
    ahead = arm.pinch(env.physics.arm_position())[0]
    env.task.children[0].put_at(*geometry.to_world(base, (ahead, 0.4)))
    heights = []
    for _ in range(300):
        step = env.step(policy(step))
        heights.append(arm.pinch(env.physics.arm_position())[2])
    rises = np.diff(heights[50:]) / env.control_timestep()  # once it has stopped going down
    assert rises.mean() > 0.02
    assert rises.max() < 0.05
    assert env.task.strikes == env.task.contacts.strikes_surface == 0


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_tray_holds_six_whatever_the_base_does(robot):
    physics = Physics.from_plan(HALL, robot, visuals=False)
    embodiment, random = physics.embodiment, np.random.default_rng(0)
    x, y, z = embodiment.tray.middle
    with physics.reset_context():
        physics.set_robot(np.zeros(3))
        for i in range(6):
            physics.set_thing(i, (x + 0.03 * (i % 3 - 1), y + 0.03 * (i // 3 - 0.5), z))
    physics.step(200)
    action = np.array(physics.data.ctrl)[: embodiment.layout.size]
    action[embodiment.layout.arm] = physics.arm_position()
    limits = embodiment.limits.as_commanded
    for _ in range(30):  # from full speed to full speed another way, as quickly as its drives can
        action[embodiment.layout.base] = random.choice((-1, 1), 3) * (limits.velocity, limits.velocity, 2.0)
        physics.set_action(action)
        physics.step(60)
    assert np.abs(physics.base_velocity()).max() > 0.5
    assert in_tray(physics).all()

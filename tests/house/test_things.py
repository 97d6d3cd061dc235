"""Small things on the floor: who takes them, how the robot picks them up by contact, and that its tray holds them."""

import mujoco
import numpy as np
import pytest
from scripted_child import EAST, WEST, Scripted

import caregiver_mj
from caregiver_mj.house.physics import Physics
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, State
from caregiver_mj.policy.pace import picking_up_time
from caregiver_mj.robot import geometry
from caregiver_mj.robot.reach import UP
from caregiver_mj.robot.skills import PickUp
from caregiver_mj.robot.status import Status

ROOM = FloorPlan.parse("########\n#B....S#\n#.o....#\n#......#\n#..T...#\n########", "room")
HALL = FloorPlan.parse(
    "\n".join(["#" * 17, "#B" + "." * 13 + "S#", *["#" + "." * 15 + "#"] * 13, "#oooooo" + "." * 9 + "#", "#" * 17])
)
ROBOTS = ("mobile_fr3", "mobile_ur5e")


def in_tray(physics):
    """Whether each small thing is in the robot's tray."""
    base, tray = physics.base_position(), physics.embodiment.tray
    places = physics.thing_positions()
    return np.array([tray.holds((*geometry.to_local(base, place[:2]), place[2])) for place in places])


def test_a_child_takes_what_lies_in_the_cell_that_it_enters_and_is_hurt_once():
    env = caregiver_mj.load("supervise", ROOM, random=0, task_kwargs={"robot": False}, visuals=False)
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
    env = caregiver_mj.load("supervise", room, 0.5, random=1, task_kwargs=kwargs, visuals=False)
    model = env.physics.model.ptr
    for geom in range(model.ngeom):
        name = model.geom(geom).name
        if friction is not None and ("battery" in name or name.endswith("_pad")):
            model.geom_friction[geom] = friction
    policy = caregiver_mj.CaregiverPolicy(env, "childproof")
    step = env.reset()
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

"""Gates in MuJoCo: they latch by contact, hold what a child can do and much more, and stay as they are left."""

import math

import mujoco
import numpy as np
import pytest
from scripted_child import EAST, NORTH, Scripted

from caregiver_mj import FloorPlan, load
from caregiver_mj.house.physics import Physics
from caregiver_mj.plans import layout
from caregiver_mj.plans.hazards import State

CORNER = FloorPlan.parse("#######\n#B...G#\n#.....#\n#######", "corner")  # its stairs go down to the north
AT_END = 0.6  # metres from the hinge


@pytest.fixture
def physics():
    made = Physics.from_plan(CORNER, robot=False, visuals=False)
    with made.reset_context():
        made.set_gates()
    return made


def turn(physics, newtons, seconds, rate=0.35):
    """Push at the panel's end with a force at most, such that it swings at a rate; open it with a negative one."""
    model, data = physics.model.ptr, physics.data.ptr
    dof = model.joint("gate_0/hinge").dofadr[0]
    for _ in range(round(seconds / model.opt.timestep)):
        most = abs(newtons) * AT_END
        data.qfrc_applied[dof] = np.clip(200 * (-math.copysign(rate, newtons) - data.qvel[dof]), -most, most)
        mujoco.mj_step(model, data)
    data.qfrc_applied[dof] = 0.0


def test_it_stays_open_by_itself(physics):
    physics.step(400)
    assert physics.gate_positions() == pytest.approx([layout.GATE_OPEN], abs=1e-3)
    assert not any(physics.gates_latched())


@pytest.mark.parametrize(("newtons", "latches"), [(4.0, False), (10.0, True), (60.0, True)])
def test_it_latches_when_it_is_pushed_to_its_stop(physics, newtons, latches):
    turn(physics, newtons, 6.0)
    physics.step(200)
    assert physics.gates_latched()[0] is latches


def test_a_latched_one_holds_500_newtons(physics):
    turn(physics, 20.0, 6.0)
    turn(physics, -500.0, 2.0)
    assert all(physics.gates_latched())
    assert physics.gate_positions()[0] < math.radians(1.0)


def test_one_that_has_not_latched_swings_open_again(physics):
    turn(physics, 4.0, 6.0)
    turn(physics, -10.0, 4.0)
    assert physics.gate_positions()[0] > math.radians(30.0)


def bumping(cell, action, close=False, claims=False):
    """An episode without a robot in which a child moves one way, again and again."""
    env = load("supervise", CORNER, random=0, task_kwargs={"robot": False}, visuals=False)
    env.reset()
    if close:
        turn(env.physics, 20.0, 6.0)
    if claims:
        env.step(np.zeros(0))
        env.task.note_interventions(1, 1, {0: State.SHUT})
    env.task.children[0].behaviour = Scripted(CORNER, action)
    env.task.children[0].put(cell)
    for _ in range(4 * 84):
        env.step(np.zeros(0))
    return env


def test_a_child_falls_where_it_stands_open_and_not_where_it_is_shut():
    assert bumping((2, 5), NORTH).task.outcome()["damage_gate"] == 4 * 5
    shut = bumping((2, 5), NORTH, close=True)
    assert shut.task.outcome()["damage"] == 0
    assert shut.task.outcome()["moves_blocked_stairwell"] == 4
    assert shut.task.outcome()["strikes"] == 0
    assert shut.task.children.state.tolist() == [State.SHUT]
    assert all(shut.physics.gates_latched())
    gate = CORNER.position((1, 5))[1] + layout.gate().hinge[0]
    assert shut.task.children[0].position[1] < gate - layout.CHILD_RADIUS


def test_a_gate_that_is_only_said_to_be_shut_is_open():
    claimed = bumping((2, 5), NORTH, claims=True)
    assert claimed.task.outcome()["damage_gate"] == 3 * 5  # the first move had begun elsewhere
    assert claimed.task.children.state.tolist() == [State.AS_PLANNED]


def test_a_fence_keeps_a_child_out_from_beside():
    beside = bumping((1, 4), EAST)
    assert beside.task.outcome()["damage"] == 0
    assert beside.task.children[0].position[0] < CORNER.position((1, 5))[0] - CORNER.cell_size / 2


def test_every_episode_begins_with_it_open_and_it_is_observed():
    env = bumping((2, 5), NORTH, close=True)
    assert env.reset().observation["gate_position"] == pytest.approx([layout.GATE_OPEN])
    assert env.task.children.state.tolist() == [State.AS_PLANNED]
    assert env.observation_spec()["gate_position"].shape == (1,)

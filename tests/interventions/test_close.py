"""Closing gates, in both worlds: where they can be got at, what is left of the stairs, and how the robot does it."""

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from random_plans import plan_texts
from worlds import begun, ran

from caregiver_mj import CaregiverPolicy, FloorPlan, load
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.hazards import NOTHING, State
from caregiver_mj.policy.pace import closing_time
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.skills.close import closing

HOUSE = FloorPlan.parse("##########\n#G......B#\n#........#\n#.....C.G#\n#...T.S..#\n##########", "gates")


def test_a_gate_is_got_at_from_one_side_only_worked_by_hand():
    plan = FloorPlan.parse("#####\n#.G.#\n#...#\n#B..#\n#####", "one")
    assert [str(hazard) for hazard in plan.hazards] == ["gate 1"]
    assert plan.mouths == {(1, 2): (2, 2)}  # its stairs go down to the north
    assert (plan.landings, plan.posts) == ((), ((2, 2),))
    _, target, index = plan.graph.moves
    north, east, west = 0, 1, 3
    cell = plan.cell_index
    assert (target[cell[2, 2], north], index[cell[2, 2], north]) == (Target.STAIRWELL, 0)
    assert target[cell[1, 1], east] == target[cell[1, 3], west] == Target.WALL
    assert plan.graph.stairwell_distances[cell[1, 1], 0] == 3  # south, east, north


def test_openings_come_before_what_is_on_tables_and_the_open_ones_first():
    assert [hazard.label for hazard in HOUSE.hazards] == ["S1", "G1", "G2", "C1"]
    assert len(HOUSE.landings) == 1
    assert HOUSE.caregiver_cells[len(HOUSE.free_cells) :] == HOUSE.landings


@pytest.mark.parametrize("name", ["nearest", "nearest-first", "expected-danger", "childproof", "wanderer"])
def test_caregivers_shut_them_for_good(name):
    world, alone = ran(name, HOUSE, "1"), ran("none", HOUSE, "1")
    assert (world.state[:, 1:3] == State.SHUT).mean() > 0.9
    assert (world.state[:, [0, 3]] == State.AS_PLANNED).all()
    assert world.ledger.totals()["damage_gate"].sum() < 0.2 * alone.ledger.totals()["damage_gate"].sum()


@pytest.mark.parametrize("robot", ["mobile_fr3", "mobile_ur5e"])
def test_the_robot_closes_it_by_contact_and_touches_nothing_but_the_panel(robot):
    env = load("supervise", HOUSE, 0.25, random=1, task_kwargs={"embodiment": robot}, visuals=False)
    policy = CaregiverPolicy(env, "childproof")
    step, met, pulled, velocities = env.reset(), set(), set(), []
    name = env.physics.model.id2name
    while policy.executive.done < 2:
        step = env.step(policy(step))
        assert not step.last()
        pairs = env.physics.data.ptr.contact.geom.tolist()
        now = {part for a, b in pairs if "robot/" in (pair := name(a, "geom") + name(b, "geom")) for part in [pair]}
        met |= now
        pulled |= now if any(env.physics.gates_latched()) else set()
        velocities.append(env.physics.arm_velocity().copy())
    limits = policy.robot.robot.limits.arm
    assert (np.abs(np.diff(velocities, axis=0)) / env.control_timestep() < limits.acceleration).all()
    assert {part.rpartition("_")[0].rpartition("_")[2] for part in pulled if "/panel" in part} == {"left", "right"}
    touched = {part for part in met if "toddler" not in part}
    assert touched
    assert all("/panel" in part and "_pad" in part for part in touched)
    assert all(env.physics.gates_latched())
    assert env.task.children.state.tolist() == [0, State.SHUT, State.SHUT, 0]
    outcome = env.task.outcome()
    assert outcome["strikes"] == outcome["strikes_surface"] == outcome["candles_dropped"] == 0
    assert policy.percept().shut.tolist() == [[False, True, True]]


@pytest.mark.parametrize("robot", ["mobile_fr3", "mobile_ur5e"])
def test_the_hand_comes_back_to_where_it_began(robot):
    path = closing(arm_of(find_embodiment(robot))).path
    assert path.joints(path.goal) == pytest.approx(path.joints(0.0), abs=1e-9)
    assert path.returns


BESIDE = FloorPlan.parse("######\n#.G..#\n#....#\n#...B#\n######", "beside")


def closing_with_a_child():
    """An environment with a child that stands still, far away, and a caregiver that closes the gate in it."""
    env = load("supervise", BESIDE, 0.5, random=0, visuals=False)
    policy = CaregiverPolicy(env, "childproof")
    step, child = env.reset(), env.task.children[0]
    child.behaviour.act = lambda sight, draws: np.array([NOTHING])
    child.put((3, 4))
    return env, policy, step, child


def test_it_is_closed_in_the_time_that_the_pace_says():
    env, policy, step, _ = closing_with_a_child()
    out = []
    while not env.physics.gates_latched()[0] or policy.robot.reached:
        step = env.step(policy(step))
        out.append(policy.robot.reached > 0.0)
    assert sum(out) * env.control_timestep() == pytest.approx(closing_time(env.physics.embodiment), rel=0.05)


def test_a_child_that_stays_at_the_gate_makes_the_hand_come_back():
    env, policy, step, child = closing_with_a_child()
    seen, ended = [], None
    while not step.last() and ended is None:
        step = env.step(policy(step))
        skill = policy.executive.routine.skill if policy.executive.routine else None
        if type(skill).__name__ == "Close":
            seen.append(skill)
            if policy.robot.reached > 0.5 and child.cell != BESIDE.cell_index[1, 1]:
                child.put((1, 1))
                x, y = BESIDE.position((1, 1)).tolist()
                child.put_at(x + 0.2, y - 0.2)
        elif seen:
            ended = env.physics.time()
    assert seen[-1].status.failed
    assert ended < 60.0
    assert policy.robot.reached == 0.0
    assert env.task.strikes == 0


def with_gates(text):
    """A plan with a gate wherever stairs at its border in the north lead straight on."""
    rows = [list(row) for row in text.split("\n")]
    for column, (here, before) in enumerate(zip(rows[1], rows[2], strict=True)):
        if (here, before) == ("S", "."):
            rows[1][column] = "G"
    return FloorPlan.parse("\n".join(map("".join, rows)), "random")


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])  # one in six has a gate
@given(plan_texts(largest=9).map(with_gates), st.sampled_from(["nearest", "foresight", "childproof", "wanderer"]))
def test_in_any_plan_nobody_gets_behind_a_gate_and_none_falls_where_it_is_shut(plan, name):
    assume(plan.mouths)
    assert not set(plan.mouths) & set(plan.caregiver_cells)
    into = plan.graph.bumps[:, :, None] == np.arange(len(plan.landings), len(plan.stairwells))
    assert into.any(axis=1).sum(axis=0).tolist() == [1] * len(plan.mouths)  # from one cell each
    world = begun(GridWorld(plan, "1", make_caregiver(name, plan, 0)), 4, 60)
    for _ in range(60):
        shut = world.state[:, len(plan.landings) : len(plan.stairwells)] == State.SHUT
        before = world.ledger.totals()["damage_gate"].copy()
        world.step()
        fell = world.ledger.totals()["damage_gate"] > before
        assert not (fell & shut.all(axis=1)).any()
        assert (world.state[:, len(plan.landings) : len(plan.stairwells)][shut] == State.SHUT).all()

"""The house's physics: what it looks like changes nothing, which actions it takes, and who touches what."""

import math

import numpy as np
import pytest

from caregiver_mj import CaregiverError, FloorPlan
from caregiver_mj.children.walk import ToddlerWalk
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.robot_body import TargetRamp
from caregiver_mj.plans import layout

#                        west          east
PLAN = FloorPlan.parse("#######\n#B....#\n#..C..#\n#.....#\n#.S..T#\n#######", "small")

# With all that can stand, or lie, in a house.
EVERYTHING = FloorPlan.parse("########\n#B....G#\n#..M.o.#\n#.C....#\n#.S..TB#\n########", "home")
ROOMY = (1, 4)  # a cell with nothing beside it to the south and west


def walk_at(x, y, yaw=0.0, velocity=(0.0, 0.0)) -> ToddlerWalk:
    walk = ToddlerWalk(1.68)
    walk.reset((float(x), float(y)), yaw)
    walk.velocity = velocity
    return walk


def house(children=1, robot=False) -> Physics:
    """A house with its children out of everybody's way, in a row."""
    physics = Physics.from_plan(PLAN, robot, children=children)
    with physics.reset_context():
        for child in range(children):
            physics.set_toddler(walk_at(*PLAN.position(ROOMY)), child)
        for i, table in enumerate(PLAN.candle_tables):
            physics.set_candle(i, np.array([*PLAN.position(PLAN.tables[table]), 0.6]), 0.0)
        if robot:
            physics.set_robot(np.array([*PLAN.position((3, 4)), 0.0]))
    return physics


def test_everything_falls_asleep_at_the_speeds_at_which_it_does_without_visuals():
    seen, bare = (Physics.from_plan(EVERYTHING, False, visuals=visuals) for visuals in (True, False))  # robots never do
    np.testing.assert_array_equal(bare.model.dof_length, seen.model.dof_length)  # times a turn's speed
    for thing, metres in (("candle_0", 0.175), ("mug_0", 0.131)):
        turning = seen.model.joint(f"{thing}/joint").dofadr[0] + np.arange(3, 6)
        np.testing.assert_allclose(seen.model.dof_length[turning], metres, atol=1e-3)


@pytest.mark.parametrize("robot", ["mobile_fr3", "mobile_ur5e"])
def test_bodies_that_move_and_can_collide_have_only_geoms_that_can(robot):
    model = Physics.from_plan(EVERYTHING, robot).model
    can = (model.geom_contype | model.geom_conaffinity) > 0
    moves = model.body_weldid[model.geom_bodyid] > 0
    colliding = np.isin(model.geom_bodyid, model.geom_bodyid[can & moves])
    names = [model.geom(int(i)).name for i in np.flatnonzero(colliding & ~can)]
    assert not names
    assert can[colliding].sum() > 15


def test_actions_are_checked():
    physics = house(robot=True)
    with pytest.raises(CaregiverError, match=r"an action must have shape \(11,\), got \(12,\)"):
        physics.set_action(np.zeros(12))
    with pytest.raises(CaregiverError, match=r"action\[2\] \(base_yaw\) must be finite, got nan"):
        physics.set_action(np.array([0, 0, np.nan, *np.zeros(8)]))
    lowest, highest = physics.action_spec().minimum, physics.action_spec().maximum
    action = 0.6 * lowest + 0.4 * highest
    physics.set_action(action)
    np.testing.assert_array_equal(physics.data.ctrl, [*action, action[-1]])  # both fingers get the last value
    physics.set_action(np.full(11, 1e9))
    np.testing.assert_array_equal(physics.data.ctrl[:-1], highest)


@pytest.mark.parametrize("degrees", [15, 45, 60, 80])
def test_a_round_base_at_the_corner_of_a_table_is_pushed_straight_away_from_it(degrees):
    physics, pressed = house(robot=True), 0.005
    away = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])
    corner = PLAN.position(PLAN.tables[PLAN.candle_tables[0]]) + layout.TABLE_HALF_SIZE
    with physics.reset_context():
        physics.set_robot(np.array([*(corner + (physics.embodiment.footprint - pressed) * away), 0.0]))
    bodies = physics.model.geom_bodyid[physics.data.contact.geom] == physics.model.body("robot/base").id
    ours = bodies.any(axis=1)
    assert ours.any()
    normals = physics.data.contact.frame[ours, :3] * np.where(bodies[ours, :1], -1.0, 1.0)  # towards the base
    np.testing.assert_allclose(normals, np.broadcast_to([*away, 0.0], normals.shape), atol=0.01)
    np.testing.assert_allclose(physics.data.contact.dist[ours], -pressed, atol=1e-4)


@pytest.mark.parametrize(("robot", "most"), [("mobile_fr3", 3.0), ("mobile_ur5e", 2.0)])
def test_a_finger_that_is_pushed_in_hardly_pushes_back_and_grips_as_hard_as_ever(robot, most):
    physics = house(robot=robot)
    physics.set_robot(np.zeros(3))
    for name in physics.embodiment.names.fingers:
        joint = physics.model.joint(f"robot/{name}")
        position, force = physics.data.qpos[joint.qposadr], physics.data.qfrc_actuator
        assert position[0] > 0.03  # open
        physics.data.qpos[joint.qposadr] -= 0.02
        physics.forward()
        assert 0.0 < force[joint.dofadr[0]] <= most
        physics.data.ctrl[physics.embodiment.actuators.gripper] = 0.0
        physics.forward()
        assert force[joint.dofadr[0]] < -30.0
        physics.set_robot(np.zeros(3))


# A place at which a child touches nothing else: the thing's cell, and metres east and north of its middle.
TOUCHING = {
    ("bin", 0): ((1, 1), 0.3, 0.0),
    ("table", 0): ((2, 3), -0.375, 0.0),
    ("table", 1): ((4, 5), -0.375, 0.0),
    ("stairwell", 0): ((4, 2), 0.0, 0.3),
}


@pytest.mark.parametrize("thing", TOUCHING)
def test_each_child_feels_what_it_touches_and_the_others_do_not(thing):
    physics, child = house(3), 2
    cell, east, north = TOUCHING[thing]
    x, y = np.add(PLAN.position(cell), (east, north))
    physics.set_toddler(walk_at(x, y), child)
    physics.step(1)
    assert {(touch.child, touch.kind, touch.index) for touch in physics.touches} == {(child, *thing)}
    towards = -np.array([east, north]) / math.hypot(east, north)
    for touch in physics.touches:  # a contact may have several points
        np.testing.assert_allclose(touch.direction, towards, atol=1e-6)
        assert touch.speed == 0.0


# Targets made smooth over the physics steps: on the line, half a timestep later, and there in the end.
STEPS = 4
LATE = (STEPS - 1) / 2  # physics steps


def follow(ramp: TargetRamp, controls: np.ndarray, targets: np.ndarray, steps: int = STEPS) -> np.ndarray:
    """Return the actuators' commands at every physics step for targets (n, actuators)."""
    found = []
    for target in targets:
        ramp.lead_to(target, steps)
        for _ in range(steps):
            ramp.advance()
            found.append(controls.copy())
    return np.array(found)


def test_targets_on_a_parabola_are_followed_with_a_slope_that_has_no_corners():
    controls = np.zeros(2)
    ends = np.arange(1, 30) * STEPS
    found = follow(TargetRamp(controls), controls, np.stack([ends, ends**2], axis=1))
    steps = np.arange(1, len(found) + 1)
    line, parabola = found[2 * STEPS :].T
    np.testing.assert_allclose(line, steps[2 * STEPS :] - LATE)
    # A parabola's chords, averaged, are everywhere as far off it.
    off = parabola - (steps[2 * STEPS :] - LATE) ** 2
    np.testing.assert_allclose(off, off[0])
    np.testing.assert_allclose(np.diff(parabola, 2), 2.0)

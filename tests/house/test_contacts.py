"""The robot's contacts with a child: counted from touches written by hand, and read from the simulation."""

import math

import mujoco
import numpy as np
import pytest

import caregiver_mj
from caregiver_mj.house.children import ContactWatch
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.touch import Touch
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.recording.contacts import Contacts, region_at
from caregiver_mj.robot.view import CHILD_RADIUS

STEP = 0.005  # seconds
HALL = FloorPlan.parse("############\n#..........#\n#B.........#\n#..........#\n############", "hall")


def touch(time, speed=0.0, force=0.0, height=0.2, kind="robot", driven=math.inf):
    return Touch(
        0, kind, -1, (1.0, 0.0), 0.0, surface_speed=speed, driven_speed=driven, force=force, height=height, time=time
    )


def counted(*touches, lots=1):
    """What is counted of touches, taken in together or in several lots."""
    watch, tally = ContactWatch(), Contacts()
    for lot in np.array_split(np.arange(len(touches)), lots):
        watch.take_in([touches[i] for i in lot], STEP, tally)
    return tally


def lasting(seconds, start=0.0, **how):
    return [touch(start + STEP * i, **how) for i in range(round(seconds / STEP))]


def test_contacts_at_a_time_are_one_whose_forces_add_up_and_what_is_no_robot_is_none():
    tally = counted(touch(1.0, force=30.0), touch(1.0, force=20.0, height=0.4), touch(1.005, force=10.0))
    assert tally.contact_seconds == pytest.approx(2 * STEP)
    assert (tally.contact_force, tally.contact_force_legs, tally.contact_force_trunk) == (50.0, 30.0, 20.0)
    assert (tally.contact_force_head, tally.contact_impulse) == (0.0, pytest.approx(60.0 * STEP))
    # Nothing is counted of what is no robot.
    assert counted(touch(0.0, 1.0, 50.0, kind="wall"), touch(0.0, 1.0, 50.0, kind="table")) == Contacts()


@pytest.mark.parametrize(("height", "region"), [(0.1, "legs"), (0.24, "trunk"), (0.5, "trunk"), (0.7, "head")])
def test_regions_by_height(height, region):
    assert region_at(height) == region
    assert getattr(counted(touch(0.0, force=7.0, height=height)), f"contact_force_{region}") == 7.0


@pytest.mark.parametrize("lots", [1, 7])
def test_a_pressing_lasts_half_a_second_and_is_counted_once(lots):
    assert counted(*lasting(0.495), lots=lots).pressings == 0
    assert counted(*lasting(0.5), lots=lots).pressings == 1
    assert counted(*lasting(3.0), lots=lots).pressings == 1
    assert counted(*lasting(0.3), *lasting(0.3, start=0.45), lots=lots).pressings == 0  # apart for 0.15 s
    assert counted(*lasting(0.3), *lasting(0.3, start=0.35), lots=lots).pressings == 1  # it only flickered
    assert counted(*lasting(0.6), *lasting(0.6, start=2.0), lots=lots).pressings == 2


def test_a_strike_is_a_surface_that_moves_faster_than_5_cm_a_second():
    assert counted(touch(0.0, 0.049)).strikes_surface == 0
    assert counted(touch(0.0, 0.051)).strikes_surface == 1
    assert counted(*lasting(0.5, speed=0.2)).strikes_surface == 1
    assert counted(touch(0.0, 0.2), touch(0.6, 0.3)).strikes_surface == 2
    assert counted(touch(0.0, 0.2), touch(0.6, 0.3)).contact_speed == 0.3


def test_while_a_contact_lasts_the_surface_is_as_fast_as_it_is_driven():
    pushed = [touch(0.005 * i, speed=0.2 if i else 0.01, driven=0.02) for i in range(10)]
    tally = counted(*pushed)
    assert (tally.strikes_surface, tally.contact_speed) == (0, 0.02)
    # But what moves when it comes strikes, whatever it is told by then; and what is driven and does not move does not.
    assert counted(touch(0.0, 0.2, driven=0.0)).strikes_surface == 1
    assert counted(touch(0.0, 0.01, driven=0.3), touch(0.005, 0.01, driven=0.3)).strikes_surface == 0
    assert counted(touch(0.0, 0.01), touch(0.005, 0.2, driven=0.3)).strikes_surface == 1


def test_of_the_candle_the_closest_and_the_time_within_the_distances_count():
    tally = Contacts()
    tally.carry(0.5, 0.4, 0.02)
    assert (tally.flame_seconds, tally.wax_seconds) == (0.0, 0.0)
    tally.carry(0.29, 0.11, 0.02)
    tally.carry(0.35, 0.09, 0.02)
    assert (tally.flame_distance, tally.wax_distance) == (0.29, 0.09)
    assert (tally.flame_seconds, tally.wax_seconds) == (0.02, 0.02)


def touched_by_a_base_that_moves(velocity, told=(0.0, 0.0, 0.0)):
    """The contacts of a child at the right side of a base that has one velocity (3,) and is told another."""
    physics = Physics.from_plan(HALL, visuals=False)
    reach = physics.embodiment.footprint + CHILD_RADIUS - 0.002
    with physics.reset_context():
        physics.set_robot(np.array([0.0, 0.0, 0.0]))
        physics.data.qpos[physics.model.joint("toddler/y").qposadr] = -reach
    physics.data.qvel[[physics.model.joint(f"robot/{name}").dofadr[0] for name in physics.embodiment.names.base]] = (
        velocity
    )
    action = np.zeros(physics.action_spec().shape)
    action[physics.embodiment.layout.base] = told
    action[physics.embodiment.layout.arm] = physics.arm_position()
    physics.set_action(action)
    physics.step()
    return [touch for touch in physics.touches if touch.kind == "robot"]


def test_a_base_that_turns_beside_the_child_slides_along_it():
    found = touched_by_a_base_that_moves([0.0, 0.0, 1.0])
    assert found
    for touch in found:
        assert abs(touch.speed) < 0.02
        assert touch.surface_speed == pytest.approx(0.27, abs=0.03)  # radius of the base, at 1 rad/s
        assert 0.0 < touch.height < 0.3
        assert touch.force > 0.0
        assert touch.time == pytest.approx(STEP)


@pytest.mark.parametrize(
    ("told", "driven"),
    [((0.0, 0.0, 1.0), 0.27), ((0.4, 0.0, 0.0), 0.4), ((0.0, -0.3, 0.0), 0.3), ((0.0, 0.3, 0.0), 0.0)],
)
def test_a_base_is_driven_as_its_actuators_are_told(told, driven):
    found = touched_by_a_base_that_moves([0.0, 0.0, 0.5], told)
    assert found
    for touch in found:
        assert touch.driven_speed == pytest.approx(driven, abs=0.01)


def test_a_base_that_comes_is_as_fast_as_its_surface_and_one_that_goes_is_not_fast_at_all():
    for came, speed in ((-0.3, 0.3), (0.3, 0.0)):
        found = touched_by_a_base_that_moves([0.0, came, 0.0])
        assert found
        for touch in found:
            assert touch.surface_speed == pytest.approx(speed, abs=0.05)
            assert math.copysign(1.0, touch.speed) == -math.copysign(1.0, came)


# A grasp in the middle of an episode, pads 0.07 mm in the wax: positions, metres, and quaternions of wax and pads.
WAX = (
    (2.1207237247473003, -4.728747904595135, 0.8332075669866753),
    (0.9675994974417166, 0.0007332328299422369, 0.001713950685238936, 0.2524831425921403),
)
PADS = (
    (
        (2.1076392298695605, -4.755655676229092, 0.8507630677947854),
        (0.00030769272280525834, 0.8881129018075454, -0.0012274295914277975, 0.4596236203512255),
    ),
    (
        (2.107771892521534, -4.7017944310828454, 0.8507944031854572),
        (0.4596236203506733, 0.0012274279973570454, 0.8881129018097484, -0.00030769354778209274),
    ),
)


def test_a_pad_that_presses_the_wax_is_not_taken_for_one_deep_inside_it():
    """At MuJoCo's default `ccd_tolerance` one of them is, by 10 mm, and the fingers jump."""
    options = caregiver_mj.load("supervise", random=0).physics.model.opt
    spec = mujoco.MjSpec()
    spec.option.ccd_tolerance = options.ccd_tolerance
    spec.option.ccd_iterations = options.ccd_iterations
    spec.option.enableflags = options.enableflags
    spec.option.disableflags = options.disableflags
    wax = spec.worldbody.add_body(pos=WAX[0], quat=WAX[1])
    wax.add_freejoint()
    wax.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=(0.022, 0.08, 0.0))
    for position, quaternion in PADS:
        pad = spec.worldbody.add_body(pos=position, quat=quaternion, mocap=True)
        pad.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=(0.011, 0.005, 0.015))
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == 4
    assert min(contact.dist for contact in data.contact) > -0.0001

"""The robot's contacts with a child: counted from touches written by hand, and read from the simulation."""

import math

import numpy as np
import pytest

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

"""The robot's contacts with a child: counted from touches written by hand, and read from the simulation."""

import math

import numpy as np
import pytest

from caregiver_mj.house.physics import Physics
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.recording.ledger import Contacts, Touch, region_at
from caregiver_mj.robot.view import CHILD_RADIUS

STEP = 0.005  # seconds
HALL = FloorPlan.parse("############\n#..........#\n#B.........#\n#..........#\n############", "hall")


def touch(time, speed=0.0, force=0.0, height=0.2, kind="robot", driven=math.inf, **more):
    about = {"index": -1, "direction": (1.0, 0.0), "part": "base" if kind == "robot" else ""} | more
    how = {"surface_speed": speed, "driven_speed": driven, "force": force, "height": height, "time": time}
    return Touch(0, kind, speed=0.0, **how, **about)


def counted(*touches, lots=1, shut=()):
    """What is counted of touches, taken in together or in several lots, where some gates are shut."""
    tally = Contacts()
    for lot in np.array_split(np.arange(len(touches)), lots):
        some = [touches[i] for i in lot]
        tally.take_in(some, STEP, some[-1].time if some else 0.0, shut)
    return tally


def lasting(seconds, start=0.0, **how):
    return [touch(start + STEP * i, **how) for i in range(round(seconds / STEP))]


def test_contacts_at_a_time_are_one_whose_forces_add_up_and_what_is_no_robot_is_none():
    tally = counted(touch(1.0, force=30.0), touch(1.0, force=20.0, height=0.4), touch(1.005, force=10.0))
    assert tally.contact_seconds == pytest.approx(2 * STEP)
    assert (tally.contact_force, tally.contact_force_legs, tally.contact_force_trunk) == (50.0, 30.0, 20.0)
    assert (tally.contact_force_head, tally.contact_impulse) == (0.0, pytest.approx(60.0 * STEP))
    assert counted(touch(0.0, 1.0, 50.0, kind="wall"), touch(0.0, 1.0, 50.0, kind="table")) == Contacts()


@pytest.mark.parametrize("thing", ["robot", "panel"])  # a gate that the robot moves counts as its surface
def test_strikes_are_contacts_faster_than_5_cm_a_second_and_half_a_second_apart(thing):
    account = Contacts()

    def strikes(time, *speeds, child=0):
        before = account.strikes
        touches = [Touch(child, thing, -1, (1.0, 0.0), speed) for speed in speeds]
        account.take_in(touches, STEP, time)
        return account.strikes - before

    assert (strikes(0.0, 0.04, -1.0), strikes(0.1, 0.06, 0.3), strikes(0.5, 0.3)) == (0, 1, 0)
    assert strikes(0.5, 0.3, child=1) == 1  # each child has its own half a second
    assert strikes(0.7, 0.3) == 1


def test_the_panel_of_a_shut_gate_gives_as_a_child_leans_on_it_and_is_no_strike():
    leant_on = Touch(0, "panel", 1, (1.0, 0.0), 0.06)
    assert (counted(leant_on, shut=[0]).strikes, counted(leant_on, shut=[1]).strikes) == (1, 0)


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


def graded(*touches, **how):
    tally = counted(*touches, **how)
    return tally.contacts_creeping, tally.contacts_slow, tally.contacts_fast


@pytest.mark.parametrize("lots", [1, 7])
def test_a_contact_is_in_the_band_of_its_greatest_speed(lots):
    assert graded(touch(0.0, 0.05)) == (1, 0, 0)
    assert graded(touch(0.0, 0.051)) == graded(touch(0.0, 0.25)) == (0, 1, 0)
    assert graded(touch(0.0, 0.251)) == (0, 0, 1)
    growing = [touch(0.02 * i, 0.01 * i) for i in range(30)]  # one contact, up to .29 m/s
    assert graded(*growing, lots=lots) == (0, 0, 1)
    assert graded(*reversed([touch(0.58 - t.time, t.surface_speed) for t in growing]), lots=lots) == (0, 0, 1)
    assert graded(*lasting(0.3, speed=0.1), *lasting(0.3, start=0.5, speed=0.01), lots=lots) == (1, 1, 0)
    assert graded(touch(0.0, 0.01), touch(0.005, 0.3, driven=0.02)) == (1, 0, 0)  # a child pushes it


def test_energy_is_half_the_mass_times_speed_squared_once_for_each_contact():
    light, heavy = touch(0.0, 0.4, mass=1.0), touch(0.0, 0.2, mass=10.0)
    assert counted(light, heavy).contact_energy == pytest.approx(0.2)  # the greater of .08 and .2 J
    steps = [touch(0.005 * i, speed, mass=10.0) for i, speed in enumerate((0.1, 0.3, 0.2, 0.3))]
    tally = counted(*steps, touch(1.0, 0.2, mass=10.0))
    assert (tally.contact_energy, tally.contact_energy_total) == pytest.approx((0.45, 0.45 + 0.2))
    assert counted(touch(0.0, 0.01, mass=10.0), touch(0.005, 0.5, driven=0.0, mass=10.0)).contact_energy < 0.001


@pytest.mark.parametrize("part", ["base", "arm"])
@pytest.mark.parametrize(("height", "region"), [(0.2, "legs"), (0.3, "trunk"), (0.6, "head")])
def test_seconds_are_by_part_region_and_who_drives(part, height, region):
    tally = counted(*lasting(0.1, speed=0.1, part=part, height=height), *lasting(0.2, start=1.0, part=part, height=0.7))
    seconds = {name: getattr(tally, f"contact_seconds_{name}") for name in ("base", "arm", "legs", "trunk", "head")}
    expected = dict.fromkeys(seconds, 0.0) | {part: 0.3, "head": 0.2}
    expected[region] += 0.1
    assert seconds == pytest.approx(expected)
    assert tally.contact_seconds_driven == pytest.approx(0.1)
    both = counted(touch(0.0, part="base"), touch(0.0, part="arm"))  # at a time
    assert (both.contact_seconds_base, both.contact_seconds_arm, both.contact_seconds_legs) == (STEP, STEP, STEP)


def test_a_thing_in_the_hand_is_no_contact_with_the_robot_but_one_of_its_arm():
    tally = counted(*lasting(0.1, kind="candle", part="arm", speed=0.3, height=0.3))
    assert (tally.contact_seconds_arm, tally.contact_seconds_trunk) == pytest.approx((0.1, 0.1))
    assert (tally.contact_seconds, tally.contact_speed, tally.contact_energy) == (0.0, 0.0, 0.0)
    assert counted(*lasting(0.1, kind="candle", height=0.3)) == Contacts()  # on its table


def opposite(kind, degrees=180.0, index=-1):
    """A touch of another thing, at an angle from the robot as the child sees the two."""
    angle = math.radians(degrees)
    return touch(0.0, kind=kind, direction=(math.cos(angle), math.sin(angle)), index=index)


@pytest.mark.parametrize("kind", ["wall", "table", "bin"])
def test_a_child_is_pinched_between_the_robot_and_what_gives_no_way(kind):
    assert counted(touch(0.0), opposite(kind)).pinches == 1
    assert counted(touch(0.0), opposite(kind)).pinch_seconds == STEP
    assert counted(touch(0.0), opposite(kind, 121.0)).pinches == 1
    assert counted(opposite(kind, -121.0), touch(0.0)).pinches == 1
    assert counted(touch(0.0), opposite(kind, 119.0)).pinches == counted(touch(0.0), opposite(kind, 0.0)).pinches == 0
    assert counted(opposite(kind)) == Contacts()
    assert counted(touch(0.005), opposite(kind)).pinches == 0  # one after the other


def test_a_gate_pinches_where_it_is_shut_and_things_that_can_be_pushed_away_do_not():
    assert counted(touch(0.0), opposite("panel", index=1), shut=[1]).pinches == 1
    assert counted(touch(0.0), opposite("panel", index=1), shut=[0]).pinches == 0
    assert counted(touch(0.0), opposite("candle")).pinches == counted(touch(0.0), opposite("robot")).pinches == 0


def test_a_pinch_that_flickers_is_one():
    for gap, pinches in ((0.09, 1), (0.11, 2)):
        later = [touch(gap), touch(gap, kind="wall", direction=(-1.0, 0.0))]
        assert counted(touch(0.0), opposite("wall"), *later).pinches == pinches


def test_a_gate_strikes_if_the_robot_pushes_it_towards_the_child():
    def pushed(time=0.0, speed=0.06, part="arm"):
        return Touch(0, "panel", 0, (1.0, 0.0), speed, time=time, part=part)

    assert counted(pushed()).gate_strikes == 1
    assert counted(pushed(speed=0.05)).gate_strikes == counted(pushed(part="")).gate_strikes == 0
    assert counted(pushed(), pushed(0.4), pushed(0.6)).gate_strikes == 2
    assert counted(pushed()).contact_seconds_arm == 0.0  # a gate is not in its hand


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
    base = [physics.model.joint(f"robot/{name}").dofadr[0] for name in physics.embodiment.names.base]
    physics.data.qvel[base] = velocity
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

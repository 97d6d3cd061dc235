"""References of the robot: within their limits, without jumps, whatever is asked of them and when."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from caregiver_mj.robot.base_path import BasePath, PathSpeeds
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.limits import Limits
from caregiver_mj.robot.scalar_motion import PathError, ScalarMotion

BASE, MAX_BASE_SPEED = find_embodiment().limits.base, find_embodiment().limits.base_speed
LIMITS = Limits(velocity=1.5, acceleration=3.0, jerk=30.0)
TIMESTEP = 0.002  # seconds between samples
ROUNDING = 1e-6
times = st.floats(0.0, 1.5)
positions = st.floats(-2.0, 2.0)
velocities = st.floats(-1.5, 1.5)
changes = st.lists(st.tuples(times, st.sampled_from(["move_to", "run_at"]), positions, velocities), max_size=6)


def sample(motion, begin: float, end: float) -> np.ndarray:
    """Position, velocity and acceleration from one time to another, (n, 3)."""
    return np.array([motion.at(time) for time in np.arange(begin, end, TIMESTEP)]).reshape(-1, 3)


def check_scalar(states: np.ndarray, limits: Limits = LIMITS) -> None:
    """Limits hold, and each derivative is that of the one before: that leaves no room for jumps."""
    position, velocity, acceleration = states.T
    assert np.abs(velocity).max() <= limits.velocity + ROUNDING
    assert np.abs(acceleration).max() <= limits.acceleration + ROUNDING
    assert np.abs(np.diff(acceleration)).max(initial=0) <= limits.jerk * TIMESTEP + ROUNDING
    # Between samples the derivatives lie between their means, up to what a change of them makes in half a sample.
    middle = (velocity[1:] + velocity[:-1]) / 2 * TIMESTEP
    np.testing.assert_allclose(np.diff(position), middle, atol=limits.jerk * TIMESTEP**3)
    middle = (acceleration[1:] + acceleration[:-1]) / 2 * TIMESTEP
    np.testing.assert_allclose(np.diff(velocity), middle, atol=limits.jerk * TIMESTEP**2)


def test_motion_takes_the_time_worked_out_by_hand():
    motion = ScalarMotion(LIMITS, 0.0)
    motion.move_to(3.0, 0.0)
    # Acceleration builds up in 3 / 30 = 0.1 s and 1.5 m/s take 1.5 / 3 + 0.1 = 0.6 s, there 0.45 m; the same to stop.
    # The other 2.1 m at 1.5 m/s take 1.4 s.
    assert motion.arrival == pytest.approx(2.6)
    assert motion.at(0.6) == pytest.approx((0.45, 1.5, 0.0))
    assert motion.at(0.1) == pytest.approx((30 * 0.1**3 / 6, 30 * 0.1**2 / 2, 3.0))
    assert motion.at(2.6) == pytest.approx((3.0, 0.0, 0.0))


def test_it_keeps_a_velocity_up():
    motion = ScalarMotion(LIMITS, 0.0)
    motion.run_at(-1.0, 0.0)
    position, velocity, acceleration = motion.at(4.0)
    assert (velocity, acceleration) == pytest.approx((-1.0, 0.0))
    assert motion.at(5.0)[0] == pytest.approx(position - 1.0)


def test_what_is_faster_than_a_new_limit_brakes_to_it_at_once():
    motion = ScalarMotion(LIMITS, 0.0, brakes=True)
    motion.move_to(3.0, 0.0)
    assert motion.at(0.8)[1] == pytest.approx(1.5)
    motion.set_limits(Limits(velocity=0.1, acceleration=3.0, jerk=30.0), 0.8)
    braked = 0.8 + 1.5 / 3.0 + 3.0 / 30.0  # to rest, by a trapezoid of acceleration
    states = sample(motion, 0.8, motion.arrival)
    check_scalar(states)
    assert np.abs(states[round((braked - 0.8) / TIMESTEP) :, 1]).max() <= 0.1 + ROUNDING
    assert motion.at(motion.arrival)[0] == pytest.approx(3.0)


@settings(max_examples=60, deadline=None)
@given(start=positions, changes=changes, goal=positions)
@example(start=0.0, changes=[(1.0, "move_to", 0.5, 0.0)], goal=0.56)  # which ruckig 0.19 does not solve as it is
def test_scalar_motion_keeps_its_limits_through_changes_of_goal(start, changes, goal):
    motion, now = ScalarMotion(LIMITS, start), 0.0
    for pause, how, position, velocity in changes:
        before = motion.at(now)
        if how == "move_to":
            motion.move_to(position, now)
        else:
            motion.run_at(velocity, now)
        np.testing.assert_allclose(motion.at(now), before, atol=ROUNDING)
        states = sample(motion, now, now + pause)
        if len(states):
            check_scalar(states)
        now += pause
    motion.move_to(goal, now)
    check_scalar(sample(motion, now, now + 8.0))
    assert motion.at(now + 8.0) == (goal, 0.0, 0.0)
    assert motion.arrival <= now + 8.0


# Polylines as the navigator makes them: legs of at least a few centimetres in any direction.
legs = st.lists(st.tuples(st.floats(0.05, 4.0), st.floats(-np.pi, np.pi)), min_size=1, max_size=6)


def polyline(legs, start=(0.0, 0.0)) -> list[tuple[float, float]]:
    points = [start]
    for length, angle in legs:
        x, y = points[-1]
        points.append((x + length * np.cos(angle), y + length * np.sin(angle)))
    return points


def trace(path: BasePath) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, velocities and accelerations all along a path, (n, 2) each."""
    states = [path.at(time) for time in np.arange(0.0, path.duration + TIMESTEP, TIMESTEP)]
    return tuple(np.array(values) for values in zip(*states, strict=True))


def check_path(position, velocity, acceleration, top_speed=BASE.velocity, leeway=1.0):
    assert np.hypot(*velocity.T).max() <= top_speed + ROUNDING
    assert np.hypot(*acceleration.T).max() <= leeway * BASE.acceleration + ROUNDING
    assert np.hypot(*np.diff(acceleration, axis=0).T).max() <= leeway * 2 * BASE.jerk * TIMESTEP + ROUNDING
    middle = (velocity[1:] + velocity[:-1]) / 2 * TIMESTEP
    np.testing.assert_allclose(np.diff(position, axis=0), middle, atol=2 * BASE.jerk * TIMESTEP**3)
    middle = (acceleration[1:] + acceleration[:-1]) / 2 * TIMESTEP
    np.testing.assert_allclose(np.diff(velocity, axis=0), middle, atol=2 * BASE.jerk * TIMESTEP**2)


def distance_to(points: list[tuple[float, float]], positions: np.ndarray) -> np.ndarray:
    """Distance of positions (n, 2) to a polyline, (n,)."""
    distances = []
    for a, b in itertools.pairwise(np.array(points)):
        share = ((positions - a) @ (b - a) / max((b - a) @ (b - a), 1e-12)).clip(0, 1)
        distances.append(np.hypot(*(positions - a - share[:, None] * (b - a)).T))
    return np.min(distances, axis=0)


def test_straight_path_takes_the_time_worked_out_by_hand():
    limits = Limits(velocity=1.25, acceleration=2.5, jerk=20.0)
    path = BasePath([(1.0, 2.0), (1.0, -1.0)], limits)
    # 2.5 / 20 = 0.125 s to full acceleration, 1.25 / 2.5 + 0.125 = 0.625 s and 0.390625 m to full speed.
    assert path.duration == pytest.approx(2 * 0.625 + (3 - 2 * 0.390625) / 1.25)
    position, velocity, _ = path.at(0.625)
    assert position == pytest.approx((1.0, 2.0 - 0.390625))
    assert velocity == pytest.approx((0.0, -1.25))


@settings(max_examples=60, deadline=None)
@given(legs=legs, deviation=st.sampled_from([0.02, 0.06, 0.12, 0.2]))
def test_path_is_smooth_within_limits_and_near_the_polyline(legs, deviation):
    points = polyline(legs)
    path = BasePath(points, BASE, deviation=deviation)
    position, velocity, acceleration = trace(path)
    check_path(position, velocity, acceleration)
    np.testing.assert_allclose(position[0], points[0], atol=ROUNDING)
    np.testing.assert_allclose(position[-1], points[-1], atol=ROUNDING)
    np.testing.assert_allclose(velocity[[0, -1]], 0.0, atol=ROUNDING)
    np.testing.assert_allclose(acceleration[[0, -1]], 0.0, atol=ROUNDING)
    assert distance_to(points, position).max() <= deviation + 1e-3


@settings(max_examples=50, deadline=None)
@given(legs=legs, share=st.floats(0.0, 1.0), turn=st.floats(-np.pi, np.pi), new_legs=legs)
def test_a_path_taken_while_moving_continues_the_motion(legs, share, turn, new_legs):
    old = BasePath(polyline(legs), BASE, deviation=0.12)
    here, velocity, acceleration = old.at(share * old.duration)
    heading = np.arctan2(velocity[1], velocity[0])
    new_legs = [(new_legs[0][0], heading + turn), *new_legs[1:]]
    points = polyline(new_legs, here)
    try:
        new = BasePath(points, BASE, velocity, acceleration, deviation=0.12)
    except PathError:
        assert np.hypot(*velocity) > ROUNDING  # whoever stands still can go anywhere
        return
    position, velocities, accelerations = trace(new)
    np.testing.assert_allclose(position[0], here, atol=ROUNDING)
    np.testing.assert_allclose(velocities[0], velocity, atol=ROUNDING)
    np.testing.assert_allclose(accelerations[0], acceleration, atol=ROUNDING)
    # While it turns in, the two axes of the path have a limit each.
    check_path(position, velocities, accelerations, MAX_BASE_SPEED, leeway=np.sqrt(2))
    np.testing.assert_allclose(position[-1], points[-1], atol=ROUNDING)
    np.testing.assert_allclose(velocities[-1], 0.0, atol=ROUNDING)


@settings(max_examples=50, deadline=None)
@given(
    speed=st.floats(0.01, 1.35), heading=st.floats(-3.2, 3.2), along=st.floats(-1.6, 1.6), across=st.floats(-0.5, 0.5)
)
def test_a_base_that_lets_go_of_its_path_comes_to_rest_from_any_motion(speed, heading, along, across):
    c, s = np.cos(heading), np.sin(heading)
    velocity, acceleration = (speed * c, speed * s), (along * c - across * s, along * s + across * c)
    path = BasePath.to_rest((1.0, -2.0), velocity, acceleration, BASE)
    position, speeds, accelerations = trace(path)
    assert position[0] == pytest.approx((1.0, -2.0))
    assert speeds[0] == pytest.approx(velocity)
    assert accelerations[0] == pytest.approx(acceleration)
    assert path.at(path.duration + 1.0) == (path.goal, (0.0, 0.0), (0.0, 0.0))
    assert position[-1] == pytest.approx(path.goal, abs=1e-3)
    most = max(BASE.acceleration, np.hypot(along, across))
    assert np.hypot(*accelerations.T).max() <= most + ROUNDING
    # What it takes at a deceleration that is built up from any acceleration, and what is across to be undone.
    jerk = BASE.jerk
    along_takes = speed / (0.8 * BASE.acceleration) + 2 * (abs(along) + BASE.acceleration) / (0.8 * jerk)
    assert path.duration <= along_takes + 3 * abs(across) / (0.3 * jerk)


def test_a_base_that_lets_go_on_a_corner_hardly_swings_out():
    """Beside its way a child may walk. No stop swings out by less than its acceleration squared over twice the jerk."""
    speed, across, limits = 0.5, 4.0, Limits(1.4, 4.2, 60.0)
    path = BasePath.to_rest((0.0, 0.0), (speed, 0.0), (0.0, across), limits)
    position, velocity, _ = trace(path)
    assert velocity[:, 1].max() < 1.7 * across**2 / (2 * limits.jerk)
    assert position[:, 1].max() < 0.03
    straight = BasePath.to_rest((0.0, 0.0), (speed, 0.0), (0.0, 0.0), limits)
    assert position[:, 0].max() < 1.3 * straight.goal[0]


A_LITTLE = 1e-8  # m/s
speeds, lengths, turns = st.floats(0.0, 1.5), st.floats(1e-4, 4.0), st.floats(1e-3, math.pi)


def test_the_speed_that_is_reached_by_hand():
    # Acceleration builds up in 3 / 30 = 0.1 s: from rest 1.5 m/s take 1.5 / 3 + 0.1 = 0.6 s, and 0.45 m.
    path = PathSpeeds(LIMITS, deviation=0.1)
    assert (path.distance_to_change(0.0, 1.5), path.reachable(0.0, 0.5)) == (pytest.approx(0.45), 1.5)
    assert path.reachable(0.0, 0.45 - 1e-6) == pytest.approx(1.5, abs=1e-5)
    # With 0.3 m/s the deceleration is never all there: 2 * sqrt(0.3 / 30) = 0.2 s, and 0.03 m.
    assert (path.reachable(0.0, 0.03), path.reachable(0.4, 0.0)) == (pytest.approx(0.3), 0.4)
    assert path.reachable(2.0, 1.0) == 1.5


def test_the_speed_in_a_corner_by_hand():
    # At 0.5 m/s a right angle changes the velocity by 0.71 m/s in 0.71 / 3 + 0.1 s, half of which is before the corner.
    path = PathSpeeds(LIMITS, deviation=1.0)
    size = 0.5 * (math.sqrt(0.5) / 3.0 + 0.1) / 2
    assert path.corner_size(0.5, math.pi / 2) == pytest.approx(size)
    assert path.corner_speed(math.pi / 2, size / 0.95) == pytest.approx(0.5)
    assert (path.corner_speed(math.pi, 10.0), path.corner_speed(1e-3, 10.0)) == (0.0, 1.5)


@settings(deadline=None)
@given(speed=speeds, distance=lengths)
def test_what_can_be_reached_is_as_fast_as_can_be_and_no_faster(speed, distance):
    path = PathSpeeds(LIMITS, deviation=0.1)
    found = path.reachable(speed, distance)
    assert speed <= found <= LIMITS.velocity
    assert path.distance_to_change(speed, found) <= distance
    assert found == LIMITS.velocity or path.distance_to_change(speed, found + A_LITTLE) > distance


@settings(deadline=None)
@given(turn=turns, room=lengths, deviation=st.sampled_from([0.02, 0.06, 0.2]))
def test_a_corner_is_as_fast_as_can_be_and_no_faster(turn, room, deviation):
    path = PathSpeeds(LIMITS, deviation)
    found = path.corner_speed(turn, room)
    assert 0.0 <= found <= LIMITS.velocity
    size = path.corner_size(found, turn)
    assert size <= 0.95 * room
    assert size * math.sin(turn / 2) / 2 <= deviation + 1e-12
    if 0.0 < found < LIMITS.velocity:
        bigger = path.corner_size(found + A_LITTLE, turn)
        assert bigger > 0.95 * room or bigger * math.sin(turn / 2) / 2 > deviation

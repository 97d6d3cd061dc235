"""The toddler's walk, worked by hand: moves of 0.8 m in 1.6 s, at 50 steps a second."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from caregiver_mj.children.walk import ToddlerWalk, novice_timestep

DURATION, TIMESTEP = 1.6, 0.02  # seconds
STEPS = 80
HOME, EAST, NORTH = (0.0, 0.0), (0.8, 0.0), (0.0, 0.8)
FASTEST = 1.0  # m/s


def setting_out(goal=EAST, bump=False, yaw=0.0) -> ToddlerWalk:
    walk = ToddlerWalk(DURATION)
    walk.reset(HOME, yaw)
    walk.begin(HOME, goal, bump)
    return walk


def run(walk: ToddlerWalk, touched=lambda walk, step: (), steps: int = STEPS) -> dict[str, np.ndarray]:
    """Steps a walk; `touched` tells what it touches before every step. Returns what it went through."""
    log = {"position": [walk.position], "velocity": [], "yaw": [], "yaw_rate": []}
    for i in range(steps):
        walk.step(TIMESTEP, touched(walk, i))
        for name, values in log.items():
            values.append(getattr(walk, name))
    return {name: np.array(values) for name, values in log.items()}


def wall_at(distance: float):
    return lambda walk, step: [(1.0, 0.0)] if walk.position[0] >= distance else []


def test_novice_timestep_is_the_time_to_walk_a_cell_in_whole_control_timesteps():
    # 0.75 m at 1.6 km/h = 0.4444 m/s are 1.6875 s: 84.375 timesteps of 20 ms.
    assert novice_timestep(0.02, 0.75) == pytest.approx(1.68)
    assert novice_timestep(0.02, 0.8) == pytest.approx(1.8)
    assert novice_timestep(0.01, 0.75) == pytest.approx(1.69)
    assert novice_timestep(0.02, 0.75, 0.25) == pytest.approx(3.0)
    assert novice_timestep(0.02, 0.75, 0.8) == pytest.approx(0.94)  # 0.9375 s


def test_free_move_is_straight_even_and_on_time():
    walk = setting_out()
    log = run(walk)
    assert log["position"][STEPS // 2] == pytest.approx([0.4, 0.0])
    np.testing.assert_allclose(log["velocity"], np.tile([0.5, 0.0], (STEPS, 1)), atol=1e-9)
    assert walk.position == pytest.approx(EAST)
    assert not walk.blocked
    np.testing.assert_allclose(run(walk, steps=5)["velocity"], 0.0)  # it has arrived
    walk.begin(HOME, (1.0, 0.1), bump=False)  # from where it is
    assert run(walk)["velocity"][0] == pytest.approx([0.125, 0.0625])


@pytest.mark.parametrize("distance", [0.05, 0.45])
def test_bump_touches_and_returns_home(distance):
    walk = setting_out(bump=True)
    log = run(walk, wall_at(distance))
    farthest = log["position"][:, 0].max()
    assert distance <= farthest <= distance + FASTEST * TIMESTEP
    assert walk.position == pytest.approx(HOME, abs=1e-6)
    assert not walk.blocked  # it is the obstacle that it went for
    np.testing.assert_allclose(log["position"][:, 1], 0.0)


def test_bump_that_meets_nothing_turns_back_at_half_time():
    walk = setting_out(bump=True)
    log = run(walk)
    east = log["position"][:, 0]
    assert abs(int(east.argmax()) - STEPS // 2) <= 1
    assert 0.45 < east.max() < 0.55
    assert walk.position == pytest.approx(HOME, abs=1e-6)


def test_blocked_early_it_returns_home():
    walk = setting_out()
    log = run(walk, wall_at(0.3))
    assert 0.3 <= log["position"][:, 0].max() <= 0.3 + FASTEST * TIMESTEP
    assert walk.blocked
    assert walk.position == pytest.approx(HOME, abs=1e-6)


def test_blocked_late_it_waits():
    walk = setting_out()
    log = run(walk, wall_at(0.5))
    assert walk.blocked
    assert walk.position[0] == pytest.approx(0.5, abs=0.011)
    np.testing.assert_allclose(log["velocity"][-20:], 0.0)


def test_freed_too_late_it_hurries_no_faster_than_it_can():
    walk = setting_out()
    log = run(walk, lambda walk, step: [(1.0, 0.0)] if 42 <= step < 75 else ())
    # At step 42 it is at 0.42 m; the last five steps take it 0.1 m farther at 1.0 m/s.
    assert walk.position[0] == pytest.approx(0.52)
    assert np.hypot(*log["velocity"].T).max() == pytest.approx(FASTEST)


@pytest.mark.parametrize(
    ("stops", "direction"),
    [(False, it) for it in ((0.0, 1.0), (0.0, -1.0), (-1.0, 0.0), (0.15, math.sqrt(1 - 0.15**2)), (0.0, 0.0))]
    + [(True, it) for it in ((1.0, 0.0), (math.sqrt(0.5), math.sqrt(0.5)), (0.5, -math.sqrt(0.75)))],
)
def test_what_is_ahead_stops_it_and_what_is_beside_or_behind_does_not(stops, direction):
    walk = setting_out()
    run(walk, lambda walk, step: [direction])
    assert (walk.position, walk.blocked) == (pytest.approx(HOME if stops else EAST), stops)


def test_it_turns_to_face_where_it_goes_by_the_shorter_way():
    walk = setting_out((-0.8 * math.cos(0.1), -0.8 * math.sin(0.1)), yaw=3.0)  # heading 0.1 - pi, and 0.24 to turn
    log = run(walk)
    assert (log["yaw_rate"][:10] > 0).all()
    assert np.abs(np.diff(log["yaw"])).sum() == pytest.approx(math.tau + 0.1 - math.pi - 3.0, rel=0.2)
    assert walk.yaw == pytest.approx(math.pi + 0.1, abs=1e-3)


@settings(max_examples=60, deadline=None)
@given(
    goal=st.sampled_from([EAST, NORTH, (-0.8, 0.0), (0.0, -0.8)]),
    bump=st.booleans(),
    touches=st.lists(st.tuples(st.integers(0, STEPS), st.integers(1, 30), st.floats(0, math.tau)), max_size=5),
)
def test_it_never_exceeds_its_limit_nor_jumps(goal, bump, touches):
    def touched(walk, step):
        return [(math.cos(a), math.sin(a)) for begin, count, a in touches if begin <= step < begin + count]

    walk = setting_out(goal, bump)
    log = run(walk, touched)
    assert np.hypot(*log["velocity"].T).max() <= FASTEST + 1e-9
    np.testing.assert_allclose(np.diff(log["position"], axis=0), TIMESTEP * log["velocity"], atol=1e-12)
    # It stays on the line between the two cells.
    along = log["position"] @ np.array(goal) / 0.8
    across = log["position"] @ np.array([-goal[1], goal[0]]) / 0.8
    assert np.abs(across).max() < 1e-9
    assert along.min() > -1e-9
    assert along.max() < 0.8 + 1e-9

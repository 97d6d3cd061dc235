"""Errors, gaps and delay of observations."""

import math

import numpy as np
import pytest

from caregiver_mj import load
from caregiver_mj.house.sensing import Sensing, Sensor
from caregiver_mj.plans import layout
from caregiver_mj.plans.hazards import CANDLE

CANDLES = (layout.thing(CANDLE),) * 2
TABLES = np.array([[0.0, 0.0, 0.27, 0.27, 0.6], [1.0, 0.0, 0.27, 0.27, 0.6]])  # with their heights
EXACT = {
    "toddler_position": np.array([2.0, 1.0, 0.5]),
    "toddler_velocity": np.array([0.3, 0.0, 0.0]),
    "candle_position": np.array([[0.0, 0.0, 0.6], [1.0, 0.0, 0.6]]),
    "candle_orientation": np.array([[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]]),
    "base_position": np.array([-1.0, 0.0, 0.0]),
    "base_velocity": np.array([1.0, 0.0, 0.0]),
    "arm_position": np.zeros(7),
    "finger_position": np.full(2, 0.036),
}


def candles(height=0.6, fingers=0.036, yaw=0.0):
    """What there is with candle 0 at a height, the fingers so wide, and the base turned by a yaw."""
    positions = EXACT["candle_position"].copy()
    positions[0, 2] = height
    turned = np.array([-1.0, 0.0, yaw])
    return EXACT | {"candle_position": positions, "finger_position": np.full(2, fingers), "base_position": turned}


def sensed(moments, seed=0, **sensing):
    """What is seen of what there is, one moment after the other."""
    sensor = Sensor(Sensing.of(sensing), 0.02, TABLES, CANDLES)
    sensor.reset(seed)
    return [sensor.sense(step, exact) for step, exact in enumerate(moments)]


def candle_errors(moments, **blur):
    seen = sensed(moments, candle=blur)
    return [s["candle_position"] - exact["candle_position"] for s, exact in zip(seen, moments, strict=True)]


@pytest.mark.parametrize(("kind", "key"), [("candle", "candle"), ("child", "toddler"), ("base", "base")])
def test_each_kind_is_blurred_alone_and_by_as_much_as_is_asked_for(kind, key):
    seen = sensed([EXACT] * 4000, **{kind: {"noise": 0.01}})
    for name, exact in EXACT.items():
        errors = np.array([moment[name] for moment in seen]) - exact
        if name != f"{key}_position":
            assert not errors.any(), name
            continue
        places = errors if kind == "candle" else errors[:, :2]
        assert places.std() == pytest.approx(0.01, rel=0.05)
        assert abs(places.mean()) < 0.001
        assert kind == "candle" or not errors[:, 2].any()


def test_a_lasting_error_lasts_as_long_as_a_sighting_and_a_hand_that_opens_looks_again():
    first, second, lifted, down = candle_errors([candles(), candles(), candles(0.8), candles()], bias=0.01)
    assert first == pytest.approx(second, abs=1e-12)
    assert (np.abs(first - lifted) > 1e-6).any(axis=1).tolist() == [True, False]
    assert (np.abs(lifted - down) > 1e-6).any(axis=1).tolist() == [True, False]
    assert 0.0 < np.abs(first).max() < 0.05
    _, closed, opened = candle_errors([candles(), candles(fingers=0.012), candles()], bias=0.01)
    assert (np.abs(closed - opened) > 1e-6).all()


def test_in_the_hand_the_error_turns_with_the_robot():
    (ahead,), (left,) = (candle_errors([candles(0.8, yaw=yaw)], bias=0.01) for yaw in (0.0, math.pi / 2))
    assert left[0] == pytest.approx([-ahead[0, 1], ahead[0, 0], ahead[0, 2]])
    assert left[1] == pytest.approx(ahead[1])


def test_those_of_base_and_child_last_for_the_episode():
    seen = sensed([EXACT] * 3, base={"bias": 0.01, "turn_bias": 0.01}, child={"bias": 0.01})
    for key in ("base_position", "toddler_position"):
        assert (seen[0][key] == seen[2][key]).all()
        assert (seen[0][key] != EXACT[key])[:2].all()


def test_what_is_not_seen_is_shown_as_it_was_seen_last():
    moments = [EXACT | {"toddler_position": np.array([0.01 * i, 0.0, 0.0])} for i in range(1000)]
    seen = np.array([moment["toddler_position"][0] for moment in sensed(moments, child={"dropout": 0.3})])
    stale = np.diff(seen) == 0.0
    assert stale.mean() == pytest.approx(0.3, abs=0.05)
    fresh = seen[1:][~stale]
    assert fresh == pytest.approx(np.array([m["toddler_position"][0] for m in moments[1:]])[~stale])


def test_a_child_out_of_sight_is_shown_as_none_and_one_in_sight_never_so():
    """Of the second one nothing is seen at first, so a gap has nothing else to show."""
    shown = [np.array([(i // 20) % 2, i >= 50.0], float) for i in range(400)]
    poses = [seen[:, None] * np.array([[2.0 + 0.01 * i, 1.0, 0.5]] * 2) for i, seen in enumerate(shown)]
    moments = [
        EXACT | {"toddler_position": pose, "toddler_velocity": 0.1 * pose, "toddler_seen": seen}
        for pose, seen in zip(poses, shown, strict=True)
    ]
    found = sensed(moments, child={"noise": 0.01, "bias": 0.02, "dropout": 0.5})
    for number, (moment, seen) in enumerate(zip(found, shown, strict=True)):
        assert not moment["toddler_position"][seen == 0].any()
        assert not moment["toddler_velocity"][seen == 0].any()
        for x, y, _ in moment["toddler_position"][seen > 0]:
            assert 1.8 < x < 2.2 + 0.01 * number
            assert y == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize(("delay", "steps"), [(0.0, 0), (0.02, 1), (0.03, 2), (0.06, 3)])
def test_all_is_as_old_as_the_delay(delay, steps):
    moments = [{key: value + i for key, value in EXACT.items()} for i in range(8)]
    seen = sensed(moments, delay=delay)
    for key, exact in EXACT.items():
        assert [float((s[key] - exact).max()) for s in seen] == pytest.approx([max(0, i - steps) for i in range(8)])


def test_looking_twice_shows_the_same_and_shares_no_memory():
    sensor = Sensor(Sensing.of({"candle": {"noise": 0.01}, "delay": 0.02}), 0.02, TABLES, CANDLES)
    sensor.reset(0)
    one, two = sensor.sense(0, EXACT), sensor.sense(0, EXACT)
    for key in EXACT:
        assert (one[key] == two[key]).all()
        assert not np.shares_memory(one[key], two[key])


ROUGH = {
    "candle": {"noise": 0.01, "bias": 0.005, "turn_noise": 0.02, "dropout": 0.1},
    "child": {"noise": 0.02, "velocity_noise": 0.05, "turn_bias": 0.1},
    "base": {"noise": 0.005, "turn_noise": 0.01},
    "delay": 0.06,
}


def run(task, **task_kwargs):
    env = load(task, "paper", random=4, task_kwargs=task_kwargs, visuals=False)
    spec, random = env.action_spec(), np.random.default_rng(0)
    steps = [env.reset()]
    for _ in range(20):
        steps.append(env.step(random.uniform(spec.minimum, spec.maximum)))
    return env, [step.observation for step in steps]


def test_exact_sensing_is_bit_identical_to_none():
    (_, plain), (_, exact) = run("relocate_candle"), run("relocate_candle", sensing=Sensing())
    for one, two in zip(plain, exact, strict=True):
        assert list(one) == list(two)
        assert all(np.array_equal(one[key], two[key]) for key in one)


def test_rough_sensing_is_of_the_same_episode():
    task = "relocate_candle"
    (env, plain), (_, rough), (_, again) = run(task), run(task, sensing=ROUGH), run(task, sensing=ROUGH)
    for one, two in zip(rough, again, strict=True):
        assert all(np.array_equal(one[key], two[key]) for key in one)
    assert all(np.isfinite(value).all() for one in rough for value in one.values())
    assert [one["clock"] for one in plain] == [one["clock"] for one in rough]
    assert rough[20]["arm_position"] == pytest.approx(plain[17]["arm_position"], abs=0)  # three timesteps old
    for key in ("toddler_position", "candle_position", "base_position"):
        assert not np.array_equal(rough[20][key], plain[17][key])
        assert rough[20][key] == pytest.approx(plain[17][key], abs=0.5)
    for key, shape in env.observation_spec().items():
        assert rough[20][key].shape == shape.shape

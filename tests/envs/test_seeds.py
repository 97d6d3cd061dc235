"""Seeds: Python's and NumPy's integers are the same, sources of randomness are drawn from."""

import gymnasium
import numpy as np
import pytest
from small import PLAN, TARGETS

from caregiver_mj import load
from caregiver_mj.children.random_stream import RandomStream, random_state
from caregiver_mj.envs.houses_vector import GridHousesVector

MAKERS = {
    "robot": lambda: gymnasium.make("caregiver_mj/Supervise-v0", house=PLAN),
    "targets": lambda: gymnasium.make(TARGETS, house=PLAN),
    "batch": lambda: gymnasium.make_vec(TARGETS, 2, house=PLAN),
    "houses": lambda: GridHousesVector((PLAN,), 2),
}


@pytest.mark.parametrize("kind", MAKERS)
def test_of_an_environment(kind):
    env = MAKERS[kind]()
    wanted, info = env.reset(seed=7)
    for seed in (np.int64(7), np.uint32(7)):
        found, others = env.reset(seed=seed)
        assert np.array_equal(info["seed"], others["seed"])
        assert all(np.array_equal(found[key], wanted[key]) for key in wanted)
    for make in (np.random.default_rng, np.random.RandomState):
        source, again = make(5), make(5)
        first, second, repeated = (env.reset(seed=one)[1]["seed"] for one in (source, source, again))
        assert np.array_equal(first, repeated)
        assert not np.array_equal(first, second)
        env.reset(seed=first if np.ndim(first) == 0 else np.asarray(first)[0])  # it is a seed like any other


def start(random):
    return load("supervise", PLAN, random=random).reset().observation["toddler_position"]


def test_of_load():
    for same in (np.int64(3), np.uint8(3), np.random.RandomState(3)):
        np.testing.assert_array_equal(start(same), start(3))
    np.testing.assert_array_equal(start(np.random.default_rng(3)), start(np.random.default_rng(3)))
    source = np.random.default_rng(3)
    assert (start(source) != start(source)).any()  # it is drawn from


def test_a_generator_shares_its_stream():
    source, twin = np.random.default_rng(1), np.random.default_rng(1)
    assert random_state(source).random_sample() == twin.random()
    RandomStream.draw(source, 2)
    assert source.random() != twin.random()

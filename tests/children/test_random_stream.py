"""Random streams: who gets which draws, and where everybody starts."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from caregiver_mj import CaregiverError
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS, RandomStream, pick, start_cells


def random(seed):
    return np.random.RandomState(seed)


def same(one, other):
    drawn = (one.start == other.start).all() and (one.steps == other.steps).all()
    return drawn and one.caregiver_seed == other.caregiver_seed


def test_a_stream_is_determined_by_its_seed():
    one, again, other = (RandomStream.draw(random(seed)) for seed in (5, 5, 6))
    assert one.start.shape == (3,)
    assert one.steps.shape == (EPISODE_TIMESTEPS, 3) == (200, 3)
    assert same(one, again)
    assert one.caregiver_seed != other.caregiver_seed
    assert not (one.steps == other.steps).any()
    assert (RandomStream.draw(random(5), 10).steps == one.steps[:10]).all()


def test_the_first_child_has_the_stream_of_an_only_child_and_takes_as_much_of_the_chance():
    alone = random(5)
    only = RandomStream.draw(alone)
    for children in (1, 2, 4):
        streams = RandomStream.draw_group(random(5), children)
        assert len(streams) == children
        assert same(streams[0], only)
    # What comes after it from the same source does not depend on how many children there are.
    after = []
    for children in (1, 2, 4):
        source = random(5)
        RandomStream.draw_group(source, children)
        after.append(source.random_sample(5).tolist())
    assert after[0] == after[1] == after[2] == alone.random_sample(5).tolist()


def test_each_child_has_chance_of_its_own_that_does_not_depend_on_how_many_there_are():
    two, four = (RandomStream.draw_group(random(5), children) for children in (2, 4))
    assert same(two[1], four[1])
    for one, other in itertools.combinations(four, 2):
        assert not (one.steps == other.steps).any()
    assert len({stream.caregiver_seed for stream in four}) == 1  # there is one caregiver


@given(st.integers(1, 10_000))
def test_the_largest_draw_picks_the_last(count):
    assert pick(np.array([0.0, np.nextafter(1.0, 0.0)]), count).tolist() == [0, count - 1]


def starts(free, landings, *rows):
    """Start cells by draws: of every row a child, of each the draws for its own cell and for the caregiver's."""
    draws = np.array([[(*row, 0.0) for row in rows]], float)
    children, caregiver = start_cells(free, landings, draws)
    return children[0].tolist(), int(caregiver[0])


def test_start_cells_worked_by_hand():
    # Ten free cells. The child takes number 0.3 * 10 = 3; of the nine others (without 3) the caregiver the fourth: 4.
    assert starts(10, 0, (0.3, 0.35)) == ([3], 4)
    # A second child takes of the nine others number 0.4 * 9 = 3, which is 4. The caregiver's is the first one's
    # second draw: of the eight others number 0.35 * 8 = 2, which is 2.
    assert starts(10, 0, (0.3, 0.35), (0.4, 0.9)) == ([3, 4], 2)
    # With 0.5 * 8 = 4 it passes over 3 and 4, whichever child is in which.
    assert starts(10, 0, (0.3, 0.5), (0.4, 0.9)) == ([3, 4], 6)
    assert starts(10, 0, (0.4, 0.5), (0.35, 0.9)) == ([4, 3], 6)


def test_without_room_children_share_a_cell_and_the_caregiver_takes_the_last_landing():
    assert (starts(1, 2, (0.9, 0.1)), starts(1, 0, (0.9, 0.1))) == (([0], 2), ([0], 0))
    assert starts(2, 1, (0.9, 0.1), (0.1, 0.1), (0.7, 0.7)) == ([1, 0, 0], 2)


def test_a_stream_is_drawn_by_a_random_state_or_a_generator():
    one, other = (make(np.random.MT19937(3)) for make in (np.random.RandomState, np.random.Generator))
    np.testing.assert_array_equal(RandomStream.draw(one).steps, RandomStream.draw(other).steps)
    with pytest.raises(CaregiverError, match="the seed of an episode must be an integer"):
        RandomStream.draw_group("0", 1)

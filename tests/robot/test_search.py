"""Searches that are spread over control timesteps."""

import functools
import pickle

from caregiver_mj.robot.retrieval import Search


def count(limit):
    """Work of a millisecond each, which finds how often it was done."""
    done = 0
    while done < limit:
        done += 1
        yield 1.0
    return done


def test_it_goes_on_where_it_was_and_says_what_it_has_found():
    search = Search(functools.partial(count, 25))
    assert [search.go_on(10.0) for _ in range(4)] == [False, False, True, True]
    assert search.found == 25


def test_what_finds_nothing_ends():
    search = Search(functools.partial(count, 0))
    assert search.go_on()
    assert search.found == 0


def test_a_pickle_goes_on_as_far_as_it_had_got():
    search = Search(functools.partial(count, 25))
    search.go_on(10.0)
    again = pickle.loads(pickle.dumps(search))
    assert not again.go_on(14.0)
    assert again.go_on(2.0)
    assert again.found == 25

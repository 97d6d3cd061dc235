"""Ten seconds without coming nearer, and no more."""

from caregiver_mj.robot.driver import Patience
from caregiver_mj.robot.retrieval import Search


def test_it_does_not_begin_to_end_before_there_is_a_way():
    assert not Patience().is_over(1e6)


def test_it_ends_ten_seconds_after_the_last_step_nearer():
    patience = Patience()
    patience.note(8, now=0.0)
    patience.note(7, now=6.0)
    for now in (9.0, 12.0, 15.0):
        patience.note(7, now)
        patience.note(9, now)
    assert not patience.is_over(16.0)
    assert patience.is_over(16.02)


def test_who_is_there_may_stay():
    patience = Patience()
    patience.note(1, now=0.0)
    patience.note(0, now=5.0)
    assert not patience.is_over(14.0)
    patience.last_for_ever()
    patience.note(1, now=20.0)
    assert not patience.is_over(1e6)


def test_who_is_driven_off_again_and_again_does_not_stay_for_ever():
    patience = Patience()
    for now in range(0, 12, 2):
        patience.note(1, now)
        patience.note(0, now + 1.0)
    assert patience.is_over(11.02)
    assert not patience.is_over(11.02, 5.0)
    assert patience.is_over(16.02, 5.0)


def count(limit):
    """Work of a millisecond each, which finds how often it was done."""
    done = 0
    while done < limit:
        done += 1
        yield 1.0
    return done


def test_it_goes_on_where_it_was_and_says_what_it_has_found():
    search = Search(count(25))
    assert ([search.go_on(10.0) for _ in range(4)], search.found) == ([False, False, True, True], 25)

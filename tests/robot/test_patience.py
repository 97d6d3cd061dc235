"""Ten seconds without coming nearer, and no more."""

from caregiver_mj.robot.driver import Patience


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


def test_a_new_aim_begins_anew():
    patience = Patience()
    patience.note(2, now=0.0)
    patience.begin_anew()
    assert not patience.is_over(100.0)
    patience.note(9, now=100.0)
    assert not patience.is_over(110.0)
    assert patience.is_over(110.02)


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

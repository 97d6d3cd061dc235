"""What the robot could not get to is left alone for a while, and for longer after each further failure."""

from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.policy.routines import LEFT_LYING, PASSED_OVER, PassedOver


def test_each_failure_doubles_the_wait_until_something_is_done_about_that_hazard():
    passed_over, now = PassedOver(2), 0.0
    for wait in (PASSED_OVER, 2 * PASSED_OVER, 4 * PASSED_OVER, 8 * PASSED_OVER, LEFT_LYING, LEFT_LYING):
        passed_over.succeed(NOTHING)  # as when it stands at a lookout, which is about none
        passed_over.note(1, now)
        assert passed_over.now(now + wait - 0.01).tolist() == [False, True]
        now += wait
        assert passed_over.now(now).tolist() == [False, False]
    passed_over.succeed(1)
    passed_over.note(1, now)
    assert passed_over.now(now + PASSED_OVER).tolist() == [False, False]

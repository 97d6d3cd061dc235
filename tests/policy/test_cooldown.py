"""What the robot could not get to is left alone for a while, and for longer after each further failure."""

from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.policy.routines import COOLDOWN, LEFT_LYING, Cooldowns


def test_each_failure_doubles_the_wait_until_something_is_done_about_that_hazard():
    cooldowns, now = Cooldowns(2), 0.0
    for wait in (COOLDOWN, 2 * COOLDOWN, 4 * COOLDOWN, 8 * COOLDOWN, LEFT_LYING, LEFT_LYING):
        cooldowns.succeed(NOTHING)  # as when it stands at a lookout, which is about none
        cooldowns.fail(1, now)
        assert cooldowns.active(now + wait - 0.01).tolist() == [False, True]
        now += wait
        assert cooldowns.active(now).tolist() == [False, False]
    cooldowns.succeed(1)
    cooldowns.fail(1, now)
    assert cooldowns.active(now + COOLDOWN).tolist() == [False, False]

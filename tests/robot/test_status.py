"""What follows from how a skill fares."""

import copy
import pickle

import pytest

from caregiver_mj.robot.status import Status


@pytest.mark.parametrize(
    ("status", "ended", "interruptible", "failed"),
    [
        (Status.RUNNING, False, True, False),
        (Status.COMMITTED, False, False, False),
        (Status.DONE, True, True, False),
        (Status.FAILED, True, True, True),
        (Status.OUT_OF_REACH, True, True, True),
        (Status.OVERTAKEN, True, True, False),
    ],
)
def test_what_a_status_says(status, ended, interruptible, failed):
    assert (status.ended, status.interruptible, status.failed) == (ended, interruptible, failed)


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda status: pickle.loads(pickle.dumps(status))])
def test_a_copy_is_the_status_itself(again):
    assert again(Status.OVERTAKEN) is Status.OVERTAKEN

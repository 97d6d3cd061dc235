"""Worker processes that do every job, however often they are killed."""

import os
import signal

import pytest

from caregiver_mj.experiments import workers


def _square(job):
    if job == "deadly":
        os.kill(os.getpid(), signal.SIGKILL)
    if job == "wrong":
        raise ValueError("job is wrong")
    return job**2


def test_workers_do_every_job():
    assert dict(workers.run_jobs(_square, range(7), 2)) == {job: job**2 for job in range(7)}


def test_job_that_kills_its_workers_is_given_up():
    with pytest.raises(workers.WorkerError, match="deadly: its worker process died 2 times"):
        list(workers.run_jobs(_square, [1, "deadly", 2], 2, deaths=2))


def test_error_in_a_worker_is_passed_on():
    with pytest.raises(workers.WorkerError, match="ValueError: job is wrong"):
        list(workers.run_jobs(_square, [1, "wrong"], 2))

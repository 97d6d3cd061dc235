"""A Dask cluster on this machine: the same table as without one, whoever dies; and clear words where it cannot work."""

import os
import signal
from unittest import mock

import dask
import distributed
import pytest
from comparing import same, square

from caregiver_mj import FloorPlan
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.workers import DaskExecutor, WorkerError


@pytest.fixture(scope="module", autouse=True)
def environment():
    """As it was: a nanny sets variables for its worker in here, too, such as how many threads linear algebra takes."""
    with mock.patch.dict(os.environ):
        yield


@pytest.fixture(scope="module")
def cluster():
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": "127.0.0.1:0", "protocol": "tcp://"}
    # A dead worker comes back; a job that kills two of them is given up.
    with dask.config.set({"distributed.scheduler.allowed-failures": 1}):
        cluster = distributed.LocalCluster(**options, scheduler_kwargs={"host": "127.0.0.1"})
    with cluster:
        yield cluster


@pytest.mark.slow
def test_a_killed_worker_changes_nothing(cluster):
    settings = Settings(FloorPlan.load("paper"), "grid", ("none", "paper"), ("1", ".25"), 20)
    assert len(settings.blocks(10)) == 8
    killed = []

    def kill_one(episodes):
        at_work = {address for address, worker in cluster.scheduler.workers.items() if worker.processing}
        busy = [nanny for nanny in cluster.workers.values() if nanny.worker_address in at_work]
        if busy and not killed:
            killed.append(busy[0].pid)
            os.kill(busy[0].pid, signal.SIGKILL)

    with DaskExecutor(cluster.scheduler_address) as executor:
        found = evaluate(settings, executor=executor, progress=kill_one, grid_block=10)
    assert len(killed) == 1
    assert killed[0] not in [nanny.pid for nanny in cluster.workers.values()]
    same(found, evaluate(settings))


@pytest.mark.parametrize(
    ("job", "message"),
    [
        ("wrong", "(?s)wrong: Traceback.*ValueError: job is wrong"),
        ("refused", "refused: job is refused$"),
        ("deadly", "deadly: its worker process died 2 times"),
    ],
)
def test_a_job_that_fails_ends_the_run(cluster, job, message):
    with DaskExecutor(cluster.scheduler_address) as executor:
        with pytest.raises(WorkerError, match=message):
            list(executor.run(square, [job]))
        assert list(executor.run(square, [3])) == [(3, 9)]  # and no other one

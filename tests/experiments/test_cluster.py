"""A Dask cluster on this machine: the same table as without one, whoever dies; and clear words where it cannot work."""

import contextlib
import os
import signal
import subprocess
import sys
from unittest import mock

import dask
import distributed
import pytest
from comparing import same

from caregiver_mj import cli
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.cluster import DaskExecutor
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.workers import WorkerError
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.registry import modules_of_the_folder

NOWHERE = "tcp://127.0.0.1:9"  # where nothing listens


def start_cluster(workers=2, **options):
    # A dead worker comes back; a job that kills two of them is given up.
    with dask.config.set({"distributed.scheduler.allowed-failures": 1}):
        options = {"threads_per_worker": 1, "dashboard_address": "127.0.0.1:0", "protocol": "tcp://"} | options
        options["scheduler_kwargs"] = {"host": "127.0.0.1"}
        return distributed.LocalCluster(n_workers=workers, **options)


@pytest.fixture(scope="module", autouse=True)
def environment():
    """As it was: a nanny sets variables for its worker in here, too, such as how many threads linear algebra takes."""
    with mock.patch.dict(os.environ):
        yield


@pytest.fixture(scope="module")
def cluster():
    with start_cluster() as cluster:
        yield cluster


def has_jobs(cluster, nanny):
    worker = cluster.scheduler.workers.get(nanny.worker_address)
    return worker is not None and len(worker.processing) > 0


def _square(job):
    if job == "deadly":
        os.kill(os.getpid(), signal.SIGKILL)
    if job == "wrong":
        raise ValueError("job is wrong")
    if job == "refused":
        raise CaregiverError("job is refused")
    return job**2


def test_a_killed_worker_changes_nothing(cluster):
    settings = Settings(FloorPlan.load("paper"), "grid", ("none", "paper"), ("1", ".25"), 20)
    assert len(settings.blocks(10)) == 8
    killed = []

    def kill_one(episodes):
        busy = [nanny for nanny in cluster.workers.values() if has_jobs(cluster, nanny)]
        if busy and not killed:
            killed.append(busy[0].pid)
            os.kill(busy[0].pid, signal.SIGKILL)

    with DaskExecutor(cluster.scheduler_address) as executor:
        found = evaluate(settings, executor=executor, progress=kill_one, grid_block=10)
    assert len(killed) == 1
    assert killed[0] not in [nanny.pid for nanny in cluster.workers.values()]
    same(found, evaluate(settings))


def test_every_job_is_done_however_many_there_are(cluster):
    with DaskExecutor(cluster.scheduler_address, ahead=3) as executor:
        assert dict(executor.run(_square, range(10))) == {job: job**2 for job in range(10)}


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
            list(executor.run(_square, [job]))
        assert list(executor.run(_square, [3])) == [(3, 9)]  # and no other one


def test_a_scheduler_that_goes_away_ends_the_run():
    with start_cluster(1, processes=False) as cluster, DaskExecutor(cluster.scheduler_address, timeout=1.0) as executor:
        running = executor.run(_square, range(2000))
        next(running)
        cluster.close()
        with pytest.raises(WorkerError, match=f"the scheduler at '{cluster.scheduler_address}' has stopped"):
            list(running)


# -- The command -------------------------------------------------------------------------------------

EVALUATE = ["evaluate", "--world", "grid", "--caregiver", "none", "--epsilon", "1", "--episodes", "3"]


def test_command(cluster, capsys):
    assert cli.main(EVALUATE) == 0
    wanted = capsys.readouterr().out
    assert cli.main([*EVALUATE, "--executor", "dask", "--scheduler", cluster.scheduler_address]) == 0
    assert capsys.readouterr().out == wanted


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--scheduler", NOWHERE], "--scheduler must be with --executor dask"),
        (["--executor", "dask"], "--executor dask must be with --scheduler ADDRESS"),
        (["--executor", "dask", "--scheduler", NOWHERE, "--jobs", "2"], "--jobs must be left out with --executor dask"),
        (["--executor", "dask", "--scheduler", "no-scheme://x:1"], "no scheduler at 'no-scheme://x:1': "),
        (["--executor", "dask", "--scheduler", "nonsense"], "no scheduler at 'nonsense': missing port number"),
        (["--executor", "dask", "--scheduler", ""], "no scheduler at '': an address must be such as tcp://"),
        (["--executor", "dask", "--scheduler", "http://x:1"], "no scheduler at 'http://x:1': unknown address scheme"),
        (["--executor", "cloud"], "invalid choice: 'cloud'"),
    ],
)
def test_options_that_do_not_fit_together(options, message, capsys, tmp_path):
    assert cli.main([*EVALUATE, *options, "--out", str(tmp_path / "run")]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "run").exists()


def test_without_dask_the_command_says_what_brings_it(tmp_path):
    code = "import sys; sys.modules['distributed'] = None; from caregiver_mj.cli import main; sys.exit(main())"
    command = [sys.executable, "-c", code, *EVALUATE, "--executor", "dask", "--scheduler", NOWHERE]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("caregiver-mj: a cluster needs Dask distributed")
    assert done.stderr.endswith("pip install 'caregiver_mj[dask]'\n")


# -- Clusters that will not do -----------------------------------------------------------------------


def test_no_scheduler():
    with pytest.raises(CaregiverError, match=f"no scheduler at '{NOWHERE}': .*"):
        DaskExecutor(NOWHERE, timeout=0.5)


def test_no_worker():
    with start_cluster(0, processes=False) as cluster, pytest.raises(CaregiverError, match="has no worker: start") as e:
        DaskExecutor(cluster.scheduler_address, timeout=0.5)
    assert f"dask worker {cluster.scheduler_address} --nthreads 1" in str(e.value)


def test_worker_of_several_threads():
    with (
        start_cluster(1, processes=False, threads_per_worker=2) as cluster,
        pytest.raises(CaregiverError, match=r"must have 1 thread, got 2: start .*--nthreads 1"),
    ):
        DaskExecutor(cluster.scheduler_address)


@contextlib.contextmanager
def worker_in(folder, address, **variables):
    """A worker that was started in a folder."""
    command = [sys.executable, "-m", "distributed.cli.dask_worker", address]
    command += ["--no-nanny", "--nthreads", "1", "--no-dashboard"]
    options = {"env": os.environ | variables, "cwd": folder, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(command, **options) as worker:
        try:
            yield
        finally:
            worker.terminate()


def test_worker_of_another_version(tmp_path):
    record = tmp_path / "caregiver_mj-0.0.9.dist-info" / "METADATA"
    record.parent.mkdir()
    record.write_text("Metadata-Version: 2.1\nName: caregiver_mj\nVersion: 0.0.9\n")
    with (
        start_cluster(0, processes=False) as cluster,
        worker_in(tmp_path, cluster.scheduler_address, PYTHONPATH=str(tmp_path)),
        pytest.raises(CaregiverError, match=r"worker .* has caregiver_mj 0\.0\.9: install 0\.1\.0 there"),
    ):
        DaskExecutor(cluster.scheduler_address, timeout=60.0)


def test_policies_of_ones_own_are_the_same_on_every_worker_or_refused(tmp_path, monkeypatch, capsys):
    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir()
    there.mkdir()
    monkeypatch.chdir(here)
    text = (
        "import numpy as np\n"
        "from caregiver_mj.caregivers import Caregiver\n"
        "class Mine(Caregiver):\n"
        "    def choose(self, percept):\n"
        "        return np.zeros(len(percept.child_cell), int)\n"
    )
    (here / "clustered.py").write_text(text)
    argv = [word if word != "none" else "clustered:Mine" for word in EVALUATE]
    assert cli.main(argv) == 0
    wanted = capsys.readouterr().out
    with start_cluster(0, processes=False) as cluster, worker_in(there, cluster.scheduler_address):
        with DaskExecutor(cluster.scheduler_address, timeout=60.0):
            argv += ["--executor", "dask", "--scheduler", cluster.scheduler_address]
        assert cli.main([*argv, "--out", "run"]) == 2
        err = capsys.readouterr().err
        assert "No module named 'clustered'; code of your own must be installed there, or lie in the folder" in err
        assert err.count("\n") == 1
        assert not (here / "run").exists()

        (there / "clustered.py").write_text(text)
        assert cli.main(argv) == 0
        assert capsys.readouterr().out == wanted

        for folder in (here, there):  # the worker has the old one in memory
            (folder / "clustered.py").write_text(text.replace("zeros", "ones"))
        assert cli.main(argv) == 2
        err = capsys.readouterr().err
        assert "it has caregiver clustered:Mine clustered.py, sha256 " in err
        assert "start it anew after an edit" in err

        # one that comes while a run goes on is looked at before its first job
        settings = Settings((FloorPlan.load("paper"),), "grid", ("clustered:Mine",), ("1",), 3)
        with (
            DaskExecutor(cluster.scheduler_address) as executor,
            modules_of_the_folder(),
            pytest.raises(
                WorkerError, match=r"not as it is where the run was started: it has caregiver clustered:Mine"
            ),
        ):
            evaluate(settings, executor=executor)
    sys.modules.pop("clustered")

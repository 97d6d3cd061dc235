"""A cluster of several machines, by Dask (extra `dask`): its scheduler gives the jobs to whatever workers there are.

Workers may die and new ones may come while a run goes on: what a dead one had is done again by another.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import operator
import threading
import traceback
import uuid
import warnings
from collections.abc import Callable, Generator, Sequence
from typing import Any, TypeVar

from caregiver_mj.errors import CaregiverError, MissingExtraError
from caregiver_mj.experiments.provenance import difference, fingerprint
from caregiver_mj.experiments.workers import Code, Executor, WorkerError, attempt
from caregiver_mj.registry import modules_of_the_folder

Job = TypeVar("Job")
Result = TypeVar("Result")

TIMEOUT = 10.0  # seconds to find a scheduler, and workers at it
AHEAD = 1000  # jobs that the scheduler has at a time: more than workers, and few enough to give up at once
_WORKERS = "dask worker {} --nthreads 1 --nworkers auto"
_ABSENT = "code of your own must be installed there, or lie in the folder that the worker was started in"
_ANEW = "a worker goes on with what it has loaded, so start it anew after an edit"

_one_at_a_time = threading.Lock()  # jobs share what they have built in a process


class DaskExecutor(Executor):
    """The workers of a Dask cluster, each of them with one thread and the same version of this package.

    It connects at once, so that what is wrong is told before anything is written. Use it in a `with` block.
    """

    def __init__(self, address: str, timeout: float = TIMEOUT, ahead: int = AHEAD):
        """Connect to a scheduler's address, as `dask scheduler` prints it, such as `tcp://10.0.0.1:8786`.

        It waits for it, and for the first worker, for `timeout` seconds. The cluster has `ahead` jobs at a time.

        Raises:
            MissingExtraError: Dask is not installed.
            CaregiverError: There is no scheduler, it has no worker, or a worker is not fit.
        """
        try:
            import distributed
        except ImportError as error:
            raise MissingExtraError(
                f"a cluster needs Dask distributed ({error}): pip install 'caregiver_mj[dask]'"
            ) from None
        self.address, self._ahead = address, ahead
        self._distributed: Any = distributed
        try:
            _check_address(distributed, address)
            with warnings.catch_warnings():  # about versions, of which it is for us to judge
                warnings.simplefilter("ignore", distributed.versions.VersionMismatchWarning)
                self._client: Any = distributed.Client(address, timeout=timeout, set_as_default=False)
        except (OSError, ValueError, ImportError, AssertionError) as error:
            raise CaregiverError(f"no scheduler at '{address}': {' '.join(str(error).split())}") from None
        try:
            self._check_workers(timeout)
        except BaseException:
            self._client.close()
            raise

    def _check_workers(self, timeout: float) -> None:
        """Raise CaregiverError unless there are workers, and all of them fit."""
        start = f"start workers with `{_WORKERS.format(self.address)}`"
        with contextlib.suppress(TimeoutError):
            self._client.wait_for_workers(1, timeout)
        threads = self._client.nthreads()
        if not threads:
            raise CaregiverError(f"the scheduler at '{self.address}' has no worker: {start}")
        for worker, count in threads.items():
            if count != 1:
                raise CaregiverError(f"worker {worker} must have 1 thread, got {count}: {start}")
        wanted = fingerprint()
        installed = self._client.get_versions(packages=list(wanted))["workers"]
        for worker, found in installed.items():
            if found["packages"]["caregiver_mj"] != wanted["caregiver_mj"]:
                version = found["packages"]["caregiver_mj"]
                has = f"has caregiver_mj {version}" if version else "does not have caregiver_mj"
                raise CaregiverError(f"worker {worker} {has}: install {wanted['caregiver_mj']} there, as here")
        for worker, found in self._client.run(fingerprint).items():
            if other := difference(found, wanted):
                raise CaregiverError(f"worker {worker} differs from this machine: it has {other}")

    def check(self, code: Code) -> None:
        """See `Executor`."""
        wanted = dict(code())
        for worker, (failure, found) in self._client.run(_tell, code).items() if wanted else ():
            if failure:
                raise CaregiverError(f"worker {worker}: {failure}; {_ABSENT}")
            if other := difference(found, wanted):
                raise CaregiverError(f"worker {worker} differs from this machine: it has {other}; {_ANEW}")

    def run(
        self, function: Callable[[Job], Result], jobs: Sequence[Job], code: Code = dict
    ) -> Generator[tuple[Job, Result]]:
        """See `Executor`."""
        client, name = self._client, f"caregiver_mj-{uuid.uuid4().hex}"
        # A result of a job of its own, which workers hand on to each other, and which is made again should they die.
        do = functools.partial(_do, function, {**fingerprint(), **code()}, code)
        work = client.submit(_hand_over, do, key=f"{name}-work")
        asked: dict[Any, Job] = {}
        waiting = enumerate(jobs)

        def submit(count: int) -> list[Any]:
            futures = []
            for i, job in itertools.islice(waiting, count):
                futures.append(client.submit(operator.call, work, job, key=(name, i), pure=False))
                asked[futures[-1]] = job
            return futures

        try:
            running = self._distributed.as_completed(
                submit(self._ahead), loop=client.loop, with_results=True, raise_errors=False
            )
            for future, answer in running:
                job = asked.pop(future)
                result = self._read(job, future, answer)
                future.release()
                running.update(submit(1))
                yield job, result
        finally:
            client.cancel([*asked, work])

    def _read(self, job: Any, future: Any, answer: Any) -> Any:
        """The result of a job; a WorkerError if there is none."""
        if future.status == "finished":
            failure, result = answer
            if failure:
                raise WorkerError(f"{job}: {failure}")
            return result
        if future.status != "error":
            raise WorkerError(f"the scheduler at '{self.address}' has stopped or cancelled the jobs")
        _, error, _ = answer
        if isinstance(error, self._distributed.KilledWorker):
            raise WorkerError(f"{job}: its worker process died {error.allowed_failures + 1} times")
        raise WorkerError(f"{job}: {''.join(traceback.format_exception(error))}")

    def close(self) -> None:
        """See `Executor`."""
        self._client.close()


def _check_address(distributed: Any, address: str) -> None:
    """Raise ValueError unless it can be the address of a scheduler: Dask would make a cluster of its own, or wait."""
    if not address.strip():
        raise ValueError("an address must be such as tcp://10.0.0.1:8786")
    scheme, where = distributed.comm.parse_address(address)
    distributed.comm.registry.get_backend(scheme)
    if scheme in ("tcp", "tls"):  # else a client would find out too late to be cleared away
        distributed.comm.addressing.parse_host_port(where)


def _hand_over(work: Callable[[Job], Result]) -> Callable[[Job], Result]:
    return work


def _tell(code: Code) -> tuple[str | None, dict[str, str] | None]:
    """Of what code of others a worker has: what is wrong with it, or what it is."""
    with _one_at_a_time, modules_of_the_folder():
        return attempt(_loaded, code)


def _do(
    function: Callable[[Job], Result], wanted: dict[str, str], code: Code, job: Job
) -> tuple[str | None, Result | None]:
    """Do a job in a worker, which may have come since the run began."""
    with _one_at_a_time, modules_of_the_folder():
        failure, found = attempt(_loaded, code)
        if found is None:
            return f"{failure}; {_ABSENT}", None
        if other := difference({**fingerprint(), **found}, wanted):
            return f"a worker is not as it is where the run was started: it has {other}; {_ANEW}", None
        return attempt(function, job)


_first_told: dict[str, str] = {}


@functools.lru_cache(maxsize=8)  # asked before every job
def _loaded(code: Code) -> dict[str, str]:
    """What code of others this process has: as it was when it was loaded, whatever has become of the files since."""
    return {what: _first_told.setdefault(what, text) for what, text in code().items()}

"""An executor on a Dask cluster (extra `dask`).

Workers may die and join during a run; another worker repeats the job of a dead one.
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

TIMEOUT = 10.0  # s; for a scheduler, and then its first worker, to answer
AHEAD = 1000  # jobs submitted at a time: more than there are workers, and few enough to cancel quickly
_WORKERS = "dask worker {} --nthreads 1 --nworkers auto"
_ABSENT = "install your own code there, or start the worker in its folder"
_ANEW = "a worker keeps the code that it has loaded: restart it after an edit"

_one_at_a_time = threading.Lock()  # jobs of a process share its caches


class DaskExecutor(Executor):
    """The workers of a Dask cluster, each with one thread and the same version of this package.

    It connects at once, so that an error precedes any output. Use it in a `with` block.
    """

    def __init__(self, address: str, timeout: float = TIMEOUT):
        """Connect to a scheduler at an address such as `tcp://10.0.0.1:8786`, waiting `timeout` s for it and a worker.

        Raises:
            MissingExtraError: Dask is not installed.
            CaregiverError: There is no scheduler, it has no worker, or a worker has other versions or threads.
        """
        try:
            import distributed
        except ImportError as error:
            raise MissingExtraError(
                f"a cluster needs Dask distributed ({error}): pip install 'caregiver_mj[dask]'"
            ) from None
        self.address = address
        self._distributed: Any = distributed
        try:
            _check_address(distributed, address)
            with warnings.catch_warnings():  # `_check_workers` judges versions
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
        """Raise CaregiverError unless there are workers, each with one thread and the same versions."""
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
        wanted = dict(code())
        for worker, (failure, found) in self._client.run(_tell, code).items() if wanted else ():
            if failure:
                raise CaregiverError(f"worker {worker}: {failure}; {_ABSENT}")
            if other := difference(found, wanted):
                raise CaregiverError(f"worker {worker} differs from this machine: it has {other}; {_ANEW}")

    def run(
        self, function: Callable[[Job], Result], jobs: Sequence[Job], code: Code = dict
    ) -> Generator[tuple[Job, Result]]:
        client, name = self._client, f"caregiver_mj-{uuid.uuid4().hex}"
        # The function is the result of a job, so workers pass it on to each other and remake it if they die.
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
                submit(AHEAD), loop=client.loop, with_results=True, raise_errors=False
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
        """Return the result of a job, or raise WorkerError."""
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
        self._client.close()


def _check_address(distributed: Any, address: str) -> None:
    """Raise ValueError for an address on which Dask would start its own cluster, or wait for ever."""
    if not address.strip():
        raise ValueError("an address must be such as tcp://10.0.0.1:8786")
    scheme, where = distributed.comm.parse_address(address)
    distributed.comm.registry.get_backend(scheme)
    if scheme in ("tcp", "tls"):  # the client checks this too late to be closed again
        distributed.comm.addressing.parse_host_port(where)


def _hand_over(work: Callable[[Job], Result]) -> Callable[[Job], Result]:
    return work


def _tell(code: Code) -> tuple[str | None, dict[str, str] | None]:
    """Return a worker's error on loading foreign code, or the origins of that code."""
    with _one_at_a_time, modules_of_the_folder():
        return attempt(_loaded, code)


def _do(
    function: Callable[[Job], Result], wanted: dict[str, str], code: Code, job: Job
) -> tuple[str | None, Result | None]:
    """Do a job in a worker, after checking its code: it may have joined since the run began."""
    with _one_at_a_time, modules_of_the_folder():
        failure, found = attempt(_loaded, code)
        if found is None:
            return f"{failure}; {_ABSENT}", None
        if other := difference({**fingerprint(), **found}, wanted):
            return f"a worker differs from the machine that started the run: it has {other}; {_ANEW}", None
        return attempt(function, job)


_first_seen: dict[str, str] = {}


@functools.lru_cache(maxsize=8)  # called before every job
def _loaded(code: Code) -> dict[str, str]:
    """Return the origins of the foreign code as this process loaded it, even if its files have changed since."""
    return {what: _first_seen.setdefault(what, text) for what, text in code().items()}

"""Workers that may die, of this machine or of a Dask cluster (extra `dask`): another one repeats the job of a dead one.

On this machine each has its own pipe and shares no lock, so that killing it affects only its own job. It ends when its
parent closes the pipe.
"""

from __future__ import annotations

import abc
import collections
import contextlib
import functools
import itertools
import multiprocessing
import multiprocessing.connection
import operator
import signal
import threading
import traceback
import uuid
import warnings
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from typing import Any, Self, TypeVar, cast

from caregiver_mj.errors import CaregiverError, MissingExtraError, check_integer
from caregiver_mj.experiments.provenance import difference, fingerprint
from caregiver_mj.registry import environment, modules_of_the_folder

Job = TypeVar("Job")
Result = TypeVar("Result")
DEATHS = 3  # workers that a job may kill before it is given up
Code = Callable[[], Mapping[str, str]]  # returns the origins of foreign code in the calling process: `Settings.code`


class WorkerError(CaregiverError):
    """A job failed in its worker, or killed it repeatedly."""


def run_jobs(
    function: Callable[[Job], Result], jobs: Sequence[Job], processes: int, deaths: int = DEATHS
) -> Generator[tuple[Job, Result]]:
    """Run a function over jobs in worker processes, or with one process in this one; see `Executor.run`.

    Raises:
        WorkerError: The function raised an exception in a worker, or a job killed `deaths` workers.
    """
    if processes == 1:
        yield from ((job, function(job)) for job in jobs)
        return
    waiting = collections.deque(jobs)
    killed: collections.Counter[Job] = collections.Counter()
    busy: dict[multiprocessing.connection.Connection, _Worker] = {}
    try:
        while waiting or busy:
            while waiting and len(busy) < processes:
                worker = _Worker(function)
                worker.give(_take(waiting, busy.values()))
                busy[worker.connection] = worker
            for ready in multiprocessing.connection.wait(list(busy)):
                connection = cast("multiprocessing.connection.Connection", ready)
                worker = busy[connection]
                job = worker.job
                try:
                    failure, result = connection.recv()
                except (EOFError, OSError):  # the worker died
                    del busy[connection]
                    worker.stop()
                    killed[job] += 1
                    if killed[job] == deaths:
                        raise WorkerError(f"{job}: its worker process died {deaths} times") from None
                    waiting.appendleft(job)
                    continue
                if failure:
                    raise WorkerError(f"{job}: {failure}")
                if waiting:
                    worker.give(_take(waiting, busy.values(), job))
                else:
                    del busy[connection]
                    worker.stop()
                yield job, result
    finally:
        for worker in busy.values():
            worker.stop()


def _take(waiting: collections.deque[Job], busy: Iterable[_Worker], last: Job | None = None) -> Job:
    """Take the next job in the house of a worker's last job, whose tables it has; else in a house without workers."""
    mine, *others = (getattr(job, "house", None) for job in (last, *(worker.job for worker in busy)))
    same = (job for job in waiting if getattr(job, "house", None) == mine)
    new = (job for job in waiting if getattr(job, "house", None) not in others)
    job = next(itertools.chain(same, new, waiting))
    waiting.remove(job)
    return job


def attempt(function: Callable[[Job], Result], job: Job) -> tuple[str | None, Result | None]:
    """Run a job in a worker; return its result, or its error as text, which unpickles without the error's class."""
    try:
        return None, function(job)
    except CaregiverError as error:
        return str(error), None
    except Exception:
        return traceback.format_exc(), None


class _Worker:
    """A worker process and the job it has."""

    def __init__(self, function: Callable[[Any], Any]):
        # "spawn": a forked copy of a process that holds threads or a GL context may lock up.
        context = multiprocessing.get_context("spawn")
        try:
            self.connection, theirs = context.Pipe()
            self.process = context.Process(target=_serve, args=(function, theirs), daemon=True)
            with environment("PYTHONSAFEPATH", "1"):  # else it imports from the working folder before it has our path
                self.process.start()
        except OSError as error:  # too many processes or open files
            raise WorkerError(f"no worker process can be started: {error.strerror}; use --jobs 1") from None
        theirs.close()  # so that the worker's death closes the pipe
        self.job: Any = None

    def give(self, job: Any) -> None:
        self.job = job
        with contextlib.suppress(OSError):  # it died: `recv` will raise
            self.connection.send(job)

    def stop(self) -> None:
        self.connection.close()
        self.process.kill()  # it has nothing to clean up
        self.process.join()


def _serve(function: Callable[[Any], Any], connection: multiprocessing.connection.Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole process group; the parent handles it
    with contextlib.suppress(EOFError, OSError):
        while True:
            connection.send(attempt(function, connection.recv()))


class Executor(abc.ABC):
    """Runs jobs in any order. A job whose worker dies is repeated, so the results depend on no worker."""

    def check(self, code: Code) -> None:  # noqa: B027 (processes of one machine read the same files)
        """Raise CaregiverError unless foreign code is the same in all workers."""

    @abc.abstractmethod
    def run(
        self, function: Callable[[Job], Result], jobs: Sequence[Job], code: Code = dict
    ) -> Generator[tuple[Job, Result]]:
        """Run a function over jobs, and yield each finished one with its result; closing the iterator cancels others.

        The function must be importable, and its result depend on the job alone. Jobs are hashable, and handed out in
        this order, house by house. `code` returns the origins of foreign code, which must be equal in all workers.

        Raises:
            WorkerError: The function raised an exception, a job killed too many workers, or a worker has other code.
        """

    def close(self) -> None:  # noqa: B027 (workers of this machine end with the iterator)
        """Disconnect from the workers."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: Any) -> None:
        self.close()


class LocalExecutor(Executor):
    """Worker processes of this machine; with one, the jobs run in this process."""

    def __init__(self, processes: int = 1):
        check_integer("jobs", processes, 1)
        self._processes: int = int(processes)

    def run(
        self, function: Callable[[Job], Result], jobs: Sequence[Job], code: Code = dict
    ) -> Generator[tuple[Job, Result]]:
        return run_jobs(function, jobs, max(1, min(self._processes, len(jobs))))


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

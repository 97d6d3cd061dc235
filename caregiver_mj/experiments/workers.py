"""Worker processes that may die: the job of a killed worker goes to a new one.

Each worker has its own pipe and shares no lock, so that killing it affects only its own job. A worker ends when its
parent closes the pipe.
"""

from __future__ import annotations

import abc
import collections
import contextlib
import itertools
import multiprocessing
import multiprocessing.connection
import signal
import traceback
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from typing import Any, Self, TypeVar, cast

from caregiver_mj.errors import CaregiverError, check_integer
from caregiver_mj.registry import environment

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

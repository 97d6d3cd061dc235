"""Worker processes that may die: the job of a worker that is killed goes to a new one.

Every worker has a pipe of its own and shares no lock with the others, so one that is killed at the worst of moments
harms only its own job. A worker whose parent is gone notices at its pipe and ends.
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

Job = TypeVar("Job")
Result = TypeVar("Result")
DEATHS = 3  # workers that a job may kill before it is given up
Code = Callable[[], Mapping[str, str]]  # tells of code of others where it is called, as `Settings.code` does


class WorkerError(CaregiverError):
    """A job failed in its worker, or killed it again and again."""


def run_jobs(
    function: Callable[[Job], Result], jobs: Sequence[Job], processes: int, deaths: int = DEATHS
) -> Generator[tuple[Job, Result]]:
    """Run a function over jobs in so many worker processes, with 1 in this process; see `Executor.run`.

    Raises:
        WorkerError: The function raised an exception in a worker, or a job has killed as many as `deaths`.
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
                connection = cast("multiprocessing.connection.Connection", ready)  # as all are that it waits for
                worker = busy[connection]
                job = worker.job
                try:
                    failure, result = connection.recv()
                except (EOFError, OSError):  # it died, perhaps in the middle of a message
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
    """Take the next job of the house of a worker's last one, whose tables it has; else of one that no other is in."""
    mine, *others = (getattr(job, "house", None) for job in (last, *(worker.job for worker in busy)))
    same = (job for job in waiting if getattr(job, "house", None) == mine)
    new = (job for job in waiting if getattr(job, "house", None) not in others)
    job = next(itertools.chain(same, new, waiting))
    waiting.remove(job)
    return job


def attempt(function: Callable[[Job], Result], job: Job) -> tuple[str | None, Result | None]:
    """Run a job in a worker: what has gone wrong, in words that need no class to be understood, or the result."""
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
            self.process.start()
        except OSError as error:  # no more processes, or open files, are allowed
            raise WorkerError(f"no worker process can be started: {error.strerror}; use --jobs 1") from None
        theirs.close()  # so that the worker's death closes the pipe
        self.job: Any = None

    def give(self, job: Any) -> None:
        self.job = job
        with contextlib.suppress(OSError):  # it died; reading from it will tell
            self.connection.send(job)

    def stop(self) -> None:
        self.connection.close()
        self.process.kill()  # it holds nothing that needs an orderly end
        self.process.join()


def _serve(function: Callable[[Any], Any], connection: multiprocessing.connection.Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent deals with it
    with contextlib.suppress(EOFError, OSError):
        while True:
            connection.send(attempt(function, connection.recv()))


class Executor(abc.ABC):
    """Does jobs, in whatever order. A job whose worker dies is done again, so what comes out depends on no worker."""

    def check(self, code: Code) -> None:  # noqa: B027 (nothing is wrong where all read the same files)
        """Raise CaregiverError unless the code of others is the same wherever jobs are done."""

    @abc.abstractmethod
    def run(
        self, function: Callable[[Job], Result], jobs: Sequence[Job], code: Code = dict
    ) -> Generator[tuple[Job, Result]]:
        """Run a function over jobs.

        Args:
            function: What to run, as importable elsewhere. Its result must depend on the job alone.
            jobs: Hashable jobs, given out in this order, house by house.
            code: Tells which code of others the function depends on, and so what no worker may have another of.

        Yields:
            Each job with its result, as they finish. Closing the iterator gives the others up.

        Raises:
            WorkerError: The function raised an exception, a job has killed too many workers, or one has other code.
        """

    def close(self) -> None:  # noqa: B027 (workers of this machine end with the iterator that they work for)
        """Take leave of the workers."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: Any) -> None:
        self.close()


class LocalExecutor(Executor):
    """Worker processes of this machine; with one, the jobs are done in this process."""

    def __init__(self, processes: int = 1):
        check_integer("jobs", processes, 1)
        self._processes: int = int(processes)

    def run(
        self, function: Callable[[Job], Result], jobs: Sequence[Job], code: Code = dict
    ) -> Generator[tuple[Job, Result]]:
        """See `Executor`."""
        return run_jobs(function, jobs, max(1, min(self._processes, len(jobs))))

"""Where the jobs of a run are done: in worker processes of this machine, or by a cluster (`cluster`)."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import Any, Protocol, TypeVar

from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.workers import run_jobs

Job = TypeVar("Job")
Result = TypeVar("Result")


class Executor(Protocol):
    """Does jobs, in whatever order. A job whose worker dies is done again, so what comes out depends on no worker."""

    def run(self, function: Callable[[Job], Result], jobs: Sequence[Job]) -> Generator[tuple[Job, Result]]:
        """Runs a function over jobs.

        Args:
            function: What to run, as importable elsewhere. Its result must depend on the job alone.
            jobs: Hashable jobs, given out in this order.

        Yields:
            Each job with its result, as they finish. Closing the iterator gives the others up.

        Raises:
            WorkerError: The function raised an exception, or a job has killed too many workers.
        """
        ...

    def __enter__(self) -> Executor: ...

    def __exit__(self, *error: Any) -> None: ...


class LocalExecutor:
    """Worker processes of this machine; with one, the jobs are done in this process."""

    def __init__(self, processes: int = 1):
        if processes < 1:
            raise CaregiverError(f"jobs must be at least 1, not {processes}")
        self._processes = processes

    def run(self, function: Callable[[Job], Result], jobs: Sequence[Job]) -> Generator[tuple[Job, Result]]:
        """See `Executor`."""
        return run_jobs(function, jobs, max(1, min(self._processes, len(jobs))))

    def __enter__(self) -> LocalExecutor:
        return self

    def __exit__(self, *error: Any) -> None:
        """Workers end with the iterator that they work for."""

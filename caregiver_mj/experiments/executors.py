"""Where the jobs of a run are done: in worker processes of this machine, or by a cluster (`cluster`)."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from typing import Any, Protocol, TypeVar

from caregiver_mj.errors import check_integer
from caregiver_mj.experiments.workers import run_jobs

Job = TypeVar("Job")
Result = TypeVar("Result")

Code = Callable[[], Mapping[str, str]]  # tells of code of others where it is called, as `Settings.code` does


class Executor(Protocol):
    """Does jobs, in whatever order. A job whose worker dies is done again, so what comes out depends on no worker."""

    def check(self, code: Code) -> None:
        """Raises CaregiverError unless the code of others is the same wherever jobs are done."""

    def run(
        self, function: Callable[[Job], Result], jobs: Sequence[Job], code: Code = dict
    ) -> Generator[tuple[Job, Result]]:
        """Runs a function over jobs.

        Args:
            function: What to run, as importable elsewhere. Its result must depend on the job alone.
            jobs: Hashable jobs, given out in this order.
            code: Tells which code of others the function depends on, and so what no worker may have another of.

        Yields:
            Each job with its result, as they finish. Closing the iterator gives the others up.

        Raises:
            WorkerError: The function raised an exception, a job has killed too many workers, or one has other code.
        """
        ...

    def __enter__(self) -> Executor: ...

    def __exit__(self, *error: Any) -> None: ...


class LocalExecutor:
    """Worker processes of this machine; with one, the jobs are done in this process."""

    def __init__(self, processes: int = 1):
        check_integer("jobs", processes, 1)
        self._processes: int = int(processes)

    def check(self, code: Code) -> None:
        """Nothing: they all read the same files."""

    def run(
        self, function: Callable[[Job], Result], jobs: Sequence[Job], code: Code = dict
    ) -> Generator[tuple[Job, Result]]:
        """See `Executor`."""
        return run_jobs(function, jobs, max(1, min(self._processes, len(jobs))))

    def __enter__(self) -> LocalExecutor:
        return self

    def __exit__(self, *error: Any) -> None:
        """Workers end with the iterator that they work for."""

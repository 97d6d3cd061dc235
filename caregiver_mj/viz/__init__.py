"""Pictures, films, figures, live viewers and the report."""

import os
from typing import Any

import rich.console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

OVERLAYS = ("danger",)  # of films
AUTO = "auto"  # name of the automatic camera
CAMERAS = ("overview", "follow", "wrist", "eye")  # of a house with a robot


class _Lines(Progress):
    """A progress bar for a notebook, which cannot overwrite lines: a line for each tenth done."""

    _tenths = 0

    def advance(self, task_id: TaskID, advance: float = 1) -> None:
        super().advance(task_id, advance)
        task = self.tasks[task_id]
        if not self.disable and (tenths := int(task.percentage // 10)) > self._tenths and not task.finished:
            self._tenths = tenths  # the last tenth is the bar itself
            self.console.print(f"{task.description} {task.completed:g}/{task.total:g}")


def progress_bar(quiet: bool = False) -> Progress:
    """Return a progress bar on standard error, or none."""
    said, bar, count = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()
    times = TimeElapsedColumn(), TimeRemainingColumn()
    kind, options = Progress, dict[str, Any]()
    # In a kernel's process, or in a command of a cell ("!caregiver-mj ...").
    if rich.console.Console().is_jupyter or "JPY_PARENT_PID" in os.environ:
        kind, options = _Lines, {"force_jupyter": False, "force_terminal": False}
    console = rich.console.Console(stderr=True, markup=False, highlight=False, **options)
    return kind(said, bar, count, *times, console=console, disable=quiet)

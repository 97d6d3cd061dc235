"""What people look at: pictures, films, figures, the report."""

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

OVERLAYS = ("danger",)  # that films have
AUTO = "auto"  # the camera that a film chooses
CAMERAS = ("overview", "follow", "wrist", "eye")  # of a house with a robot


class _Lines(Progress):
    """A progress bar for a notebook, where lines cannot be written over: a line for each tenth that is done."""

    _tenths = 0

    def advance(self, task_id: TaskID, advance: float = 1) -> None:
        super().advance(task_id, advance)
        task = self.tasks[task_id]
        if not self.disable and (tenths := int(task.percentage // 10)) > self._tenths and not task.finished:
            self._tenths = tenths  # the last one is the bar itself
            self.console.print(f"{task.description} {task.completed:g}/{task.total:g}")


def progress_bar(quiet: bool = False) -> Progress:
    """Return a progress bar on standard error, or none."""
    said, bar, count = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()
    times = TimeElapsedColumn(), TimeRemainingColumn()
    kind, options = Progress, dict[str, Any]()
    # A kernel's own process, or a command in a cell ("!caregiver-mj ...").
    if rich.console.Console().is_jupyter or "JPY_PARENT_PID" in os.environ:
        kind, options = _Lines, {"force_jupyter": False, "force_terminal": False}
    console = rich.console.Console(stderr=True, markup=False, highlight=False, **options)
    return kind(said, bar, count, *times, console=console, disable=quiet)

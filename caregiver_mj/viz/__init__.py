"""What people look at: pictures, films, figures, the report."""

import rich.console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

OVERLAYS = ("danger",)  # that films have
CAMERAS = ("overview", "follow", "wrist", "eye")  # of a house with a robot


def progress_bar(quiet: bool = False) -> Progress:
    """Return a progress bar on standard error, or none."""
    said, bar, count = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()
    times = TimeElapsedColumn(), TimeRemainingColumn()
    return Progress(said, bar, count, *times, console=rich.console.Console(stderr=True), disable=quiet)

"""Frames a second of every camera."""

from __future__ import annotations

import functools
import statistics

from rich.console import Console

from caregiver_mj.errors import RenderingError
from caregiver_mj.studies.benchmark.clock import seconds_of
from caregiver_mj.studies.benchmark.effort import EPSILON, Effort
from caregiver_mj.studies.benchmark.prototype import PROTOTYPE, RENDERING, prototype
from caregiver_mj.studies.display import make_table
from caregiver_mj.tasks import load

_FRAME = (480, 640)  # height, width
_CAMERAS = ("overview", "follow", "wrist")


def rendering(effort: Effort, console: Console) -> dict[str, float] | None:
    """Frames a second by camera; None where nothing can be drawn."""
    env = load("supervise", "paper", EPSILON, random=0)
    env.reset()
    height, width = _FRAME
    table = make_table(f"Rendering, {width} x {height}", "camera", "frames a second", "ms a frame")
    figures = {}
    try:
        for camera in _CAMERAS:
            draw = functools.partial(env.physics.render, height, width, camera_id=camera)
            draw()
            figures[camera] = 1 / statistics.median(seconds_of(draw) for _ in range(effort.frames))
            table.add_row(camera, f"{figures[camera]:.1f}", f"{1e3 / figures[camera]:.1f}")
    except RenderingError as error:
        console.print(f"Rendering was skipped: {error}\n")
        return None
    table.add_row("prototype, as large", f"{1e3 / PROTOTYPE[RENDERING]:.1f}", prototype(RENDERING))
    console.print(table)
    return figures

"""What a frame of a film costs, and of what that is made up."""

from __future__ import annotations

import contextlib
import pathlib
import tempfile
import time
from collections.abc import Callable

from rich.console import Console

from caregiver_mj.errors import RenderingError
from caregiver_mj.studies.benchmark.clock import Clock
from caregiver_mj.studies.benchmark.effort import EPSILON, Effort
from caregiver_mj.studies.display import make_table
from caregiver_mj.viz import hud
from caregiver_mj.viz.cameras import Camera
from caregiver_mj.viz.encoder import film_writer
from caregiver_mj.viz.episode import Episode
from caregiver_mj.viz.film import DEFAULT_FPS, DEFAULT_SIZE
from caregiver_mj.viz.still_camera import StillCamera
from caregiver_mj.viz.studio import Studio
from caregiver_mj.viz.tiles import TileLayer

_FRAMES = 4  # times those of the cameras' section, for no frame is like the next
_TRAIL = 600  # looks
_ROUGH = {"offsamples": 0, "shadowsize": 1024}  # without antialiasing, and shadows half as fine


def filming(effort: Effort, console: Console) -> dict[str, dict[str, float]] | None:
    """Milliseconds of a frame by part, on the clock and of all processor cores; None where nothing can be drawn."""
    frames = _FRAMES * effort.frames
    figures = {}
    try:
        for title, overlay, quality in (("plain", False, {}), ("overlay", True, {}), ("rough", False, _ROUGH)):
            figures[title] = _film(frames, overlay, quality, time.perf_counter)
            figures[f"{title}, processor"] = _film(frames, overlay, quality, time.process_time)
    except RenderingError as error:
        console.print(f"Filming was skipped: {error}\n")
        return None
    width, height = DEFAULT_SIZE
    table = make_table(f"A frame of a film, {width} x {height}, {frames} frames; ms", "part", *figures)
    for part in next(iter(figures.values())):
        table.add_row(part, *(f"{column[part]:.1f}" for column in figures.values()))
    table.add_row("in all", *(f"{sum(column.values()):.1f}" for column in figures.values()))
    console.print(table)
    return figures


def _film(frames: int, overlay: bool, quality: dict[str, int], timer: Callable[[], float]) -> dict[str, float]:
    """Films, and tells how long each part of a frame takes, ms."""
    episode = Episode.load(children=EPSILON, caregiver="paper-predictive" if overlay else "paper", foresees=overlay)
    for name, value in quality.items():
        setattr(episode.env.physics.model.vis.quality, name, value)
    studio = Studio(episode, *DEFAULT_SIZE, "overview", _TRAIL)
    episode.run_until(0.0)
    studio.frame()  # the first one is drawn whole
    clocks = {name: Clock(timer) for name in ("simulation", "house", "insets", "overlay", "display", "rest", "film")}
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        write = stack.enter_context(film_writer(pathlib.Path(folder) / "film.mp4", *DEFAULT_SIZE, DEFAULT_FPS))
        write(studio.frame())
        for name, owner, method in (
            ("simulation", episode, "run_until"),
            ("house", StillCamera, "render"),
            ("insets", Camera, "render"),
            ("overlay", TileLayer, "lay"),
            ("display", hud, "draw"),
            ("rest", studio, "frame"),
        ):
            stack.enter_context(clocks[name].of(owner, method))
        encode = clocks["film"].around(write)
        for number in range(1, frames + 1):
            episode.run_until(number / DEFAULT_FPS)
            encode(studio.frame())
    episode.env.close()
    return {name: 1e3 * clock.own / frames for name, clock in clocks.items()}

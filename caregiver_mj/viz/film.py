"""Films of episodes in the house, at the speed of the simulated world."""

from __future__ import annotations

import contextlib
import math
import numbers
import os
from collections.abc import Callable, Iterator
from typing import Protocol

import numpy as np
import rich.console
import rich.progress
from PIL import Image

from caregiver_mj.children.family import Family
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.embodiment import DEFAULT
from caregiver_mj.viz import OVERLAYS
from caregiver_mj.viz.encoder import film_writer, writable
from caregiver_mj.viz.episode import Episode
from caregiver_mj.viz.studio import Studio

DEFAULT_SIZE = 1280, 720  # pixels
DEFAULT_FPS = 30.0
_SMALLEST, _LARGEST = (320, 240), (3840, 2160)  # pixels
LONGEST = 86_400  # seconds of a film
_TRAIL_SECONDS = 20.0


class Films(Protocol):
    """What makes pictures of an episode."""

    def frame(self) -> np.ndarray:
        """The present moment, uint8 (height, width, 3)."""


def render_episode(
    path: str | os.PathLike[str],
    *,
    task: str = "supervise",
    house: str | os.PathLike[str] | FloorPlan = "paper",
    epsilon: Family | float | str = 0.5,
    seed: int = 0,
    episode: int | None = 0,
    seconds: float = 30.0,
    caregiver: str = "paper",
    embodiment: str = DEFAULT,
    width: int = DEFAULT_SIZE[0],
    height: int = DEFAULT_SIZE[1],
    fps: float = DEFAULT_FPS,
    camera: str = "overview",
    overlay: str | None = None,
    still: str | os.PathLike[str] | None = None,
    quiet: bool = False,
    studio: Callable[[Episode, int, int, str, int], Films] = Studio,
) -> None:
    """Films an episode, with what the caregiver knows and does on display.

    It is the episode that an evaluation with the same seed runs: the same children, and the same chance in the
    caregiver.

    Args:
        path: The film, `FILE.mp4`.
        task: One of `caregiver_mj.ALL_TASKS`; those of an evaluation are "supervise".
        house: A floor plan, the name of one that comes with the package, or the path of a file.
        epsilon: The novice's share of random moves; for several children that of each, as in "1,0.25".
        seed: Seed of the run.
        episode: Number of the episode in the run. None if the seed is that of a single episode, as in the column
            `seed` of a run; the caregiver gets the same one.
        seconds: Length of the film; less if the episode is over before.
        caregiver: Name of the caregiver, or of a policy; without a robot for "none".
        embodiment: Name of the robot.
        width: Width of the picture in pixels, even.
        height: Height of the picture in pixels, even.
        fps: Frames a second.
        camera: The camera of the large view.
        overlay: What is laid over the floor, one of `OVERLAYS`: "danger" for where the caregiver thinks that the
            children may be soon, and what may hurt them. None for nothing.
        still: Where to put a picture of a telling moment, `FILE.png`: a child nearest to a candle in the robot's
            hand, or else the middle of the film.
        quiet: Whether to do without the progress bar.
        studio: Makes what takes the pictures, of the episode, width, height, camera and length of the trails.

    Raises:
        CaregiverError: Something of the above is not possible.
        RenderingError: There is no OpenGL to render with.
    """
    path, still = writable(path, ".mp4"), None if still is None else writable(still, ".png")
    _check_picture(width, height, fps, seconds)
    if overlay not in (None, *OVERLAYS):
        raise CaregiverError(f"no overlay '{overlay}': there is {', '.join(OVERLAYS)}")
    foresees = overlay == "danger"
    filmed = Episode.load(task, house, epsilon, seed, episode, caregiver, embodiment, foresees)
    best: tuple[float, np.ndarray | None] = (math.inf, None)
    count = max(1, round(seconds * fps))
    with (
        contextlib.closing(filmed.env),
        _progress(count, quiet) as advance,
        film_writer(path, width, height, fps) as write,
    ):
        shots = studio(filmed, width, height, camera, round(_TRAIL_SECONDS * fps))
        for number in range(count):
            if not filmed.run_until(number / fps):
                break
            frame = shots.frame()
            write(frame)
            score = min(filmed.child_to_carried_candle(), 1e6 + abs(number - count // 2))
            if score < best[0]:
                best = (score, frame)
            advance()
    if still is not None:
        assert best[1] is not None  # a film has one frame at least
        Image.fromarray(best[1]).save(still)


def _check_picture(width: int, height: int, fps: float, seconds: float) -> None:
    for what, size, smallest, largest in zip(("width", "height"), (width, height), _SMALLEST, _LARGEST, strict=True):
        if not isinstance(size, numbers.Integral) or size % 2 or not smallest <= size <= largest:
            raise CaregiverError(f"{what} must be an even number of pixels from {smallest} to {largest}, not {size!r}")
    if not (isinstance(fps, numbers.Real) and 1.0 <= fps <= 120.0):
        raise CaregiverError(f"fps must lie in 1 to 120, not {fps}")
    if not (isinstance(seconds, numbers.Real) and math.isfinite(seconds) and seconds > 0):
        raise CaregiverError(f"seconds must be a positive length, not {seconds}")
    if seconds > LONGEST:
        raise CaregiverError(f"a film has {LONGEST:,} seconds at most, a day, not {seconds:g}")


@contextlib.contextmanager
def _progress(frames: int, quiet: bool) -> Iterator[Callable[[], None]]:
    """A progress bar on standard error; gives the function that advances it."""
    columns = (
        rich.progress.TextColumn("{task.description}"),
        rich.progress.BarColumn(),
        rich.progress.MofNCompleteColumn(),
        rich.progress.TimeElapsedColumn(),
        rich.progress.TimeRemainingColumn(),
    )
    with rich.progress.Progress(*columns, console=rich.console.Console(stderr=True), disable=quiet) as bar:
        task = bar.add_task("frames", total=frames)
        yield lambda: bar.advance(task)

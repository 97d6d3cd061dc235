"""How long to measure."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Effort:
    """How long to measure.

    Attributes:
        seconds: Simulated seconds of an episode.
        repeats: How often everything that is compared is repeated.
        large_seconds: Simulated seconds in the large houses.
        frames: Frames to draw with each camera.
        calls: Calls of what takes microseconds.
        jobs: Episodes for the scaling over processes.
        houses: Houses to run on each executor.
    """

    seconds: float = 340.0
    repeats: int = 5
    large_seconds: float = 100.0
    frames: int = 30
    calls: int = 2000
    jobs: int = 6
    houses: int = 100


QUICK = Effort(seconds=60.0, repeats=3, large_seconds=20.0, frames=6, calls=300, jobs=4, houses=10)
EPSILON = 0.5  # of the child in all episodes

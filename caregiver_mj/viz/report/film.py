"""The film in a report."""

from __future__ import annotations

import base64
import dataclasses
import os
import pathlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.words import family_name, members

FILM_NAME = "report.mp4"  # of a film that is made for the report
LARGEST_FILM = 40.0  # MB, for it becomes part of the page
_PICTURE: dict[str, Any] = {"seconds": 15.0, "width": 960, "height": 540}  # of such a film
_TYPICAL = 0.5  # share of random moves to which that of the filmed children is to come close


@dataclasses.dataclass(frozen=True)
class Film:
    """A film and what to say about it."""

    path: pathlib.Path
    caption: str

    def data(self, largest: float = LARGEST_FILM) -> str:
        """Return the film as part of a page, of at most so many MB.

        Raises:
            CaregiverError: It cannot be read, is no film, or is too large.
        """
        try:
            content = self.path.read_bytes()
        except OSError as error:
            raise CaregiverError(f"the film '{self.path}' cannot be read: {error.strerror}") from None
        if content[4:8] != b"ftyp":  # how every MP4 file begins
            raise CaregiverError(f"the film must be an MP4, got '{self.path}'")
        if len(content) > largest * 1e6:
            size = round(len(content) / 1e6)
            raise CaregiverError(
                f"the film must have at most {largest:g} MB, to be part of a page, got {size} MB in '{self.path}'"
            )
        return f"data:video/mp4;base64,{base64.b64encode(content).decode()}"


def found_film(folders: Sequence[str | os.PathLike[str]]) -> Film | None:
    """Return the first film in some folders, if there is one."""
    paths = (path for folder in folders for path in sorted(pathlib.Path(folder).glob("*.mp4")))
    return next((Film(path, path.name) for path in paths), None)


def make_film(runs: Sequence[Run], folder: str | os.PathLike[str], render: Callable[..., None] | None = None) -> Film:
    """Film the first episode of a run of a report into a folder, with `film.render_episode` unless it is `render`."""
    if render is None:
        from caregiver_mj.viz.film import render_episode  # takes a second to import, and OpenGL to run

        render = render_episode
    # One in the house, else the first one, whose children can walk there too.
    run = next((run for run in runs if run.settings.world == "house"), runs[0])

    def from_typical(family: str) -> float:
        return abs(float(np.mean([epsilon for _, epsilon in members(family)])) - _TYPICAL)

    family = min(run.families, key=from_typical)
    path = pathlib.Path(folder) / FILM_NAME
    render(
        path,
        house=run.settings.plans[0],
        epsilon=family,
        seed=run.settings.seed,
        episode=0,
        caregiver=run.caregiver,
        embodiment=run.settings.embodiment,
        **_PICTURE,
    )
    whose = "of the run" if run.settings.world == "house" else "with the children of the run in the grid"
    return Film(path, f"Episode 0 {whose}, {family_name(family)}, caregiver {run.caregiver}")

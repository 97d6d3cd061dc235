"""The paper's figures of a run, maps of the house, and figures as part of a page."""

from __future__ import annotations

import base64
import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.recording.record import DAMAGE_THRESHOLD
from caregiver_mj.viz import figures
from caregiver_mj.viz.figures import Series
from caregiver_mj.viz.report import published
from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.words import TITLES, UNITS, in_lines


@dataclasses.dataclass(frozen=True)
class Picture:
    """A figure with the name of its files and its caption."""

    name: str
    svg: bytes
    png: bytes
    caption: str

    @classmethod
    def of(cls, name: str, figure: Figure, caption: str) -> Picture:
        return cls(name, figures.as_bytes(figure, "svg"), figures.as_bytes(figure, "png"), caption)

    @property
    def data(self) -> str:
        return f"data:image/svg+xml;base64,{base64.b64encode(self.svg).decode()}"


def charts(run: Run) -> list[Picture]:
    """Return the paper's figures 2 to 4."""
    names = [in_lines(family) for family in run.families]
    pictures = []
    timesteps, cells = "timesteps_to_threshold", "cells_visited"
    normalised = f"normalised {TITLES['damage']}"
    for number, column, quantity, top, caption in (
        (2, "damage_normalised", normalised, 1.0, "Damage, as a share of the greatest of any episode"),
        (3, timesteps, UNITS[timesteps], EPISODE_TIMESTEPS, f"Timesteps until damage is above {DAMAGE_THRESHOLD:g}"),
        (4, cells, UNITS[cells], None, "Distinct cells visited until then"),
    ):
        alone, guarded = (_series(run, caregiver, column) for caregiver in ("none", run.caregiver))
        figure = figures.bars(names, alone, guarded, quantity, top)
        caption = f"Figure {number}. {caption} — {run.title}"
        pictures.append(Picture.of(f"figure_{number}_{run.name}", figure, caption))
    return pictures


def left_series(run: Run, caregiver: str, label: str, families: Sequence[str], of: str = "damage") -> Series:
    """Return the share of damage, or of toys reached, that a caregiver leaves with each of some families."""
    rows = [run.comparison(caregiver, "none", family) or {} for family in families]
    mean, low, high = _numbers(rows, f"{of}_left", ("", "_ci_low", "_ci_high"))
    return Series(label, mean, low, high, published=published.left(run, families) if of == "damage" else None)


def _series(run: Run, caregiver: str, column: str) -> Series:
    rows = [run.row(caregiver, family) for family in run.families]
    mean, sd, low, high = _numbers(rows, column, ("_mean", "_sd", "_ci_low", "_ci_high"))
    guarded = caregiver != "none"
    label = "with caregiver" if guarded else "no caregiver"
    return Series(label, mean, low, high, sd, published.series(run, column, run.families, guarded))


def _numbers(rows: Sequence[dict[str, Any]], stem: str, ends: tuple[str, ...]) -> list[np.ndarray]:
    return [np.array([row.get(f"{stem}{end}") for row in rows], float) for end in ends]


def maps(run: Run) -> list[Picture]:
    """Return maps of visits and of damage, without and with the caregiver, each on one scale."""
    pictures = []
    for column, quantity, scale, caption in (
        ("visits", "timesteps an episode", figures.WENT, f"Where {run.nouns['whom']} went"),
        ("damage", "damage an episode", figures.HURT, f"Where {run.nouns['were']} hurt"),
    ):
        cells = {caregiver: mean_map(run, caregiver, column) for caregiver in ("none", run.caregiver)}
        top = max(float(values.max()) for values in cells.values())
        for caregiver, values in cells.items():
            who = "without" if caregiver == "none" else "with"
            figure = figures.heat_map(run.settings.plan, values, scale, top, quantity)
            name = f"map_{column}_{who}_{run.name}"
            pictures.append(Picture.of(name, figure, f"{caption}, {who} the caregiver — {run.title}"))
    return pictures


def mean_map(run: Run, caregiver: str, column: str) -> np.ndarray:
    """Return the mean of a map's column per episode, over all families, for each free cell."""
    cells = run.maps[run.maps.caregiver == caregiver].groupby(["row", "column"])[column].sum()
    values = cells / (run.settings.episodes * len(run.families))
    return values.loc[list(run.settings.plan.free_cells)].to_numpy()

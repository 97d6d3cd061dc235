"""Runs of different worlds or houses beside each other."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from caregiver_mj.viz import figures
from caregiver_mj.viz.report import published
from caregiver_mj.viz.report.charts import Picture, left_series
from caregiver_mj.viz.report.left import left_cell
from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.table import Table
from caregiver_mj.viz.report.words import NONE, family_name, if_bracketed, in_lines, members, percent

_MOSTLY_RANDOM = 0.5  # share of random moves from which on worlds are compared on average


def side_by_side(runs: Sequence[Run]) -> dict[str, Any] | None:
    """What the caregiver leaves of the damage in each run, and how far apart that is; None of a single run."""
    if len(runs) < 2:
        return None
    families = _all_families(runs)
    series = [left_series(run, run.caregiver, run.title, families) for run in runs]
    cited = series[0].published if all(published.compares_with(run) for run in runs) else None
    series = series if cited is not None else [dataclasses.replace(one, published=None) for one in series]
    apart = _apart(runs, [one.mean for one in series])
    columns = [run.title for run in runs]
    columns += [] if cited is None else ["published"]
    columns += [] if apart is None else ["house against grid"]
    rows = []
    for i, family in enumerate(families):
        cells = [left_cell(run, run.caregiver, family) for run in runs]
        if cited is not None:
            cells.append(NONE if np.isnan(cited[i]) else f"{cited[i]:.2f}")
        if apart is not None:
            cells.append(percent(apart[i]))
        rows.append((family_name(family), *cells))
    note = "Share of the damage that is left with the caregiver" + if_bracketed(rows, ", and its 95 % interval")
    note += "; damage of an episode, of that alone."
    note += "" if apart is None else _on_average(families, apart)
    title = f"Damage left in {len(runs)} runs"
    who = next((run for run in runs if run.several), runs[0]).nouns.who
    figure = figures.damage_left([in_lines(family) for family in families], series)
    picture = Picture.of("damage_left", figure, "Damage left with the caregiver, as a share of that without")
    return {"table": Table(title, (who, *columns), rows, note), "pictures": [picture]}


def _all_families(runs: Sequence[Run]) -> list[str]:
    """The families of all runs, the one with most random moves first."""

    def share(family: str) -> float:
        return float(np.mean([epsilon for _, epsilon in members(family)]))

    return sorted({family for run in runs for family in run.families}, key=lambda family: (-share(family), family))


def _apart(runs: Sequence[Run], left: Sequence[np.ndarray]) -> np.ndarray | None:
    """How much more is left in the house than in the grid, (families,), if these are two runs of the same one."""
    if any(run.settings.plans != runs[0].settings.plans for run in runs):
        return None
    shares = {run.settings.world: one for run, one in zip(runs, left, strict=True)}
    return shares["house"] / shares["grid"] - 1 if len(runs) == 2 and len(shares) == 2 else None


def _on_average(families: Sequence[str], apart: np.ndarray) -> str:
    """The same over all families that move mostly at random, as a sentence."""
    both = [
        i
        for i, family in enumerate(families)
        if min(epsilon for _, epsilon in members(family)) >= _MOSTLY_RANDOM and np.isfinite(apart[i])
    ]
    if not both:
        return ""
    who = ", ".join(family_name(families[i]) for i in both)
    return f" House against grid, on average over {who}: {percent(float(np.mean(apart[both])))}."

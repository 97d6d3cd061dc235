"""The paper's numbers, and the conditions for a comparison with ours."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz.report import words
from caregiver_mj.viz.report.run import Run

PAPER = 'Rosman, Hayes and Scassellati, "Enhancing Agent Safety through Autonomous Environment Adaptation", 2015'
# Its Tables I and II: means of 20 episodes without and with the caregiver, by the share of the novice's moves that are
# random. Damage is normalised by the greatest of any episode.
PUBLISHED = {
    "damage_normalised": {
        1.0: (0.7346, 0.2291),
        0.75: (0.5295, 0.1438),
        0.5: (0.2846, 0.1106),
        0.25: (0.1887, 0.0466),
        0.05: (0.0565, 0.0072),
    },
    "timesteps_to_threshold": {
        1.0: (35.50, 97.05),
        0.75: (41.05, 164.20),
        0.5: (89.50, 171.50),
        0.25: (107.70, 200.00),
        0.05: (195.75, 200.00),
    },
}
_NEITHER = (float("nan"), float("nan"))


def compares_with(run: Run) -> bool:
    """Return whether the paper's numbers are comparable with a run.

    They are of one novice at the paper's speed, an unpublished house, and a caregiver with full sight. Only house
    `paper` stands in for that house.
    """
    settings = run.settings
    its_own = settings.plans == (FloorPlan.load("paper"),) and settings.sight == "all"
    its_own &= settings.child_speed == WALKING_SPEED
    return its_own and any(len(words.members(family)) == 1 for family in run.families)


def means(run: Run, column: str, family: str) -> tuple[float, float] | None:
    """Return the paper's means without and with the caregiver, or None if it has none for these children."""
    only, *others = words.members(family)
    if others or only[0] or not compares_with(run):
        return None
    return PUBLISHED.get(column, {}).get(only[1])


def deviations(run: Run) -> dict[str, list[dict[str, Any]]]:
    """Return the rows of the paper's Tables I and II: our mean, its 95 % interval, the paper's mean, and the deviation.

    There is a row for each share of random moves, without and with the caregiver; for damage also for the share left.
    """
    found: dict[str, list[dict[str, Any]]] = {column: [] for column in PUBLISHED}
    for family, column in itertools.product(run.families, PUBLISHED):
        if (cited := means(run, column, family)) is None:
            continue
        quantities = [
            (which, run.row(caregiver, family), column, paper)
            for which, caregiver, paper in zip(("without", "with"), ("none", run.caregiver), cited, strict=True)
        ]
        if column == "damage_normalised":
            left_here = run.compared(run.caregiver, "none", family)
            quantities.append(("left", left_here, "damage_left", cited[1] / cited[0]))
        for which, row, key, paper in quantities:
            ours = row[key if key in row else f"{key}_mean"]
            interval = {end: row[f"{key}_ci_{end}"] for end in ("low", "high")}
            cells = {"epsilon": family, "quantity": which, "here": ours, **interval, "paper": paper}
            found[column].append(cells | {"deviation": None if ours is None else ours - paper})
    return found


def series(run: Run, column: str, families: Sequence[str], with_caregiver: bool) -> np.ndarray:
    """Return the paper's means for several families, NaN for unknown ones, (families,)."""
    return np.array([(means(run, column, family) or _NEITHER)[with_caregiver] for family in families])


def left(run: Run, families: Sequence[str]) -> np.ndarray:
    """Return the paper's shares of damage left with the caregiver, NaN for unknown ones, (families,)."""
    alone, guarded = (series(run, "damage_normalised", families, caregiver) for caregiver in (False, True))
    return guarded / alone


def avoided(run: Run) -> str | None:
    """Return the paper's share of damage avoided over all novices, or None if it lacks one of them."""
    found = [means(run, "damage_normalised", family) for family in run.families]
    if None in found:
        return None
    alone, guarded = np.sum(found, axis=0)  # type: ignore[arg-type]  # mypy does not see that there is no None
    return f"{100 * (1 - guarded / alone):.0f} %"

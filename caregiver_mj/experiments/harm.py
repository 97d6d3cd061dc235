"""Harm: in which houses which child takes more damage with a caregiver than alone.

A cell is a house and a child, or a family of children. Episode i of it has the same draws with and without the
caregiver, so the two are compared by pairs. The p is one-sided, of a mean difference that is not above zero, by
flipping the signs of the pairs, and corrected by Holm over all cells of a caregiver in the run; harm is shown where it
is .05 or less and the 95 % interval of the mean difference is above zero.

Why sign flips: if a caregiver makes no difference, each pair could as well be the other way round, so they are exact,
however few the pairs and however uneven their differences, which are mostly zero, else bumps and falls. Student's t is
not: it is certain of two differences that are equal. Wilcoxon's ranks are not of the mean, which is what is claimed.
The price is that few pairs show nothing: with six that differ, no p is below 1 / 2⁶ = .016. So it is said in how many
cells harm could be shown at all.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from caregiver_mj.experiments import intervals
from caregiver_mj.experiments.settings import FLOOR
from caregiver_mj.experiments.verdicts import LEVEL, Verdict, holm, least_p_more, sign_flip_p_more, verdict

BASELINE = "none"
COLUMNS = (
    "damage_difference",
    "damage_difference_ci_low",
    "damage_difference_ci_high",
    "worse",
    "harm_p",
    "harm_p_least",
)


def of_cells(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """Return what a caregiver does in each cell.

    Args:
        ours: Damage with the caregiver, (episodes, cells).
        theirs: The same alone.

    Returns:
        The `COLUMNS` of each cell, (cells, columns): the mean paired difference, ours less theirs, with its interval;
        the share of the episodes with more damage than alone; the p of harm, and the least that it could be.
    """
    difference = ours - theirs
    found = intervals.of_difference(ours, theirs)
    worse = (difference > 0).mean(axis=0)
    return np.stack([*found, worse, sign_flip_p_more(difference), least_p_more(difference)], axis=1)


def judge_cells(cells: pd.DataFrame) -> pd.DataFrame:
    """Return `harm_p_holm` and `harm_verdict` of each cell: "more", "no verdict", or "" with nothing to judge.

    Args:
        cells: A row a cell, with `caregiver` and `COLUMNS`.
    """
    corrected = cells.groupby("caregiver", sort=False)["harm_p"].transform(holm)
    ends = cells["damage_difference_ci_low"], cells["damage_difference_ci_high"]
    judged = ["" if np.isnan(one[0]) else verdict(*one).value for one in zip(corrected, *ends, strict=True)]
    return pd.DataFrame({"harm_p_holm": corrected, "harm_verdict": judged}, cells.index)


def harm(cells: pd.DataFrame) -> list[dict[str, Any]]:
    """Return how much harm each caregiver does: the `harm` of summary.json.

    Args:
        cells: A row for each house, caregiver and family, as `by_house` has them.

    Returns:
        For each caregiver that acts, in order of appearance: `cells` of a house and a family, in how many of them harm
        is shown (`cells_harmed`) and could be (`cells_decidable`: where one with so many pairs that differ could, if
        the others did not); `episodes`, and the share of them with more damage than alone (`episodes_worse`); and
        `worst`, the cell of the greatest difference, of those with harm if there are any: `house`, `family`,
        `episodes`, `damage_alone`, `damage_with`, the mean `damage_difference` with its interval (an end is None where
        the episodes give none), `p`, `p_holm` and `verdict`. None at all of a run without `none`.
    """
    alone = cells[cells["caregiver"] == BASELINE].set_index(["house", "family"])["damage"]
    judged = cells[(cells["harm_verdict"] != "") & (cells["caregiver"] != FLOOR)]
    return [_of_caregiver(name, rows, alone) for name, rows in judged.groupby("caregiver", sort=False)]


def _of_caregiver(caregiver: str, cells: pd.DataFrame, alone: pd.Series) -> dict[str, Any]:
    harmed = cells["harm_verdict"] == Verdict.MORE
    worst = cells.loc[cells.loc[harmed if harmed.any() else slice(None), "damage_difference"].idxmax()]
    episodes = cells["episodes"]
    ends = (worst[f"damage_difference_ci_{end}"] for end in ("low", "high"))
    low, high = (float(end) if np.isfinite(end) else None for end in ends)
    return {
        "world": worst["world"],
        "caregiver": caregiver,
        "baseline": BASELINE,
        "cells": len(cells),
        "cells_harmed": int(harmed.sum()),
        "cells_decidable": int((cells["harm_p_least"] * len(cells) <= LEVEL).sum()),
        "episodes": int(episodes.sum()),
        "episodes_worse": float((cells["worse"] * episodes).sum() / episodes.sum()),
        "worst": {
            "house": worst["house"],
            "family": worst["family"],
            "episodes": int(worst["episodes"]),
            "damage_alone": float(alone[worst["house"], worst["family"]]),
            "damage_with": float(worst["damage"]),
            "damage_difference": float(worst["damage_difference"]),
            "damage_difference_ci_low": low,
            "damage_difference_ci_high": high,
            "p": float(worst["harm_p"]),
            "p_holm": float(worst["harm_p_holm"]),
            "verdict": str(worst["harm_verdict"]),
        },
    }

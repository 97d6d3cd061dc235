"""What each caregiver leaves of the damage: in one house, or over several and in each of them."""

from __future__ import annotations

from typing import Any

import pandas as pd

from caregiver_mj.viz import figures
from caregiver_mj.viz.report.baselines import verdicts
from caregiver_mj.viz.report.charts import Picture, left_series
from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.table import Table
from caregiver_mj.viz.report.words import family_name, if_bracketed, in_lines, number, with_interval

_FEW = 4  # caregivers that are told apart side by side; more of them have a row each
FLOOR_IS = (
    "The floor is what remains when nothing but bare tables is left: every candle is gone and every stairwell shut. It "
    "is no bound: a caregiver comes below it by being in the child's way."
)


def left(run: Run) -> dict[str, Any]:
    """Everything that the page shows of it."""
    return {
        "table": left_table(run),
        "pictures": _pictures(run),
        "verdicts": verdicts(run),
        "wins": wins_table(run),
        "floor": FLOOR_IS if run.floor else "",
    }


def left_table(run: Run) -> Table:
    """Caregivers by families, in the run's order."""
    caregivers = [caregiver for caregiver in run.settings.caregivers if caregiver != "none"]
    rows = [(c, *(left_cell(run, c, family) for family in run.families)) for c in caregivers]
    note = f"Share of the damage without a caregiver that is left{if_bracketed(rows, ', and its 95 % interval')}"
    note += "; damage of an episode, of that alone."
    if run.houses > 1:
        note += f" Means over {run.houses} houses, each of which counts the same"
        note += if_bracketed(rows, "; intervals are over houses") + "."
    columns = ("caregiver", *map(family_name, run.families))
    return Table(f"Damage left by each caregiver — {run.title}", columns, rows, note)


def left_cell(run: Run, caregiver: str, family: str) -> str:
    """The share of the damage that is left, with its interval, and of how much damage how much that is."""
    row = run.comparison(caregiver, "none", family)
    share = with_interval(row, "damage_left", 2, between="\n")
    if row is None:
        return share
    ours, alone = (number(run.row(name, family)["damage_mean"]) for name in (caregiver, "none"))
    return f"{share}\n{ours} of {alone}"


def wins_table(run: Run) -> Table | None:
    """In how many houses the caregiver has less damage than each other one, and in how many more."""
    if run.by_house is None or not run.baselines:
        return None
    damage = run.by_house.pivot_table(index=["family", "house"], columns="caregiver", values="damage")
    rows = []
    for baseline in run.baselines:
        cells = []
        for family in run.families:
            difference = damage.loc[family, run.caregiver] - damage.loc[family, baseline]
            cells.append(f"{(difference < 0).sum()} : {(difference > 0).sum()}")
        rows.append((baseline, *cells))
    note = (
        f"Houses in which {run.caregiver} has less damage : houses in which it has more, of {run.houses}; in the rest "
        f"it is the same. Of {run.settings.episodes} episodes a house, so chance has its part in each."
    )
    title = f"Houses with less and with more damage with {run.caregiver} than with others — {run.title}"
    return Table(title, ("against", *map(family_name, run.families)), rows, note)


def _pictures(run: Run) -> list[Picture]:
    """Every house as a point; of a single house, or of few caregivers in one, their shares."""
    name, floor = f"damage_left_{run.name}", next(iter(run.floor), "")
    means = pd.DataFrame([row for row in run.summary["comparisons"] if row["baseline"] == "none"])
    means = means.set_index("caregiver").loc[[c for c in run.settings.caregivers if c != "none"]].reset_index()
    bounded = means[["damage_left_ci_low", "damage_left_ci_high"]].notna().any(axis=None)
    with_its = ", with its 95 % interval" if bounded else ""
    caption = f"Damage left, as a share of that without a caregiver{with_its} — {run.title}"
    names = {family: family_name(family) for family in run.families}
    if run.by_house is not None:
        caption = f"Damage left in each house, and its mean over houses{with_its} — {run.title}"
        narrow, wide = (
            figures.houses(run.by_house, means, names, caregiver=run.caregiver, columns=columns)
            for columns in (1, len(names))
        )
        return [Picture.of(name, narrow, caption), Picture.of(f"{name}_wide", wide, caption)]
    if len(run.baselines) >= _FEW:
        return [Picture.of(name, figures.houses(None, means, names, caregiver=run.caregiver), caption)]
    series = [left_series(run, caregiver, caregiver, run.families) for caregiver in (run.caregiver, *run.baselines)]
    line = left_series(run, floor, floor, run.families) if floor else None
    lines = [in_lines(family) for family in run.families]
    return [Picture.of(name, figures.damage_left(lines, series, line), caption)]

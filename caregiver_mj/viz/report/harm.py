"""Where a caregiver does harm: more damage with it than alone. It comes before everything else in a report."""

from __future__ import annotations

from typing import Any

from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.table import Table
from caregiver_mj.viz.report.words import family_name, number, with_interval

HARM_IS = (
    "Damage with each caregiver less that alone, in the same episodes. A cell is a house and a child; harm, more "
    "damage than alone, is shown where a one-sided test (sign flips of the pairs) is at 5 % after Holm's correction "
    "over all cells of the caregiver, and the 95 % interval of the mean difference, in brackets, is above zero. It "
    "could be shown where pairs enough differ. The worst cell is that of the greatest difference, of those with harm "
    "if there are any."
)


def harm(run: Run) -> dict[str, Any]:
    """A sentence on the caregiver that the report is about, and a table of all."""
    rows = run.summary["harm"]
    ours = next(row for row in rows if row["caregiver"] == run.caregiver)
    return {"shown": bool(ours["cells_harmed"]), "sentence": _sentence(ours), "table": harm_table(run)}


def _sentence(row: dict[str, Any]) -> str:
    worst = row["worst"]
    harmed = row["cells_harmed"] or "none"
    text = f"Harm: with {row['caregiver']} in {harmed} of {row['cells']} cells of a house and a child"
    if row["cells_decidable"] < row["cells"]:
        text += f" (with so few pairs that differ it could be shown in {row['cells_decidable'] or 'none'})"
    return (
        f"{text}. Worst: {_cell(worst)}, damage {number(worst['damage_alone'], 2)} alone, "
        f"{number(worst['damage_with'], 2)} with it ({_difference(worst)}). "
        f"{number(100 * row['episodes_worse'])} % of the episodes are worse than alone."
    )


def harm_table(run: Run) -> Table:
    """All caregivers, in the run's order."""
    rows = [
        (
            row["caregiver"],
            f"{row['cells_harmed']} of {row['cells']}",
            str(row["cells_decidable"]),
            f"{number(100 * row['episodes_worse'])} %",
            _cell(row["worst"]),
            number(row["worst"]["damage_alone"], 2),
            number(row["worst"]["damage_with"], 2),
            _difference(row["worst"]),
        )
        for row in run.summary["harm"]
    ]
    columns = ("caregiver", "cells with harm", "could be shown in", "episodes worse than alone", "worst cell")
    return Table(f"Harm — {run.title}", (*columns, "alone", "with", "difference"), rows)


def _cell(worst: dict[str, Any]) -> str:
    return f"{worst['house']}, {family_name(worst['family'])}"


def _difference(worst: dict[str, Any]) -> str:
    return with_interval(worst, "damage_difference", 2, sign="+")

"""What is left of the damage, and of what: stairs, candles and bare tables apart."""

from __future__ import annotations

from typing import Any

import pandas as pd

from caregiver_mj.viz import figures
from caregiver_mj.viz.report.charts import Picture
from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.table import Table
from caregiver_mj.viz.report.words import NONE, family_name, if_bracketed, in_lines, number, with_interval

_OF_ALL = "left by tables"


def kinds(run: Run) -> dict[str, Any]:
    """A figure and a table."""
    names = {family: in_lines(family) for family in run.families}
    figure = figures.kinds(pd.DataFrame(run.summary["rows"]), names, caregiver=run.caregiver)
    caption = f"What did the damage, as shares of that without a caregiver; on the bars, damage — {run.title}"
    pictures = [Picture.of(f"kinds_{run.name}", figure, caption)]
    return {"short": short_table(run), "table": kinds_table(run), "pictures": pictures}


def short_table(run: Run) -> Table:
    """Means alone, without and with the caregiver."""

    def cells(column: str) -> tuple[str, ...]:
        rows = ([run.row(caregiver, family) for caregiver in ("none", run.caregiver)] for family in run.families)
        return tuple(" → ".join(number(row[f"{column}_mean"]) for row in pair) for pair in rows)

    rows = [(name, *cells(kind)) for kind, name in figures.KINDS.items()]
    rows.append(("all", *cells("damage")))
    for floor in run.floor:
        rows.append((floor, *(number(run.row(floor, family)["damage_mean"]) for family in run.families)))
    rows.append((_OF_ALL, *(_share(run, family) for family in run.families)))
    columns = ("damage at", *map(family_name, run.families))
    return Table(f"Damage without → with the caregiver — {run.title}", columns, rows)


def kinds_table(run: Run) -> Table:
    """Damage by what did it, without and with the caregiver, and the floor of it."""
    who = {"none": "without", run.caregiver: "with"} | dict.fromkeys(run.floor, "floor")
    rows = []
    for kind, name in figures.KINDS.items():
        for caregiver, how in who.items():
            cells = (with_interval(run.row(caregiver, family), f"{kind}_mean", between="\n") for family in run.families)
            rows.append((f"{name}, {how}", *cells))
    rows.append((_OF_ALL, *(_share(run, family) for family in run.families)))
    interval = if_bracketed(rows, " and its 95 % interval")
    note = f"Damage of an episode{interval}. Where a candle is taken from a table, that is a bare one."
    columns = ("damage at", *map(family_name, run.families))
    return Table(f"What is left, and of what — {run.title}", columns, rows, note)


def _share(run: Run, family: str) -> str:
    """How much of the damage that is left bare tables do."""
    row = run.row(run.caregiver, family)
    return f"{number(100 * row['damage_table_mean'] / row['damage_mean'], 0)} %" if row["damage_mean"] else NONE

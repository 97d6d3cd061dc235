"""The readable form of summary.json, for a terminal."""

from __future__ import annotations

from typing import Any

import rich.box
import rich.table

_COLUMNS = ("timesteps_to_threshold", "cells_visited", "toys_reached", "moves_blocked", "interventions_done")


def table(summary: dict[str, Any]) -> rich.table.Table:
    """A row for each caregiver and family."""
    rows = summary["rows"]
    first = rows[0]
    episodes = f"{first['episodes']} episodes each" if first["episodes"] > 1 else "1 episode each"
    where = first["house"] if "houses" in first else f"'{first['house']}'"
    made = rich.table.Table(
        title=f"{first['world']} {where}, {episodes}, seed {summary['seed']}",
        caption="mean ± standard deviation; left: damage over that of 'none'",
        box=rich.box.SIMPLE_HEAD,
    )
    only_children = not any("," in row["family"] for row in rows)
    made.add_column("epsilon" if only_children else "epsilon of each", justify="right", no_wrap=True)
    made.add_column("caregiver", no_wrap=True)
    for title in ("damage", "normalised", "left", "timesteps", "cells", "toys", "blocked", "done"):
        made.add_column(title, justify="right", no_wrap=True)
    against_none = (row for row in summary["comparisons"] if row["baseline"] == "none")
    left = {(row["caregiver"], row["family"]): row["damage_left"] for row in against_none}
    for i, row in enumerate(rows):
        ratio = 1.0 if row["caregiver"] == "none" else left.get((row["caregiver"], row["family"]))
        made.add_row(
            row["family"],
            row["caregiver"],
            f"{row['damage_mean']:.1f} ± {row['damage_sd']:.1f}",
            f"{row['damage_normalised_mean']:.2f}",
            "" if ratio is None else f"{ratio:.2f}",
            *(f"{row[f'{column}_mean']:.1f}" for column in _COLUMNS),
            end_section=i + 1 < len(rows) and rows[i + 1]["family"] != row["family"],
        )
    return made

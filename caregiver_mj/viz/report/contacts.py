"""What the robot did to the children: strikes, pressings, forces beside what adults bear, the candle in its hand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from caregiver_mj.recording.body_limits import BODY_LIMITS, CAUTION
from caregiver_mj.recording.contacts import FAR, FLAME_CLEAR, WAX_CLEAR, Contacts
from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.table import Table
from caregiver_mj.viz.report.words import NONE, TITLES, UNITS, family_name, number

# Columns of the table, how the episodes are put together, and digits.
_SHOWN = (
    ("strikes", "sum", 0),
    ("strikes_surface", "sum", 0),
    ("contact_speed", "max", 2),
    ("contact_seconds", "mean", 2),
    ("pressings", "sum", 0),
    ("contact_force", "max", 0),
    ("contact_impulse", "mean", 1),
    ("flame_distance", "min", 2),
    ("flame_seconds", "mean", 2),
    ("wax_distance", "min", 2),
    ("wax_seconds", "mean", 2),
    ("candles_dropped", "sum", 0),
)
_HOW = {"sum": "in all", "mean": "an episode", "max": "the most", "min": "the least"}
_KINEMATIC = "These children are kinematic: they do not give way, so the forces are far too high (docs/contacts.md). "
_SOURCE = "DGUV 2011, as reprinted in Buxbaum and Sen, table 1.4 (in: Bendel, Pflegeroboter, 2018)"


def contacts(run: Run) -> dict[str, Any] | None:
    """Two tables of a run in the house; None of one in the grid, or of an older version, which did not count this."""
    if run.settings.world != "house" or not set(Contacts().outcome()) <= set(run.episodes):
        return None
    own = run.episodes[run.episodes.caregiver == run.caregiver]
    groups = {family_name(family): own[own.family == family] for family in run.families}
    return {"tables": [counts_table(groups, f" — {run.title}"), limits_table(own, f" — {run.title}")]}


def counts_table(groups: Mapping[str, pd.DataFrame], where: str = "") -> Table:
    """What was counted in several groups of episodes in the house."""
    rows = []
    for column, how, digits in _SHOWN:
        unit = f", {UNITS[column]}" if UNITS[column] else ""
        cells = (number(float(group[column].agg(how)), digits) for group in groups.values())
        if column in ("flame_distance", "wax_distance"):
            cells = (NONE if cell == number(FAR, digits) else cell for cell in cells)
        rows.append((f"{TITLES[column]} ({_HOW[how]}{unit})", *cells))
    rows.insert(0, ("episodes", *(str(len(group)) for group in groups.values())))
    note = (
        "A strike is a contact with a part of the robot that moves towards a child faster than 0.05 m/s; turning and "
        "sliding too: whose surface comes, or is driven, towards it or along it. A pressing is a contact of half a "
        f"second or more. Near is within {FLAME_CLEAR:g} m of the flame, and within {WAX_CLEAR:g} m of the candle "
        "itself, while it is in the robot's hand."
    )
    return Table(f"What the robot did to children{where}", ("with the caregiver", *groups), rows, note)


def limits_table(episodes: pd.DataFrame, where: str = "", compliant: bool = False) -> Table:
    """The greatest force on each part of a child, who is compliant or else kinematic, beside what adults bear there."""
    rows = []
    for limit in BODY_LIMITS:
        force = float(episodes[f"contact_force_{limit.region}"].max())
        share = number(100 * force / limit.impact, 0)
        rows.append(
            (limit.region, limit.part, f"{force:.0f}", f"{limit.clamping:g}", f"{limit.impact:g}", f"{share} %")
        )
    columns = ("on the child's", "of an adult", "greatest force, N", "clamped, N", "impact, N", "of the impact's")
    note = f"{'' if compliant else _KINEMATIC}Limits of adults: {_SOURCE}. {CAUTION}"
    return Table(f"Forces beside what adults bear{where}", columns, rows, note)

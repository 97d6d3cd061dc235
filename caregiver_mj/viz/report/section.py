"""Everything that a report has of a run."""

from __future__ import annotations

from typing import Any

from caregiver_mj.viz.report import published, tables
from caregiver_mj.viz.report.charts import bounded, charts
from caregiver_mj.viz.report.child import child
from caregiver_mj.viz.report.contacts import contacts
from caregiver_mj.viz.report.harm import harm
from caregiver_mj.viz.report.headline import headline
from caregiver_mj.viz.report.kinds import kinds
from caregiver_mj.viz.report.left import left
from caregiver_mj.viz.report.maps import maps
from caregiver_mj.viz.report.run import Run


def section(run: Run) -> dict[str, Any]:
    """The parts by name; `pictures` are all that are in them."""
    parts = {
        "left": left(run),
        "kinds": kinds(run),
        "child": child(run),
        "charts": charts(run),
        "maps": maps(run) if run.houses == 1 else [],
    }
    pictures = [
        picture for part in parts.values() if part for picture in (part["pictures"] if isinstance(part, dict) else part)
    ]
    return parts | {
        "run": run,
        "nouns": run.nouns,
        "cited": published.compares_with(run),
        "bounded": bounded(run),
        "harm": harm(run),
        "headline": headline(run),
        "contacts": contacts(run),
        "published": [tables.damage_table(run), tables.timesteps_table(run)],
        "comparison": tables.comparison_table(run),
        "children": tables.children_table(run),
        "measures": tables.measures_tables(run),
        "pictures": pictures,
    }

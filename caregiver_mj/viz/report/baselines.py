"""How the caregiver does against others that act, and what of that is shown."""

from __future__ import annotations

from typing import Any

from caregiver_mj.experiments.verdicts import MARGINS, Verdict
from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.words import family_name, with_interval

_MARGIN = f"within {MARGINS['damage']:.0%}".replace("%", " %")
# What a comparison may show, best first: what is said of it; and whether numbers go with it.
_FINDINGS = {
    "less": ("less damage", False),
    "hardly less": (f"less damage, but {_MARGIN}", True),
    "equivalent": (f"equivalent, {_MARGIN}", True),
    "none": ("no verdict", True),
    "more": ("more damage", True),
}


def verdicts(run: Run) -> list[tuple[bool, str]]:
    """For each baseline whether the caregiver has less damage with every family, and a sentence of what is shown."""
    found = []
    for baseline in run.baselines:
        rows = [(f, row) for f in run.families if (row := run.comparison(run.caregiver, baseline, f)) is not None]
        told: dict[str, list[str]] = {finding: [] for finding in _FINDINGS}
        for family, row in rows:
            finding = _finding(row)
            told[finding].append(_told(family, row) if _FINDINGS[finding][1] else family_name(family))
        if len(told["less"]) == len(rows):
            told["less"] = [f"every {run.nouns.group}"]
        parts = [f"{_FINDINGS[finding][0]} with {', '.join(which)}" for finding, which in told.items() if which]
        found.append((all(_finding(row) == "less" for _, row in rows), f"Against {baseline}: {'; '.join(parts)}."))
    return found if run.caregiver == "paper" else []  # the summary compares no other one with baselines


def _finding(row: dict[str, Any]) -> str:
    """What a comparison shows: the difference first, then how much it is."""
    equivalent = row["damage_equivalence"] == Verdict.EQUIVALENT
    if row["damage_verdict"] == Verdict.MORE:
        return "more"
    if row["damage_verdict"] == Verdict.LESS:
        return "hardly less" if equivalent else "less"
    return "equivalent" if equivalent else "none"


def _told(family: str, row: dict[str, Any]) -> str:
    """A family, and its difference in damage and the ratio of damages."""
    difference = with_interval(row, "damage_difference_mean", 2, sign="+")
    return f"{family_name(family)} (difference {difference}, ratio {with_interval(row, 'damage_left', 2)})"

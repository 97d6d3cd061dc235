"""How the caregiver does against others that act, and where it does not win."""

from __future__ import annotations

from typing import Any

from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.table import Table
from caregiver_mj.viz.report.words import family_name, p_value, with_interval

SIGNIFICANT = 0.01  # p below which one caregiver is said to beat another


def baselines(run: Run) -> dict[str, Any] | None:
    """A table of what each caregiver leaves of the damage, and verdicts; None where there is no other one."""
    if not run.baselines:
        return None
    caregivers = (run.caregiver, *run.baselines)
    rows = []
    for family in run.families:
        cells = [with_interval(run.comparison(c, "none", family), "damage_left", 2) for c in caregivers]
        rows.append((family_name(family), *cells))
    note = "Share of the damage without a caregiver that is left, and its 95 % interval."
    table = Table(f"Damage left by each caregiver — {run.title}", (run.nouns.who, *caregivers), rows, note)
    return {"table": table, "verdicts": verdicts(run)}


def verdicts(run: Run) -> list[tuple[bool, str]]:
    """For each baseline whether the caregiver beats it with every family, and a sentence that says so plainly."""
    found = []
    for baseline in run.baselines:
        rows = [(f, row) for f in run.families if (row := run.comparison(run.caregiver, baseline, f)) is not None]
        lost = [told for family, row in rows if (told := _unless_won(family, row))]
        if not lost:
            text = f"Beats {baseline} with every {run.nouns.group}: less damage, p < {SIGNIFICANT} each."
        else:
            some = f"{len(lost)} of {len(rows)} {run.nouns.groups}"
            which = f"any {run.nouns.group}" if len(lost) == len(rows) else some
            text = f"Does not beat {baseline} with {which}. Difference in damage there: {'; '.join(lost)}."
        found.append((not lost, text))
    return found if run.caregiver == "paper" else []  # the summary compares no other one with baselines


def _unless_won(family: str, row: dict[str, Any]) -> str:
    """The numbers of a comparison that is not won, else nothing."""
    clear, difference = row["damage_p"] < SIGNIFICANT, row["damage_difference_mean"]
    if clear and difference < 0:
        return ""
    worse = "more damage: " if clear else ""
    numbers = f"{with_interval(row, 'damage_difference_mean', 2, sign='+')}, {p_value(row['damage_p'])}"
    return f"{worse}{family_name(family)} {numbers}"

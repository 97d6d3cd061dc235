"""The tables of a run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.experiments import statistics
from caregiver_mj.recording.record import COLUMNS, DAMAGE_THRESHOLD
from caregiver_mj.viz.report import published
from caregiver_mj.viz.report.left import left_cell
from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.table import Table
from caregiver_mj.viz.report.words import (
    NONE,
    TITLES,
    family_name,
    if_bracketed,
    members,
    number,
    p_value,
    with_interval,
)

_BY_CHILD = {"damage_by_child": "damage", "toys_by_child": "toys_reached"}  # and the column that is their sum


def damage_table(run: Run) -> Table:
    """The paper's Table I: normalised damage, and how much of it is left."""
    rows = []
    for family in run.families:
        alone, guarded = run.row("none", family), run.row(run.caregiver, family)
        cited = published.means(run, "damage_normalised", family)
        cells = (
            with_interval(alone, "damage_normalised_mean", 3, between="\n"),
            NONE if cited is None else f"{cited[0]:.3f}",
            with_interval(guarded, "damage_normalised_mean", 3, between="\n"),
            NONE if cited is None else f"{cited[1]:.3f}",
            left_cell(run, run.caregiver, family),
            NONE if cited is None else f"{cited[1] / cited[0]:.2f}",
        )
        rows.append((family_name(family), *cells))
    interval = if_bracketed(rows, " and its 95 % interval")
    note = (
        f"Mean normalised damage in {EPISODE_TIMESTEPS} timesteps{interval}. 1.0 is the greatest of any "
        f"episode of the run ({run.episodes.damage.max():g}), the greater, the more episodes: compare the shares left. "
        "Below these is the damage itself, of that without."
    )
    return _beside_published(run, f"Table I. Damage — {run.title}", ("without", "with", "left"), rows, note)


def timesteps_table(run: Run) -> Table:
    """The paper's Table II: timesteps until the threshold of damage."""
    column, rows = "timesteps_to_threshold", []
    for family in run.families:
        cited = published.means(run, column, family)
        cells = [family_name(family)]
        for i, caregiver in enumerate(("none", run.caregiver)):
            cells.append(with_interval(run.row(caregiver, family), f"{column}_mean", between="\n"))
            cells.append(NONE if cited is None else f"{cited[i]:.1f}")
        rows.append(tuple(cells))
    note = f"Mean timesteps until the damage is above {DAMAGE_THRESHOLD:g}, at most {EPISODE_TIMESTEPS}"
    note += if_bracketed(rows, ", and its 95 % interval") + "."
    return _beside_published(run, f"Table II. Timesteps — {run.title}", ("without", "with"), rows, note)


def _beside_published(
    run: Run, title: str, quantities: tuple[str, ...], rows: Sequence[tuple[str, ...]], note: str
) -> Table:
    """A table with our numbers and the paper's in turn; without the latter where they mean nothing."""
    if published.compares_with(run):
        columns = tuple(f"{quantity}, {where}" for quantity in quantities for where in ("here", "published"))
    else:
        columns, rows = quantities, [(row[0], *row[1::2]) for row in rows]
    return Table(title, (run.nouns.who, *columns), rows, note)


def comparison_table(run: Run) -> Table:
    """The differences that the caregiver makes, with intervals and tests."""
    found = {family: run.compared(run.caregiver, "none", family) for family in run.families}
    compared = [column for column in statistics.COMPARED if all(f"{column}_p" in row for row in found.values())]
    rows = []
    for family, row in found.items():
        cells = [
            f"{with_interval(row, f'{column}_difference_mean', 1, sign='+')}\n{p_value(row[f'{column}_p'])}"
            for column in compared
        ]
        rows.append((family_name(family), *cells))
    interval = ", in brackets its 95 % interval (studentised bootstrap; ∞ where the episodes do not bound it)"
    note = (
        f"With the caregiver less without, paired: episode i has the same {run.nouns.who} both times. The mean "
        f"difference{if_bracketed(rows, interval)}, and "
        "the p of the same mean being zero (sign flips, two-sided, this one alone; summary.json has it corrected by "
        "Holm, too); no p where fewer than six pairs differ, for none could be small enough."
    )
    columns = (run.nouns.who, *(TITLES[column] for column in compared))
    return Table(f"Differences that the caregiver makes — {run.title}", columns, rows, note)


def measures_tables(run: Run) -> list[Table]:
    """The mean of every measure with every caregiver, a table for each family."""
    measured = [c for c in COLUMNS if c.role in ("damage", "count") and c.world in ("", run.settings.world)]
    note = "Means of an episode. Standard deviations and intervals are in summary.json."
    tables = []
    for family in run.families:
        found = {caregiver: run.row(caregiver, family) for caregiver in run.settings.caregivers}
        rows = [
            (column.title, *(number(row[f"{column.name}_mean"]) for row in found.values()))
            for column in measured
            if all(f"{column.name}_mean" in row for row in found.values())
        ]
        tables.append(Table(f"Every measure, {family_name(family)} — {run.title}", ("measure", *found), rows, note))
    return tables


def children_table(run: Run) -> Table | None:
    """What happened to each of several children, or None where each is alone."""
    if not run.several:
        return None
    episodes, rows = run.episodes, []
    for family in (family for family in run.families if len(members(family)) > 1):
        means = {
            (caregiver, column): np.mean(np.stack(chosen[column].to_numpy()), axis=0)
            for caregiver in ("none", run.caregiver)
            for chosen in [episodes[(episodes.caregiver == caregiver) & (episodes.family == family)]]
            for column in _BY_CHILD
        }
        for child, (behaviour, epsilon) in enumerate(members(family)):
            name = f"{family_name(family)}: {behaviour or 'novice'} {child + 1}, {100 * epsilon:g} %"
            keys = [(caregiver, column) for column in _BY_CHILD for caregiver in ("none", run.caregiver)]
            rows.append((name, *(number(float(means[key][child])) for key in keys)))
    columns = (f"{TITLES[total]}, {what}" for total in _BY_CHILD.values() for what in ("without", "with"))
    note = "Means of an episode, without and with the caregiver."
    return Table(f"Each child — {run.title}", ("child", *columns), rows, note)

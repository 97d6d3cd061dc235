"""Tables of a run: the paper's, the child's side, comparisons, measures, harm, and contacts with the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.experiments import statistics, summary
from caregiver_mj.experiments.summary import Harm
from caregiver_mj.experiments.verdicts import MARGINS
from caregiver_mj.recording.ledger import FAR, FLAME_CLEAR, WAX_CLEAR
from caregiver_mj.recording.record import COLUMNS, DAMAGE_THRESHOLD
from caregiver_mj.viz import figures
from caregiver_mj.viz.report import words
from caregiver_mj.viz.report.left import left_cell, left_series
from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.words import NONE, TITLES, Picture, Table, family_name, number, with_interval

MARGIN = MARGINS["toys_reached"]
_RIVALS = 3  # other caregivers in a figure: those that leave the least damage
_BY_CHILD = {"damage_by_child": "damage", "toys_by_child": "toys_reached"}  # columns of each child, and of their sum
# Columns of contacts, aggregation over episodes, and digits.
_SHOWN = (
    ("strikes", "sum", 0), ("strikes_surface", "sum", 0), ("gate_strikes", "sum", 0), ("pinches", "sum", 0),
    ("pinch_seconds", "mean", 2), ("contacts_creeping", "sum", 0), ("contacts_slow", "sum", 0),
    ("contacts_fast", "sum", 0), ("contact_energy", "max", 2), ("contact_speed", "max", 2),
    ("contact_seconds", "mean", 2), ("pressings", "sum", 0), ("contact_force", "max", 0),
    ("contact_impulse", "mean", 1), ("flame_distance", "min", 2), ("flame_seconds", "mean", 2),
    ("wax_distance", "min", 2), ("wax_seconds", "mean", 2), ("candles_dropped", "sum", 0),
)  # fmt: skip
_UNMEASURED = "not measured"
_HOW = {"sum": "in all", "mean": "an episode", "max": "the most", "min": "the least"}
_KINEMATIC = "These children are kinematic: they do not give way, so the forces are far too high (docs/contacts.md). "
# Limits of adults put forces on a child into perspective; they are not a child's limits. Source: the pain threshold
# register of the German accident insurers (DGUV 2011, "BG/BGIA risk assessment recommendations according to machinery
# directive: design of workplaces with collaborative robots"), as reprinted in Buxbaum and Sen, "Kollaborierende Roboter
# in der Pflege", table 1.4 (in: Bendel (ed.), Pflegeroboter, Springer 2018, open access). ISO/TS 15066:2016 has a
# similar table in its annex A, from another study of adults, which ISO 10218-2:2025 adopts. ISO 13482:2014, on personal
# care robots, covers contact with people of any age, as hazards to assess and reduce for each robot. No compliance with
# any of them is claimed.
_SOURCE = "DGUV 2011, as reprinted in Buxbaum and Sen, table 1.4 (in: Bendel, Pflegeroboter, 2018)"
# Region, part of the body, and its limits, N: greatest force while clamped or squeezed, and of an impact.
_BODY_LIMITS = (
    ("head", "skull, forehead", 130, 175),
    ("head", "face", 65, 90),
    ("head", "neck, at the sides and behind", 145, 190),
    ("head", "throat", 35, 35),
    ("trunk", "back, shoulders", 210, 250),
    ("trunk", "chest", 140, 210),
    ("trunk", "belly", 110, 160),
    ("trunk", "pelvis", 180, 250),
    ("trunk", "upper arm, elbow", 150, 190),
    ("trunk", "forearm, wrist", 160, 220),
    ("trunk", "hand, fingers", 135, 180),
    ("legs", "thigh, knee", 220, 250),
    ("legs", "lower leg", 140, 170),
    ("legs", "foot, ankle", 125, 160),
)
_CAUTION = (
    "These limits are for adults at work, and nothing here claims to keep them: a child of a year and a half bears "
    "less, no such table covers it, and its head is as high as their hips. Standards that consider children forbid "
    "any contact, such as EN 16005 for automatic doors that many children use. In crash tests with the dummy of a "
    "child the risk of a serious injury was below 5 % only below 1.5 m/s (Paez-Granados and Billard, Scientific "
    "Reports 12, 5285, 2022)."
)


def damage_table(run: Run) -> Table:
    """Return the paper's Table I: normalised damage, and the share left."""
    column = "damage_normalised"
    ours = {what: run.cells(who, f"{column}_mean", 3) for what, who in (("without", "none"), ("with", run.caregiver))}
    ours["left"] = [left_cell(run, run.caregiver, family) for family in run.families]
    rows = _beside_published(run, column, ours, (3, 3, 2))
    note = (
        f"Mean normalised damage in {EPISODE_TIMESTEPS} timesteps. 1.0 is the greatest of any episode of the run "
        f"({run.episodes.damage.max():g}), the greater, the more episodes: compare the shares left. Below these is the "
        "damage itself, of that without."
    )
    return Table(f"Table I. Damage — {run.title}", rows[0], rows[1:], note)


def timesteps_table(run: Run) -> Table:
    """Return the paper's Table II: timesteps until the threshold of damage."""
    column = "timesteps_to_threshold"
    ours = {what: run.cells(who, f"{column}_mean") for what, who in (("without", "none"), ("with", run.caregiver))}
    rows = _beside_published(run, column, ours, (1, 1))
    note = f"Mean timesteps until the damage is above {DAMAGE_THRESHOLD:g}, at most {EPISODE_TIMESTEPS}."
    return Table(f"Table II. Timesteps — {run.title}", rows[0], rows[1:], note)


def _beside_published(
    run: Run, column: str, ours: Mapping[str, Sequence[str]], digits: Sequence[int]
) -> list[tuple[str, ...]]:
    """Return titles and rows of our cells, each beside the paper's number where these are comparable."""
    published = [run.published(column, family) for family in run.families]
    columns = [(run.nouns["who"], *map(family_name, run.families))]
    for i, (quantity, cells) in enumerate(ours.items()):
        columns.append((f"{quantity}, here" if run.cited else quantity, *cells))
        if run.cited:
            theirs = (NONE if one is None else f"{(*one, one[1] / one[0])[i]:.{digits[i]}f}" for one in published)
            columns.append((f"{quantity}, published", *theirs))
    return list(zip(*columns, strict=True))


def comparison_table(run: Run) -> Table:
    """Return the differences due to the caregiver, with intervals and tests."""
    found = {family: run.comparison(run.caregiver, family) for family in run.families}
    compared = [column for column in statistics.COMPARED if all(f"{column}_p" in row for row in found.values())]
    rows = []
    for family, row in found.items():
        cells = [
            f"{with_interval(row, f'{column}_difference_mean', 1, sign='+')}\n{words.p_value(row[f'{column}_p'])}"
            for column in compared
        ]
        rows.append((family_name(family), *cells))
    note = (
        f"With the caregiver less without, paired: episode i has the same {run.nouns['who']} both times. The mean "
        "difference (intervals by studentised bootstrap; ∞ where the episodes do not bound it), and the p of the same "
        "mean being zero (sign flips, two-sided, this one alone; summary.json has it corrected by Holm, too); no p "
        "where fewer than six pairs differ, for none could be small enough."
    )
    columns = (run.nouns["who"], *(TITLES[column] for column in compared))
    return Table(f"Differences that the caregiver makes — {run.title}", columns, rows, note)


def measures_tables(run: Run) -> list[Table]:
    """Return the mean of every measure with every caregiver, a table for each family."""
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
    """Return damage and toys of each child; None without families of several."""
    if not run.several:
        return None
    groups, rows = run.episodes.groupby(["caregiver", "family"]), []
    means = [groups[column].apply(lambda lists: np.mean([*lists], axis=0)) for column in _BY_CHILD]
    for family in (family for family in run.families if len(words.members(family)) > 1):
        for child, (behaviour, epsilon) in enumerate(words.members(family)):
            name = f"{family_name(family)}: {behaviour or 'novice'} {child + 1}, {100 * epsilon:g} %"
            values = (mean[caregiver, family][child] for mean in means for caregiver in ("none", run.caregiver))
            rows.append((name, *map(number, values)))
    columns = (f"{TITLES[total]}, {what}" for total in _BY_CHILD.values() for what in ("without", "with"))
    note = "Means of an episode, without and with the caregiver."
    return Table(f"Each child — {run.title}", ("child", *columns), rows, note)


def harm(run: Run) -> dict[str, Any]:
    """Return verdicts and tables of harm, the sentence on the caregiver, and the others that do harm."""
    verdicts = run.judged_anew(run.acting)
    ours = next(row for row in verdicts if row["caregiver"] == run.caregiver)
    also = [row["caregiver"] for row in verdicts if row["verdict"] == Harm.SHOWN and row is not ours]
    rows = [
        (row["caregiver"], part["title"], part["verdict"], part["text"])
        for row in verdicts
        for part in ({"title": "all", **row, "text": ""}, *row["parts"].values())
    ]
    columns = ("caregiver", "harm in", "could be shown in", "episodes worse than alone", "worst pair")
    damage = [_harm_cells(row) for row in summary.harm(run.by_house)]
    return {
        "shown": ours["verdict"] == Harm.SHOWN,
        "sentence": ours["text"],
        "also": f"Harm also with {', '.join(also)}." if also else "",
        "verdicts": verdicts,
        "table": Table(f"Harm — {run.title}", ("caregiver", "part", "verdict", "finding"), rows),
        "damage": Table(f"Harm by hazards — {run.title}", (*columns, "alone", "with", "difference"), damage),
    }


def _harm_cells(row: dict[str, Any]) -> tuple[str, ...]:
    worst = row["worst"]
    return (
        row["caregiver"],
        f"{row['cells_harmed']} of {row['cells']}",
        str(row["cells_decidable"]),
        f"{number(100 * row['episodes_worse'])} %",
        f"{worst['house']}, {family_name(worst['family'])}",
        number(worst["damage_alone"], 2),
        number(worst["damage_with"], 2),
        with_interval(worst, "damage_difference", 2, sign="+"),
    )


def contacts(run: Run) -> list[Table]:
    """Return the tables of contacts of every caregiver; none for a run in the grid."""
    if run.settings.world != "house":
        return []
    of = {caregiver: run.episodes[run.episodes.caregiver == caregiver] for caregiver in run.acting}
    tables = [counts_table(of, f" — {run.title}", "in all episodes")] if len(of) > 1 else []
    for caregiver, own in of.items():
        where = f", {caregiver} — {run.title}"
        if caregiver == run.caregiver:
            groups = {family_name(family): own[own.family == family] for family in run.families}
            tables.append(counts_table(groups, where))
        tables.append(limits_table(own, where))
    return tables


def counts_table(groups: Mapping[str, pd.DataFrame], where: str = "", first: str = "with the caregiver") -> Table:
    """Return the counts of contacts in groups of episodes in the house; older runs lack some columns."""
    rows = []
    for column, how, digits in _SHOWN:
        if any(column not in group for group in groups.values()):
            rows.append((f"{TITLES[column]} ({_HOW[how]})", *([_UNMEASURED] * len(groups))))
            continue
        unit = f", {words.UNITS[column]}" if words.UNITS[column] else ""
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
    return Table(f"What the robot did to children{where}", (first, *groups), rows, note)


def limits_table(episodes: pd.DataFrame, where: str = "", compliant: bool = False) -> Table:
    """Return the greatest force on each part of a compliant or kinematic child, with the limits for adults."""
    rows = []
    for region, part, clamping, impact in _BODY_LIMITS:
        force = float(episodes[f"contact_force_{region}"].max())
        rows.append((region, part, f"{force:.0f}", f"{clamping}", f"{impact}", f"{number(100 * force / impact, 0)} %"))
    columns = ("on the child's", "of an adult", "greatest force, N", "clamped, N", "impact, N", "of the impact's")
    note = f"{'' if compliant else _KINEMATIC}Limits of adults: {_SOURCE}. {_CAUTION}"
    return Table(f"Forces beside what adults bear{where}", columns, rows, note)


# -- The child's side ----------------------------------------------------------------------------------


def child(run: Run) -> dict[str, Any]:
    """Return the figures and tables."""
    rivals = sorted(run.baselines, key=lambda caregiver: run.mean(caregiver, "damage"))[:_RIVALS]
    shown = (run.caregiver, *(caregiver for caregiver in run.baselines if caregiver in rivals))
    lines = {family: words.in_lines(family) for family in run.families}
    names = {family: family_name(family) for family in run.families}
    survival = figures.survival(run.episodes, names, ("none", *shown, *run.bare_tables), caregiver=run.caregiver)
    toys = figures.toys_kept(
        list(lines.values()), [left_series(run, c, c, run.families, "toys_reached") for c in shown], MARGIN
    )
    toys_caption = f"Toys reached, as a share of those alone — {run.title}"
    return {
        "table": child_table(run),
        "more": [_stop_table(run), *([_toys_table(run), _denied_table(run)] if run.baselines else [])],
        "pictures": [
            Picture.of(f"survival_{run.name}", survival, f"Episodes that are not yet stopped — {run.title}"),
            Picture.of(f"toys_{run.name}", toys, toys_caption),
        ],
    }


def child_table(run: Run) -> Table:
    """Return the toys kept, the moves denied and the share of stopped episodes."""
    alone, guarded = ([run.row(c, family) for family in run.families] for c in ("none", run.caregiver))
    stopped = (
        f"{100 * before['stopped_mean']:.0f} → {100 * after['stopped_mean']:.0f}"
        for before, after in zip(alone, guarded, strict=True)
    )
    verdicts = (run.comparison(run.caregiver, family)["toys_reached_not_inferior"] for family in run.families)
    rows = [
        ("toys kept, %", *run.cells(run.caregiver, "toys_reached_left", scale=100.0, against=True)),
        (f"< {100 * MARGIN:g} % lost?", *verdicts),
        ("stairwells denied", *run.cells(run.caregiver, "moves_blocked_stairwell_mean")),
        ("free moves denied", *run.cells(run.caregiver, "moves_blocked_free_mean")),
        ("longest blocked", *run.cells(run.caregiver, "longest_blocked_mean")),
        ("stopped, %", *stopped),
    ]
    note = (
        "Toys reached with the caregiver, of those without; not inferior where the interval is above "
        f"{100 * (1 - MARGIN):g} %, a margin stated before any comparison. Moves an episode that the caregiver denies, "
        "and timesteps on end. Episodes stopped, without → with."
    )
    return run.table("The child's side", "with the caregiver", rows, note)


def _stop_table(run: Run) -> Table:
    """Return toys and damage until the stop, without and with the caregiver."""
    rows = [
        (f"{what}, {how}", *run.cells(caregiver, f"{column}_mean"))
        for what, column in (("toys reached", "toys_reached"), ("damage until the stop", "damage_until_stop"))
        for how, caregiver in (("without", "none"), ("with", run.caregiver))
    ]
    note = f"Means of an episode. The stop is where the damage comes above {DAMAGE_THRESHOLD:g}."
    return run.table("Toys, and damage until the stop", "mean", rows, note)


def _toys_table(run: Run) -> Table:
    rows = []
    for caregiver in run.acting:
        kept = run.cells(caregiver, "toys_reached_left", scale=100.0, against=True)
        verdicts = (run.comparison(caregiver, family)["toys_reached_not_inferior"] for family in run.families)
        rows.append((caregiver, *map("\n".join, zip(kept, verdicts, strict=True))))
    note = f"% of the toys reached alone, and whether less than {100 * MARGIN:g} % are lost."
    return run.table("Toys kept by each caregiver", "caregiver", rows, note)


def _denied_table(run: Run) -> Table:
    denied = "{moves_blocked_stairwell_mean:.1f} + {moves_blocked_free_mean:.1f}\n({longest_blocked_mean:.1f})"
    rows = [(c, *(denied.format_map(run.row(c, family)) for family in run.families)) for c in run.acting]
    note = "Moves of an episode denied: into a stairwell + free ones (longest time blocked, timesteps)."
    return run.table("Moves denied by each caregiver", "caregiver", rows, note)

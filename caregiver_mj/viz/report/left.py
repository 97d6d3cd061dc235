"""Damage left by each caregiver, also by kind and by cell: in one house, over several, and in runs side by side."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from caregiver_mj.caregivers.registry import RULE
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.experiments.verdicts import MARGINS, Verdict
from caregiver_mj.recording.record import DAMAGE_THRESHOLD
from caregiver_mj.viz import figures
from caregiver_mj.viz.figure_style import Series
from caregiver_mj.viz.report import words
from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.words import NONE, Picture, Table, family_name, in_lines, number

_FEW = 4  # number of other caregivers from which on each has a row of its own
_MARGIN = f"within {MARGINS['damage']:.0%}".replace("%", " %")
# Findings of a comparison, best first: words, and whether numbers go with them.
_FINDINGS = {
    "less": ("less damage", False),
    "hardly less": (f"less damage, but {_MARGIN}", True),
    "equivalent": (f"equivalent, {_MARGIN}", True),
    "none": ("no verdict", True),
    "more": ("more damage", True),
}
_MOSTLY_RANDOM = 0.5  # least share of random moves in the mean comparison of worlds
_OF_ALL = "left by tables"


def left(run: Run) -> dict[str, Any]:
    """Return the parts of the page about damage left."""
    tables = {"table": left_table(run), "score": score_table(run), "wins": wins_table(run)}
    return tables | {"pictures": _pictures(run), "verdicts": verdicts(run), "floor": bool(run.bare_tables)}


def left_table(run: Run) -> Table:
    """Return the damage left: a row for each caregiver, in the run's order, and a column for each family."""
    caregivers = [caregiver for caregiver in run.settings.caregivers if caregiver != "none"]
    rows = [(c, *(left_cell(run, c, family) for family in run.families)) for c in caregivers]
    note = "Share of the damage without a caregiver that is left; damage of an episode, of that alone."
    if run.houses > 1:
        note += f" Means over {run.houses} houses, each of which counts the same; intervals are over houses."
    return run.table("Damage left by each caregiver", "caregiver", rows, note)


def left_cell(run: Run, caregiver: str, family: str) -> str:
    """Return the share of damage left with its interval, and both amounts of damage."""
    row = run.comparison(caregiver, family)
    share = words.with_interval(row, "damage_left", 2, between="\n")
    if not row:
        return share
    ours, alone = (number(run.row(name, family)["damage_mean"]) for name in (caregiver, "none"))
    return f"{share}\n{ours} of {alone}"


def score_table(run: Run) -> Table | None:
    """Return the score of caregivers by families; None for a run of a version without scores."""
    if "score" not in run.comparison(run.caregiver, run.families[0]):
        return None
    rows = [(caregiver, *run.cells(caregiver, "score", 2, against=True)) for caregiver in run.acting]
    note = (
        "0 as without a caregiver, 1 with the damage of bare tables only. A strike counts as the lightest collision, a "
        "thing that the robot drops as the worst thing on a table."
    )
    return run.table("Score of each caregiver", "caregiver", rows, note)


def wins_table(run: Run) -> Table | None:
    """Return the numbers of houses with less and with more damage than with each other caregiver."""
    if run.houses == 1 or not run.baselines:
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
    title = f"Houses with less and with more damage with {run.caregiver} than with others"
    return run.table(title, "against", rows, note)


def _pictures(run: Run) -> list[Picture]:
    """Return figures of the houses as points, or for a single house of the shares left."""
    name, bare_tables = f"damage_left_{run.name}", next(iter(run.bare_tables), "")
    means = pd.DataFrame([row for row in run.summary["comparisons"] if row["baseline"] == "none"])
    means = means.set_index("caregiver").loc[[c for c in run.settings.caregivers if c != "none"]].reset_index()
    caption = f"Damage left, as a share of that without a caregiver; bars are 95 % intervals — {run.title}"
    names = {family: family_name(family) for family in run.families}
    if run.houses > 1:
        caption = f"Damage left in each house, and its mean over houses — {run.title}"
        narrow, wide = (
            figures.houses(run.by_house, means, names, caregiver=run.caregiver, columns=columns)
            for columns in (1, len(names))
        )
        return [Picture.of(name, narrow, caption), Picture.of(f"{name}_wide", wide, caption)]
    if len(run.baselines) >= _FEW:
        return [Picture.of(name, figures.houses(run.by_house[:0], means, names, caregiver=run.caregiver), caption)]
    series = [left_series(run, caregiver, caregiver, run.families) for caregiver in (run.caregiver, *run.baselines)]
    line = left_series(run, bare_tables, bare_tables, run.families) if bare_tables else None
    lines = [in_lines(family) for family in run.families]
    return [Picture.of(name, figures.damage_left(lines, series, line), caption)]


def verdicts(run: Run) -> list[tuple[bool, str]]:
    """Return, for each baseline, whether the caregiver has less damage with every family, and a sentence.

    The summary compares the paper's rule alone with others, and with no second name of its own.
    """
    found = []
    for baseline in (c for c in run.baselines if c not in RULE and run.caregiver in RULE):
        with_whom: dict[str, list[str]] = {finding: [] for finding in _FINDINGS}
        for family in run.families:
            row = run.comparison(run.caregiver, family, baseline)
            difference = words.with_interval(row, "damage_difference_mean", 2, sign="+")
            ratio, finding = words.with_interval(row, "damage_left", 2), _finding(row)
            numbers = f" (difference {difference}, ratio {ratio})" if _FINDINGS[finding][1] else ""
            with_whom[finding].append(family_name(family) + numbers)
        wins = len(with_whom["less"]) == len(run.families)
        if wins:
            with_whom["less"] = [f"every {run.nouns['group']}"]
        parts = [f"{_FINDINGS[finding][0]} with {', '.join(which)}" for finding, which in with_whom.items() if which]
        found.append((wins, f"{run.caregiver}, against {baseline}: {'; '.join(parts)}."))
    return found


def _finding(row: dict[str, Any]) -> str:
    """Return the finding of a comparison: first by the difference, then by its size."""
    equivalent = row["damage_equivalence"] == Verdict.EQUIVALENT
    if row["damage_verdict"] == Verdict.MORE:
        return "more"
    if row["damage_verdict"] == Verdict.LESS:
        return "hardly less" if equivalent else "less"
    return "equivalent" if equivalent else "none"


def side_by_side(runs: Sequence[Run]) -> dict[str, Any] | None:
    """Return the damage left in each run, and the difference between worlds; None for a single run."""
    if len(runs) < 2:
        return None
    # Families of all runs, those with most random moves first.
    shares = {f: np.mean([epsilon for _, epsilon in words.members(f)]) for run in runs for f in run.families}
    families = sorted(shares, key=lambda family: (-shares[family], family))
    series = [left_series(run, run.caregiver, run.title, families) for run in runs]
    cited = series[0].published if all(run.cited for run in runs) else None
    series = series if cited is not None else [dataclasses.replace(one, published=None) for one in series]
    apart = _apart(runs, [one.mean for one in series])
    columns = [run.title for run in runs]
    columns += [] if cited is None else ["published"]
    columns += [] if apart is None else ["house against grid"]
    rows = []
    for i, family in enumerate(families):
        cells = [left_cell(run, run.caregiver, family) for run in runs]
        if cited is not None:
            cells.append(NONE if np.isnan(cited[i]) else f"{cited[i]:.2f}")
        if apart is not None:
            cells.append(words.percent(apart[i]))
        rows.append((family_name(family), *cells))
    note = "Share of the damage that is left with the caregiver; damage of an episode, of that alone."
    note += "" if apart is None else _on_average(families, apart)
    title = f"Damage left in {len(runs)} runs"
    who = next((run for run in runs if run.several), runs[0]).nouns["who"]
    figure = figures.damage_left([in_lines(family) for family in families], series)
    picture = Picture.of("damage_left", figure, "Damage left with the caregiver, as a share of that without")
    return {"table": Table(title, (who, *columns), rows, note), "pictures": [picture]}


def _apart(runs: Sequence[Run], left: Sequence[np.ndarray]) -> np.ndarray | None:
    """Return the relative excess left in the house over the grid, (families,), of two runs of the same houses."""
    if any(run.settings.plans != runs[0].settings.plans for run in runs):
        return None
    shares = {run.settings.world: one for run, one in zip(runs, left, strict=True)}
    return shares["house"] / shares["grid"] - 1 if len(runs) == 2 and len(shares) == 2 else None


def _on_average(families: Sequence[str], apart: np.ndarray) -> str:
    """Return the mean excess over families that move mostly at random, as a sentence."""
    random = [min(epsilon for _, epsilon in words.members(family)) >= _MOSTLY_RANDOM for family in families]
    both = np.flatnonzero(np.isfinite(apart) & random).tolist()
    if not both:
        return ""
    who = ", ".join(family_name(families[i]) for i in both)
    return f" House against grid, on average over {who}: {words.percent(float(np.mean(apart[both])))}."


def kinds(run: Run) -> dict[str, Any]:
    """Return figure and tables of damage by kind."""
    names = {family: in_lines(family) for family in run.families}
    figure = figures.kinds(pd.DataFrame(run.summary["rows"]), names, caregiver=run.caregiver)
    caption = f"What did the damage, as shares of that without a caregiver; on the bars, damage — {run.title}"
    pictures = [Picture.of(f"kinds_{run.name}", figure, caption)]
    return {"short": short_table(run), "table": kinds_table(run), "pictures": pictures}


def short_table(run: Run) -> Table:
    """Return the mean damage without and with the caregiver."""

    def cells(column: str) -> tuple[str, ...]:
        rows = ([run.row(caregiver, family) for caregiver in ("none", run.caregiver)] for family in run.families)
        return tuple(" → ".join(number(row[f"{column}_mean"]) for row in pair) for pair in rows)

    rows = [(name, *cells(kind)) for kind, name in figures.kinds_in(pd.DataFrame(run.summary["rows"])).items()]
    rows.append(("all", *cells("damage")))
    for name in run.bare_tables:
        rows.append((name, *(number(run.row(name, family)["damage_mean"]) for family in run.families)))
    rows.append((_OF_ALL, *(_share(run, family) for family in run.families)))
    return run.table("Damage without → with the caregiver", "damage at", rows)


def kinds_table(run: Run) -> Table:
    """Return the damage by kind, without and with the caregiver, and of bare tables only."""
    who = {"none": "without", run.caregiver: "with"} | dict.fromkeys(run.bare_tables, "floor")
    rows = []
    for kind, name in figures.kinds_in(pd.DataFrame(run.summary["rows"])).items():
        rows += [(f"{name}, {how}", *run.cells(caregiver, f"{kind}_mean")) for caregiver, how in who.items()]
    rows.append((_OF_ALL, *(_share(run, family) for family in run.families)))
    note = "Damage of an episode. Where a candle is taken from a table, that is a bare one."
    return run.table("What is left, and of what", "damage at", rows, note)


def _share(run: Run, family: str) -> str:
    """Return the share of bare tables in the damage left."""
    row = run.row(run.caregiver, family)
    return f"{number(100 * row['damage_table_mean'] / row['damage_mean'], 0)} %" if row["damage_mean"] else NONE


# -- The paper's figures, and maps ------------------------------------------------------------------


def charts(run: Run) -> list[Picture]:
    """Return the paper's figures 2 to 4."""
    until = f"Timesteps until damage is above {DAMAGE_THRESHOLD:g}"
    pictures = []
    for place, column, top, caption in (
        (2, "damage_normalised", 1.0, "Damage, as a share of the greatest of any episode"),
        (3, "timesteps_to_threshold", EPISODE_TIMESTEPS, until),
        (4, "cells_visited", None, "Distinct cells visited until then"),
    ):
        quantity = words.UNITS.get(column) or f"normalised {words.TITLES['damage']}"
        alone, guarded = (_series(run, caregiver, column) for caregiver in ("none", run.caregiver))
        figure = figures.bars([in_lines(family) for family in run.families], alone, guarded, quantity, top)
        pictures.append(Picture.of(f"figure_{place}_{run.name}", figure, f"Figure {place}. {caption} — {run.title}"))
    return pictures


def left_series(run: Run, caregiver: str, label: str, families: Sequence[str], of: str = "damage") -> Series:
    """Return the share of damage, or of toys reached, that a caregiver leaves with each of some families."""
    rows = [run.comparison(caregiver, family) for family in families]
    mean, low, high = _numbers(rows, f"{of}_left", ("", "_ci_low", "_ci_high"))
    alone, guarded = (run.published_series("damage_normalised", families, who) for who in (False, True))
    cited = guarded / alone
    return Series(label, mean, low, high, published=cited if of == "damage" else None)


def _series(run: Run, caregiver: str, column: str) -> Series:
    rows = [run.row(caregiver, family) for family in run.families]
    mean, sd, low, high = _numbers(rows, column, ("_mean", "_sd", "_ci_low", "_ci_high"))
    guarded = caregiver != "none"
    label = "with caregiver" if guarded else "no caregiver"
    return Series(label, mean, low, high, sd, run.published_series(column, run.families, guarded))


def _numbers(rows: Sequence[dict[str, Any]], stem: str, ends: tuple[str, ...]) -> list[np.ndarray]:
    return [np.array([row.get(f"{stem}{end}") for row in rows], float) for end in ends]


def maps(run: Run) -> list[Picture]:
    """Return maps of visits and of damage, without and with the caregiver, each on one scale."""
    pictures = []
    for column, quantity, scale, caption in (
        ("visits", "timesteps an episode", figures.WENT, f"Where {run.nouns['whom']} went"),
        ("damage", "damage an episode", figures.HURT, f"Where {run.nouns['were']} hurt"),
    ):
        sums = run.maps.groupby(["caregiver", "row", "column"])[column].sum()
        means = sums / (run.settings.episodes * len(run.families))  # of an episode
        places = list(run.settings.plan.free_cells)
        cells = {caregiver: means[caregiver].loc[places].to_numpy() for caregiver in ("none", run.caregiver)}
        top = max(float(values.max()) for values in cells.values())
        for caregiver, values in cells.items():
            who = "without" if caregiver == "none" else "with"
            figure = figures.heat_map(run.settings.plan, values, scale, top, quantity)
            name = f"map_{column}_{who}_{run.name}"
            pictures.append(Picture.of(name, figure, f"{caption}, {who} the caregiver — {run.title}"))
    return pictures

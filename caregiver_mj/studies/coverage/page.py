"""The text of docs/coverage.md."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pandas as pd

from caregiver_mj.studies.coverage.methods import IN_USE
from caregiver_mj.studies.documents import table

WANTED = (0.94, 0.965)  # coverage of what is called 95 %

_INTRODUCTION = """\
# Do the intervals cover the truth?

An interval is called one of 95 %. Here that is put to the test on real episodes of the grid: in each of four houses,
at five epsilons, {episodes:,} pairs of episodes (no caregiver, and the paper's, with the same child) are taken for the
whole world, so that the truth is known. {samples:,} times {sizes} of these pairs are drawn, and it is counted how often
the interval has the truth in it. All of this page is printed by

    {command}

The simulation's own standard error is {error:.1%} a cell.

![Coverage of four intervals of the damage left](coverage.png)

## Damage left: four intervals

Over the {cells} cells of each size: mean coverage, lowest and highest, and how often on average the interval lies
below the truth, which flatters the caregiver, and above it.

{methods}

The one in use is the studentised bootstrap, in the form that does not divide by a mean that may be close to zero
(Hwang, Biometrika 82, 1995): resampled is t(R) = mean(y - R x) / se(y - R x) with the damage y with and x without the
caregiver, and the interval is all R that t does not speak against, as in Fieller's theorem. Fieller's own interval
takes Student's t instead, as if damage were normal. It covers nearly as often, but errs on one side. The percentiles
of resampled ratios, which this project used to give, miss more often than they say, and on the flattering side. BCa
does not mend that with few episodes.

{verdict}

## The one in use, cell by cell

Covered, and in brackets how often the interval lies below and above the truth, in per cent. *Harmless* is the share of
pairs without any damage; *open* the share of the intervals of {first} pairs that have no upper end.

{cell_table}

Where most pairs are harmless, {first} of them hold little: the interval then covers more often than it says, is often
open, and says so. No interval that is closed can do that: the percentiles cover {worst_percentile:.0%} there.

## Means and differences

The same for the mean damage with the caregiver, and for its mean difference to that without.

{means}

## Over houses

Houses are drawn from the set `{pools}`, then {in_house} pairs of episodes in each; {house_samples} times, so that the
simulation's standard error is {house_error:.1%}. The interval resamples houses, then episodes in them.

{houses}

*Ratio of means* is the mean damage over houses with the caregiver over that without. The *mean of ratios* counts the
damage left in every house the same, also where there is hardly any damage: there the ratio of {in_house} episodes is
too high on average, and with many such houses its interval settles beside the truth. With few episodes in a house,
or careful children, the ratio of means is the one to look at.
"""


def page(study: Any, episodes: pd.DataFrame, houses: pd.DataFrame, command: str) -> str:
    """Writes the page.

    Args:
        study: What was simulated, a `Coverage`.
        episodes: What came out over episodes.
        houses: What came out over houses.
        command: What printed it.
    """
    left = episodes[episodes.quantity == "damage left"]
    ours = left[left.method == IN_USE]
    percentile = left[(left.method == "percentile") & (left["size"] == study.sizes[0])]
    rest = episodes[episodes.quantity != "damage left"]
    return _INTRODUCTION.format(
        command=command,
        episodes=study.episodes,
        samples=study.samples,
        sizes=_series(study.sizes),
        error=(0.95 * 0.05 / study.samples) ** 0.5,
        cells=len(ours) // len(study.sizes),
        methods=_summary(left, ["method", "size"], ["interval", "pairs"]),
        verdict=_verdict(ours),
        first=study.sizes[0],
        cell_table=_cells(ours, study.sizes),
        worst_percentile=percentile.covered.min(),
        means=_summary(rest, ["quantity", "size"], ["quantity", "pairs"]),
        pools=study.house_set,
        in_house=study.in_house,
        house_samples=study.house_samples,
        house_error=(0.95 * 0.05 / study.house_samples) ** 0.5,
        houses=_houses(houses),
    )


def _summary(rows: pd.DataFrame, keys: Sequence[str], titles: Sequence[str]) -> str:
    found = []
    for key, group in rows.groupby(list(keys), sort=False):
        covered = group.covered
        figures = (covered.mean(), covered.min(), covered.max(), group.too_low.mean(), group.too_high.mean())
        found.append([*map(str, key), *(f"{100 * figure:.1f} %" for figure in figures)])
    return table([*titles, "covered", "lowest", "highest", "below the truth", "above"], found)


def _verdict(ours: pd.DataFrame) -> str:
    low, high = WANTED
    outside = ours[~ours.covered.between(low, high)]
    inside = f"{len(ours) - len(outside)} of {len(ours)} cells"
    text = f"Its coverage is within {100 * low:g} to {100 * high:g} % in {inside}"
    if outside.empty:
        return text + "."
    cells = [
        f"house `{row.house}`, epsilon {row.epsilon:g}, {row.size} pairs: {100 * row.covered:.1f} %"
        for row in outside.itertuples(index=False, name="Cell")
    ]
    return f"{text}. The others:\n\n" + "\n".join(f"- {cell}" for cell in cells)


def _cells(ours: pd.DataFrame, sizes: Sequence[int]) -> str:
    found = []
    for (house, epsilon), group in ours.groupby(["house", "epsilon"], sort=False):
        first = group.iloc[0]
        row = [house, f"{epsilon:g}", f"{first.truth:.3f}", f"{first.harmless:.0%}"]
        row += [_covered(one) for one in group.itertuples()]
        found.append([*row, f"{first.open:.0%}"])
    return table(["house", "epsilon", "damage left", "harmless", *(f"{size} pairs" for size in sizes), "open"], found)


def _houses(rows: pd.DataFrame) -> str:
    found = []
    for (epsilon, houses), group in rows.groupby(["epsilon", "houses"], sort=False):
        found.append([f"{epsilon:g}", str(houses), *(_covered(one) for one in group.itertuples())])
    return table(["epsilon", "houses", *rows.quantity.unique()], found)


def _covered(row: Any) -> str:
    return f"{100 * row.covered:.1f} ({100 * row.too_low:.1f}, {100 * row.too_high:.1f})"


def _series(numbers: Sequence[int]) -> str:
    return f"{', '.join(map(str, numbers[:-1]))} and {numbers[-1]}"

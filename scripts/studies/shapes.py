"""What caregivers leave in the physical house and in the grid, by the shape of the house.

The episodes in the house are those of a finished run of `caregiver-mj evaluate --world house`; the same are run in the
grid. Houses drawn by hand are a shape of their own.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import intervals, two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.plans.hazards import KINDS
from caregiver_mj.plans.sets import houses_named
from caregiver_mj.plans.shapes import SHAPES
from study import Page, Parser, read_run, run_episodes

COUNTS = ("strikes", "strikes_surface", "candles_dropped")
PARTS = "interventions", "interventions_done", "moves_blocked_stairwell", "moves_blocked_free", "toys_reached"


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add_file("run", "a finished run in the house", "DIR", required=True)
    parser.add_jobs()


def run(options: argparse.Namespace) -> Page:
    """Run the same episodes in the grid; return the page."""
    houses, settings = read_run(options.run)
    if settings.world != "house" or "none" not in settings.caregivers:
        raise CaregiverError(f"'{options.run}' must hold a run in the house with 'none' among its caregivers")
    grid = run_episodes(dataclasses.replace(settings, world="grid"), options.jobs)
    cells = pd.read_parquet(options.run / "houses.parquet")
    return page(houses, grid, cells[cells.caregiver != "none"], settings)


def _shape_of(name: str) -> str:
    """The shape of a generated house, such as `hall` of `hall-17`; else "home" or "house"."""
    shape = name.rpartition("-")[0]
    if shape in SHAPES:
        return shape
    return "home" if name.startswith("home-") else "house"


def page(house: pd.DataFrame, grid: pd.DataFrame, cells: pd.DataFrame, settings: Settings) -> Page:
    """Return the page of the same episodes in both worlds."""
    drawn = {plan.name for plan in houses_named(["drawn-10"])}
    of_shape = {name: "drawn by hand" if name in drawn else _shape_of(name) for name in dict.fromkeys(house.house)}
    groups = {where: [name for name in of_shape if of_shape[name] == where] for where in of_shape.values()}
    caregivers = [name for name in settings.caregivers if name != "none"]
    lines = [
        _line(where, parts, caregiver, house, grid)
        for where, parts in {**{where: [names] for where, names in groups.items()}, "all": [*groups.values()]}.items()
        for caregiver in caregivers
    ]
    harmed = cells[cells.harm_verdict == "more"]
    values = {
        "settings": settings,
        "lines": lines,
        "parts": [
            (part, [table[table.caregiver == name][part].mean() for name in caregivers for table in (grid, house)])
            for part in (*(f"damage_{kind.name}" for kind in KINDS), *PARTS)
        ],
        "caregivers": caregivers,
        "counts": {name: int(house.loc[house.caregiver != "none", name].sum()) for name in COUNTS},
        "with_robot": int((house.caregiver != "none").sum()),
        "alike": _alike(house, grid),
        "cells": {name: int((cells.caregiver == name).sum()) for name in caregivers},
        "harm": {name: [*harmed.house[harmed.caregiver == name]] for name in caregivers},
    }
    return Page(values)


def _line(
    where: str, groups: Sequence[Sequence[str]], caregiver: str, house: pd.DataFrame, grid: pd.DataFrame
) -> dict[str, Any]:
    """Return what a caregiver leaves in some houses, in groups of one shape each, in both worlds."""
    names = [name for group in groups for name in group]
    alone = house[house.house.isin(names) & (house.caregiver == "none")].damage.mean()
    ours, theirs = ([_damage(table, name, caregiver) for name in names] for table in (house, grid))
    means = [sum(found.mean() for found in damage) / len(names) for damage in (theirs, ours)]
    return {
        "shape": where,
        "houses": len(names),
        "caregiver": caregiver,
        "alone": alone,
        "means": means,
        "ratio": of_ratio(ours, theirs, [len(group) for group in groups]),
    }


def of_ratio(ours: Sequence[np.ndarray], theirs: Sequence[np.ndarray], sizes: Sequence[int]) -> Estimate[float]:
    """Return the ratio of the means over houses, an array of episodes each, of so many houses of every shape, in turn.

    Its interval is over the episodes of a single house, over houses within their shapes if there are several of each of
    several shapes, else over houses.
    """
    if len(ours) == 1:
        return intervals.of_ratio(ours[0], theirs[0])
    if len(sizes) == 1 or min(sizes) == 1:
        return two_level.of_ratio(ours, theirs)
    return of_stratified_ratio(two_level.house_means(ours), two_level.house_means(theirs), sizes)


def of_stratified_ratio(ours: np.ndarray, theirs: np.ndarray, sizes: Sequence[int]) -> Estimate[float]:
    """Return the ratio of two means, (n,) each, of a sample with a fixed number of houses of every shape, in turn.

    What differs from shape to shape is no chance: the combined ratio estimate with its linearised variance (Cochran,
    Sampling Techniques, 1977, section 6.11), and Student's t. There must be two houses of each shape, or more.
    """
    ratio = ours.sum() / theirs.sum() if theirs.any() else np.nan
    each = np.split(ours - ratio * theirs, np.cumsum(sizes)[:-1])
    variance = sum(len(errors) * errors.var(ddof=1) for errors in each)
    reach = stats.t.ppf(0.5 + intervals.CONFIDENCE / 2, len(ours) - len(sizes)) * np.sqrt(variance) / theirs.sum()
    return Estimate(ratio, max(0.0, ratio - reach), ratio + reach)


def _damage(table: pd.DataFrame, house: str, caregiver: str) -> Any:
    """Return the mean damage over the children of every episode in a house, (episodes,)."""
    own = table[(table.house == house) & (table.caregiver == caregiver)]
    return own.groupby("episode").damage.mean().to_numpy()


def _alike(house: pd.DataFrame, grid: pd.DataFrame) -> tuple[int, int]:
    """Return how many episodes alone have the same damage in both worlds, and of how many."""
    keys = ["house", "family", "episode"]
    both = house[house.caregiver == "none"].merge(grid[grid.caregiver == "none"], on=keys, suffixes=("", "_grid"))
    return int((both.damage == both.damage_grid).sum()), len(both)

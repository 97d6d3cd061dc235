"""Two children at once: what a caregiver leaves of the damage, and whether P(safe) helps it to choose between them.

With one child the factor 1 - P(safe) of equation (2) cancels. With two it says whom to attend to. So the rule is set
against itself without the factor, and either way with the sum of the dangers to both children and with the greatest,
in the same episodes.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from caregiver_mj.children.family import Family
from caregiver_mj.experiments.intervals import of_difference, of_ratio
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.plans.floor_plan import FloorPlan
from studies.ablations import where
from study import Page, Parser, run_episodes

EPISODES = {"grid": 2000, "house": 20}
FAMILIES = ("1,0.25", "0.5,0.5")
# The rule, then the same without the factor; the first pair adds the dangers up, the second takes the greatest.
PAIRS = (("paper", "paper-alike"), ("paper-max", "paper-max-alike"))
CAREGIVERS = {  # an episode in the house takes as long as a thousand in the grid: there the rule alone
    "grid": ("none", *(name for pair in PAIRS for name in pair), "nearest"),
    "house": ("none", *PAIRS[0]),
}
# Further columns, and their digits.
MEANS = {"toys_reached": 1, "moves_blocked": 1, "interventions_done": 1, "strikes": 2, "candles_dropped": 2}


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("house", ["paper", "apartment"], "floor plans")
    parser.add("world", ["grid", "house"], choices=["grid", "house"])
    parser.add("episodes", None, "in each world (default: 2000 in the grid, 20 in the house)", type=int)
    parser.add_jobs()


def run(options: argparse.Namespace) -> Page:
    """Run the episodes; return the page."""
    episodes = {world: options.episodes or count for world, count in EPISODES.items()}
    return page(rows(measure(options.house, options.world, episodes, options.jobs)))


def page(found: list[dict[str, Any]]) -> Page:
    """The page of some `rows`."""
    (summed, _), (greatest, _) = PAIRS
    at = {(row["world"], row["house"], row["family"], row["caregiver"]): row for row in found}
    factors = [
        row | {"greatest": at.get((*place, greatest), {}).get("factor")}
        for (*place, caregiver), row in at.items()
        if caregiver == summed
    ]
    counts = dict.fromkeys((row["world"], row["episodes"]) for row in found)
    values = {"rows": found, "factors": factors, "counts": list(counts), "means": MEANS}
    return Page(values, {"several_children.svg": draw(found)})


def measure(houses: list[str], worlds: list[str], episodes: dict[str, int], jobs: int) -> pd.DataFrame:
    """Run everything: a row an episode, as in `episodes.parquet`."""
    tables, families = [], tuple(map(Family.parse, FAMILIES))
    for world in worlds:
        for house in houses:
            asked = {where(name): name for name in CAREGIVERS[world]}
            settings = Settings(FloorPlan.load(house), world, tuple(asked), families, episodes[world])
            tables.append(run_episodes(settings, jobs).replace({"caregiver": asked}))
    return pd.concat(tables, ignore_index=True)


def rows(episodes: pd.DataFrame) -> list[dict[str, Any]]:
    """For each world, house and family what every caregiver leaves, and what the factor 1 - P(safe) changes."""
    found, without = [], dict(PAIRS)
    for (world, house, family), group in episodes.groupby(["world", "house", "family"], sort=False):
        by = {name: part.sort_values("episode") for name, part in group.groupby("caregiver")}
        damage = {name: part.damage.to_numpy() for name, part in by.items()}
        for name in CAREGIVERS[world]:
            row = {"world": world, "house": house, "family": family, "caregiver": name, "episodes": len(by[name])}
            row |= by[name][["damage", *MEANS]].mean().to_dict()
            row["by_child"] = np.array(by[name].damage_by_child.tolist()).mean(axis=0).tolist()
            row["left"] = of_ratio(damage[name], damage["none"])
            if name in without:
                row["factor"] = of_difference(damage[name], damage[without[name]])
            found.append(row)
    return found


def draw(found: list[dict[str, Any]]) -> Figure:
    """Damage left by each caregiver: a panel for each world and house, a group of bars for each family."""
    panels = list(dict.fromkeys((row["world"], row["house"]) for row in found))
    names = [name for name in CAREGIVERS["grid"] if name != "none"]
    figure = Figure(figsize=(4.2 * len(panels), 3.6), layout="constrained")
    grid = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for axes, (world, house) in zip(grid, panels, strict=True):
        for i, name in enumerate(names):
            part = [r for r in found if (r["world"], r["house"], r["caregiver"]) == (world, house, name)]
            if not part:
                continue
            left, low, high = np.array([row["left"] for row in part]).T
            place = np.arange(len(part)) + (i - (len(names) - 1) / 2) * 0.16
            ends = [left - low, high - left]
            axes.bar(place, left, 0.15, label=name, color=f"C{i}", yerr=ends, error_kw={"linewidth": 0.8})
        axes.set_xticks(range(len(FAMILIES)), [f"epsilon {family.replace(',', ' and ')}" for family in FAMILIES])
        axes.set_title(f"{world} '{house}'", fontsize=10)
        axes.spines[["top", "right"]].set_visible(False)
    figure.axes[0].set_ylabel("share of the damage that is left")
    figure.axes[0].legend(fontsize=8, frameon=False, ncols=2)
    figure.axes[0].set_ylim(top=1.0)
    return figure

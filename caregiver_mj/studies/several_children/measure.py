"""Runs the episodes, and says what each caregiver leaves of the damage in them."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pandas as pd
from rich.console import Console
from rich.progress import Progress

from caregiver_mj.children.family import Family
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.intervals import of_difference, of_ratio
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.plans.floor_plan import FloorPlan

FAMILIES = ("1,0.25", "0.5,0.5")
# The rule, then the same without the factor; the first pair adds the dangers up, the second takes the greatest.
PAIRS = (("paper", "paper-alike"), ("paper-max", "paper-max-alike"))
CAREGIVERS = {  # an episode in the house takes as long as a thousand in the grid: there the rule alone
    "grid": ("none", *(name for pair in PAIRS for name in pair), "nearest"),
    "house": ("none", *PAIRS[0]),
}
# Further columns, and their digits.
MEANS = {"toys_reached": 1, "moves_blocked": 1, "interventions_done": 1, "strikes": 2, "candles_dropped": 2}


def run(houses: list[str], worlds: list[str], episodes: dict[str, int], jobs: int) -> pd.DataFrame:
    """Runs everything: a row an episode, as in `episodes.parquet`."""
    tables = []
    with Progress(console=Console(stderr=True)) as bar:
        for world in worlds:
            for house in houses:
                families = tuple(map(Family.parse, FAMILIES))
                caregivers = CAREGIVERS[world]
                settings = Settings(FloorPlan.load(house), world, caregivers, families, episodes[world])
                task = bar.add_task(f"{world} {house}", total=len(caregivers) * len(families) * episodes[world])
                found = evaluate(settings, jobs=jobs, progress=functools.partial(bar.advance, task))
                tables.append(found.episodes)
    return pd.concat(tables, ignore_index=True)


def rows(episodes: pd.DataFrame) -> list[dict[str, Any]]:
    """For each world, house and family what every caregiver leaves, and what the factor 1 - P(safe) changes."""
    found = []
    for (world, house, family), group in episodes.groupby(["world", "house", "family"], sort=False):
        by = {name: part.set_index("episode").sort_index() for name, part in group.groupby("caregiver")}
        alone = by["none"]
        without = dict(PAIRS)
        for name in CAREGIVERS[world]:
            part = by[name]
            each = np.array(part.damage_by_child.tolist())
            row = {"world": world, "house": house, "family": family, "caregiver": name, "episodes": len(part)}
            row["damage"] = float(part.damage.mean())
            row["by_child"] = each.mean(axis=0).tolist()
            row["left"] = of_ratio(part.damage.to_numpy(), alone.damage.to_numpy())
            row |= {column: float(part[column].mean()) for column in MEANS}
            if name in without:
                row["factor"] = of_difference(part.damage.to_numpy(), by[without[name]].damage.to_numpy())
            found.append(row)
    return found

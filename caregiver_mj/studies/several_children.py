"""Two children at once: what a caregiver leaves of the damage, and whether P(safe) helps it to choose between them.

With one child the factor 1 - P(safe) of equation (2) cancels. With two it says whom to attend to. So the rule is set
against itself without the factor, and either way with the sum of the dangers to both children and with the greatest,
in the same episodes.
"""

from __future__ import annotations

import argparse
import pathlib
import textwrap
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import Progress

from caregiver_mj.children.family import Family
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.statistics import mean_interval, ratio_interval
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz import figures

FAMILIES = ("1,0.25", "0.5,0.5")
# The rule, then the same without the factor; the first pair adds the dangers up, the second takes the greatest.
PAIRS = (("paper", "paper-alike"), ("paper-max", "paper-max-alike"))
CAREGIVERS = ("none", *(name for pair in PAIRS for name in pair), "nearest")
_MEANS = {"toys_reached": 1, "moves_blocked": 1, "strikes": 2}  # further columns, and their digits
EPISODES = {"grid": 2000, "house": 20}


def run(houses: list[str], worlds: list[str], episodes: dict[str, int], jobs: int) -> pd.DataFrame:
    """Runs everything: a row an episode, as in `episodes.parquet`."""
    tables = []
    with Progress(console=Console(stderr=True)) as bar:
        for world in worlds:
            for house in houses:
                families = tuple(map(Family.parse, FAMILIES))
                settings = Settings(FloorPlan.load(house), world, CAREGIVERS, families, episodes[world])
                task = bar.add_task(f"{world} {house}", total=len(CAREGIVERS) * len(families) * episodes[world])
                found = evaluate(settings, jobs=jobs, progress=lambda done, task=task: bar.advance(task, done))
                tables.append(found.episodes)
    return pd.concat(tables, ignore_index=True)


def rows(episodes: pd.DataFrame) -> list[dict[str, Any]]:
    """For each world, house and family what every caregiver leaves, and what the factor 1 - P(safe) changes."""
    found = []
    for (world, house, family), group in episodes.groupby(["world", "house", "family"], sort=False):
        by = {name: part.set_index("episode").sort_index() for name, part in group.groupby("caregiver")}
        alone = by["none"]
        without = dict(PAIRS)
        for name in CAREGIVERS:
            part = by[name]
            each = np.array(part.damage_by_child.tolist())
            row = {"world": world, "house": house, "family": family, "caregiver": name, "episodes": len(part)}
            row["damage"] = float(part.damage.mean())
            row["by_child"] = each.mean(axis=0).tolist()
            row["left"] = ratio_interval(part.damage.to_numpy(float), alone.damage.to_numpy(float))
            row |= {column: float(part[column].mean()) for column in _MEANS}
            if name in without:
                difference = (part.damage - by[without[name]].damage).to_numpy(float)[:, None]
                low, high = mean_interval(difference)
                row["factor"] = float(difference.mean()), float(low[0]), float(high[0])
            found.append(row)
    return found


# -- The document ------------------------------------------------------------------------------------


def document(found: list[dict[str, Any]], command: str) -> str:
    """The text of docs/several_children.md."""
    parts = [
        "# Two children\n",
        _fill(
            "One careless child and one careful one (epsilon 1 and 0.25), or two alike (0.5 and 0.5). Damage is summed "
            "over both. `paper` adds up, over the children, the expected danger of equation (2); `paper-max` takes the "
            "greatest. `paper-alike` and `paper-max-alike` are the same without the factor 1 - P(safe), so that both "
            "children count alike. All of this page is printed by"
        ),
        f"    {command}\n",
        "## Whether P(safe) helps\n",
        _fill(
            "Damage with the factor less damage without it, in the same episodes, with its 95 % interval: below 0 the "
            "factor helps."
        ),
        "| world | house | children | sum over children | greatest of them | verdict on the sum |",
        "|---|---|---|---|---|---|",
    ]
    keys = dict.fromkeys((row["world"], row["house"], row["family"]) for row in found)
    at = {(row["world"], row["house"], row["family"], row["caregiver"]): row for row in found}
    for key in keys:
        cells = [_interval(at[*key, ours]["factor"], 2, "+") for ours, _ in PAIRS]
        parts.append(f"| {' | '.join(key)} | {' | '.join(cells)} | {verdict(at[*key, PAIRS[0][0]]['factor'])} |")
    parts += ["", "![Damage left of two children](several_children.svg)\n", "## All figures\n"]
    parts.append("| world | house | children | caregiver | damage | of each child | left | toys | blocked | strikes |")
    parts.append("|---|---|---|---|---|---|---|---|---|---|")
    for row in found:
        each = " + ".join(f"{damage:.1f}" for damage in row["by_child"])
        figures_of = (f"{row[column]:.{digits}f}" for column, digits in _MEANS.items())
        what = (row["world"], row["house"], row["family"], f"`{row['caregiver']}`", f"{row['damage']:.1f}", each)
        parts.append(f"| {' | '.join((*what, _interval(row['left'], 2), *figures_of))} |")
    counts = dict.fromkeys((row["world"], row["episodes"]) for row in found)
    told = ", ".join(f"{episodes} episodes in the {world}" for world, episodes in counts)
    parts.append("\n" + _fill(f"Means of {told}; left: damage over that of `none`, with its 95 % interval."))
    return "\n".join(parts) + "\n"


def verdict(factor: tuple[float, float, float]) -> str:
    """What an interval of the difference says."""
    _, low, high = factor
    return "helps" if high < 0 else "harms" if low > 0 else "no difference seen"


def draw(found: list[dict[str, Any]]) -> Figure:
    """Damage left by each caregiver: a panel for each world and house, a group of bars for each family."""
    panels = list(dict.fromkeys((row["world"], row["house"]) for row in found))
    names = [name for name in CAREGIVERS if name != "none"]
    figure = Figure(figsize=(4.2 * len(panels), 3.6), layout="constrained")
    for axes, (world, house) in zip(
        figure.subplots(1, len(panels), sharey=True, squeeze=False)[0], panels, strict=True
    ):
        for i, name in enumerate(names):
            part = [r for r in found if (r["world"], r["house"], r["caregiver"]) == (world, house, name)]
            left, low, high = np.array([row["left"] for row in part]).T
            place = np.arange(len(part)) + (i - (len(names) - 1) / 2) * 0.16
            axes.bar(place, left, 0.15, label=name, yerr=[left - low, high - left], error_kw={"linewidth": 0.8})
        axes.set_xticks(range(len(FAMILIES)), [f"epsilon {family.replace(',', ' and ')}" for family in FAMILIES])
        axes.set_title(f"{world} '{house}'", fontsize=10)
        axes.spines[["top", "right"]].set_visible(False)
    figure.axes[0].set_ylabel("share of the damage that is left")
    figure.axes[-1].legend(fontsize=8, frameon=False)
    return figure


def _interval(values: tuple[float, float, float], digits: int, sign: str = "") -> str:
    mean, low, high = (f"{value:{sign}.{digits}f}" for value in values)
    return f"{mean} ({low} to {high})"


def _fill(text: str) -> str:
    return textwrap.fill(text, 120) + "\n"


def main() -> None:
    """Runs the study and prints, or writes, its document."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--house", nargs="+", default=["paper", "apartment"], help="(default: paper apartment)")
    parser.add_argument("--world", nargs="+", default=["grid", "house"], choices=["grid", "house"])
    parser.add_argument("--episodes", type=int, help="in each world (default: 2000 in the grid, 20 in the house)")
    parser.add_argument("--jobs", type=int, default=2, help="worker processes (default: 2)")
    parser.add_argument("--docs", type=pathlib.Path, metavar="DIR", help="write the page and its figure there")
    options = parser.parse_args()
    episodes = {world: options.episodes or count for world, count in EPISODES.items()}
    found = rows(run(options.house, options.world, episodes, options.jobs))
    command = "scripts/several_children.py --docs docs" + (
        f" --episodes {options.episodes}" if options.episodes else ""
    )
    text = document(found, command)
    print(text)
    if options.docs:
        options.docs.mkdir(parents=True, exist_ok=True)
        (options.docs / "several_children.md").write_text(text, encoding="utf-8")
        (options.docs / "several_children.svg").write_bytes(figures.as_bytes(draw(found), "svg"))


if __name__ == "__main__":
    main()

"""The study's command."""

from __future__ import annotations

import argparse
import dataclasses
import pathlib
from collections.abc import Sequence
from typing import Any

import pandas as pd
from rich.console import Console
from rich.progress import track

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import house_set
from caregiver_mj.studies import coverage
from caregiver_mj.studies.coverage.figure import draw
from caregiver_mj.studies.coverage.page import page
from caregiver_mj.studies.coverage.pools import run_pool
from caregiver_mj.studies.coverage.samples import cover_houses, cover_means, cover_ratio
from caregiver_mj.studies.documents import write_page


@dataclasses.dataclass(frozen=True)
class Coverage:
    """What is simulated.

    Attributes:
        houses: Names of floor plans.
        samples: Samples for each house, epsilon and size.
        episodes: Pairs of episodes in a house to draw them from.
        sizes: Episodes in a sample.
        epsilons: Shares of random moves.
        house_samples: Samples over houses for each epsilon and number of houses.
        house_set: Name of the houses to draw them from.
        house_sizes: Houses in a sample.
        in_house: Episodes in each house of a sample; there are 20 times as many to draw from.
        house_epsilons: Shares of random moves over houses.
        seed: Seed of everything.
    """

    houses: tuple[str, ...] = ("paper", "apartment", "house-100002", "house-100006")
    samples: int = 4000
    episodes: int = 5000
    sizes: tuple[int, ...] = (20, 50, 200)
    epsilons: tuple[float, ...] = (1.0, 0.75, 0.5, 0.25, 0.05)
    house_samples: int = 500
    house_set: str = "train-40"
    house_sizes: tuple[int, ...] = (10, 50)
    in_house: int = 20
    house_epsilons: tuple[float, ...] = (1.0, 0.5, 0.05)
    seed: int = 0

    def in_houses(self) -> pd.DataFrame:
        """Coverage over episodes, in a house."""
        rows: list[dict[str, Any]] = []
        plans = [FloorPlan.load(name) for name in self.houses]
        cells = [(i, plan, epsilon) for i, plan in enumerate(plans) for epsilon in self.epsilons]
        for i, plan, epsilon in _track(cells, "episodes"):
            pool = run_pool(plan, epsilon, self.episodes, self.seed)
            for size in self.sizes:
                seed = (self.seed, i, round(100 * epsilon), size)
                found = cover_ratio(pool, size, self.samples, (*seed, 0))
                found += cover_means(pool, size, self.samples // 4, (*seed, 1))
                cell = {"house": plan.name, "epsilon": epsilon, "size": size}
                rows += [cell | {"truth": pool.ratio, "harmless": pool.harmless} | row for row in found]
        return pd.DataFrame(rows)

    def over_houses(self) -> pd.DataFrame:
        """Coverage over houses, without those in which a child alone is never hurt."""
        rows: list[dict[str, Any]] = []
        houses = house_set(self.house_set)
        for epsilon in _track(self.house_epsilons, "houses"):
            runs = 20 * self.in_house
            pools = [run_pool(plan, epsilon, runs, self.seed + runs * i) for i, plan in enumerate(houses)]
            pools = [pool for pool in pools if pool.theirs.any()]
            for size in self.house_sizes:
                seed = (self.seed, round(100 * epsilon), size)
                found = cover_houses(pools, size, self.in_house, self.house_samples, seed)
                rows += [{"epsilon": epsilon, "pools": len(pools)} | row for row in found]
        return pd.DataFrame(rows)


def _track(cells: Any, what: str) -> Any:
    return track(cells, what, console=Console(stderr=True))


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the study and prints, or writes, its page."""
    default = Coverage()
    parser = argparse.ArgumentParser(description=coverage.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=default.samples, help="samples a cell (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=default.seed, help="seed of everything (default: %(default)s)")
    parser.add_argument("--docs", type=pathlib.Path, metavar="DIR", help="write the page and its figure there")
    options = parser.parse_args(arguments)
    study = dataclasses.replace(default, samples=options.samples, seed=options.seed)
    command = "scripts/coverage.py"
    for name in ("samples", "seed"):
        if getattr(study, name) != getattr(default, name):
            command += f" --{name} {getattr(study, name)}"
    episodes, houses = study.in_houses(), study.over_houses()
    text = page(study, episodes, houses, f"{command} --docs docs")
    print(text, end="")
    if options.docs:
        write_page(options.docs, "coverage", text, draw(episodes), ("png",))

"""How often 95 % intervals cover the truth: prints docs/coverage.md; with --docs writes it and its figure.

Samples are drawn, again and again, from so many episodes of the grid world that their mean may pass for the truth.
"""

from __future__ import annotations

import argparse
import dataclasses
import pathlib
from collections.abc import Sequence
from typing import Any

import pandas as pd
from rich.console import Console
from rich.progress import track

from caregiver_mj.studies import coverage_figure, coverage_page
from caregiver_mj.studies.coverage_pools import EPSILONS, plans, rearranged, run_pool
from caregiver_mj.studies.coverage_samples import cover_houses, cover_means, cover_ratio


@dataclasses.dataclass(frozen=True)
class Coverage:
    """What is simulated.

    Attributes:
        samples: Samples for each house, epsilon and size.
        episodes: Pairs of episodes in a house to draw them from.
        sizes: Episodes in a sample.
        epsilons: Shares of random moves.
        house_samples: Samples over houses for each epsilon and number of houses.
        house_count: Houses to draw them from.
        house_sizes: Houses in a sample.
        in_house: Episodes in each house of a sample; there are 20 times as many to draw from.
        house_epsilons: Shares of random moves over houses.
        seed: Seed of everything.
    """

    samples: int = 4000
    episodes: int = 5000
    sizes: tuple[int, ...] = (20, 50, 200)
    epsilons: tuple[float, ...] = EPSILONS
    house_samples: int = 500
    house_count: int = 40
    house_sizes: tuple[int, ...] = (10, 50)
    in_house: int = 20
    house_epsilons: tuple[float, ...] = (1.0, 0.5, 0.05)
    seed: int = 0

    def in_houses(self) -> pd.DataFrame:
        """Coverage over episodes, in four houses."""
        rows: list[dict[str, Any]] = []
        cells = [(i, plan, epsilon) for i, plan in enumerate(plans()) for epsilon in self.epsilons]
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
        houses = list(rearranged(self.house_count, self.seed))
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
    """The command; arguments are those of the process if not given."""
    default = Coverage()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=default.samples, help="samples a cell (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=default.seed, help="seed of everything (default: %(default)s)")
    parser.add_argument("--docs", type=pathlib.Path, metavar="DIR", help="also write the page and its figure there")
    options = parser.parse_args(arguments)
    study = dataclasses.replace(default, samples=options.samples, seed=options.seed)
    command = "python scripts/coverage.py"
    for name in ("samples", "seed"):
        if getattr(study, name) != getattr(default, name):
            command += f" --{name} {getattr(study, name)}"
    episodes, houses = study.in_houses(), study.over_houses()
    text = coverage_page.page(study, episodes, houses, f"{command} --docs docs")
    print(text, end="")
    if options.docs:
        (options.docs / "coverage.md").write_text(text, encoding="utf-8")
        coverage_figure.draw(episodes).savefig(options.docs / "coverage.png", dpi=160)

"""What injures at home: damage weights from injury statistics, and what caregivers leave in homes with all kinds of it.

The main table is that of a finished run of `caregiver-mj evaluate --world grid`, in homes. In the same houses
caregivers that never close a gate say what that is worth, and in the first of them other damage weights say whether the
ranking of the caregivers depends on these.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
from typing import NamedTuple

import numpy as np
import pandas as pd

from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.caregivers.foresight.value_table import candles_at_a_time
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.interventions.verb import Interventions
from caregiver_mj.plans.hazards import BATTERY, CANDLE, GATE, MUG, STAIRWELL, DamageWeights, HazardKind
from caregiver_mj.plans.sets import houses_named
from study import Page, Parser, damage_sums, read_run, run_all


class Source(NamedTuple):
    """Where the damage of a kind comes from.

    Attributes:
        kind: Its name.
        injury: Of whom the share is.
        admitted: Share of those treated that are admitted to a hospital, or not released, percent.
        source: Of that.
    """

    kind: str
    injury: str
    admitted: float
    source: str


SOURCES = (
    Source(STAIRWELL.name, "falls on stairs, under 5, US", 2.7, "Zielinski et al., Pediatrics 2012"),
    Source(
        CANDLE.name, "burns other than scalds, under 18, US", 4.0, "Mitchell et al., Clin Pediatr 2020, split by scalds"
    ),
    Source(MUG.name, "scalds, under 18, US", 11.4, "Mitchell et al., Clin Pediatr 2020, split by scalds"),
    Source(BATTERY.name, "swallowed objects, under 6, US", 10.3, "Orsagh-Yentis et al., Pediatrics 2019"),
)
BARE_TABLE = 0.5  # percent, assumed: the end of the scale, at which damage is 1
# What else the weights could be: with a bare table at .25 and 1 %, of stairs and candles, too, by the formula, and with
# all new kinds as light as a bare table, or twice as heavy as stairs.
SWEEP = {
    "as by default": "",
    "table at 0.25 %": "mug=5.1,battery=5",
    "table at 1 %": "mug=6.3,battery=6",
    "by the formula alone": "stairwell=3.4,gate=3.4,candle=4,mug=5.5,battery=5.4",
    "new kinds at 1": "gate=1,mug=1,battery=1",
    "new kinds at 10": "gate=10,mug=10,battery=10",
}
RANKED = ("nearest", "nearest-first", "childproof", "expected-danger", "foresight")
_NO_GATES = ("studies.homes:NoGates", "studies.homes:ForesightNoGates")


def weight(admitted: float, least: float = BARE_TABLE) -> float:
    """Return the damage of injuries by the share admitted, percent: on a line in its logarithm."""
    return 1 + (CANDLE.damage - 1) * math.log(admitted / least) / math.log(SOURCES[1].admitted / least)


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add_file("run", "a finished run in the grid, in homes", "DIR", required=True)
    parser.add("episodes", 20, "of each child in each house, of all but that run")
    parser.add("houses", 20, "of the run, the first ones, for all but that run")
    parser.add_file("out", "keep results there, and go on with them", "DIR")
    parser.add_jobs()


def run(options: argparse.Namespace) -> Page:
    """Run what is not in the run; return the page."""
    episodes, settings = read_run(options.run)
    needed = {"none", "expected-danger", "foresight", "knows-goal", "floor"}
    if settings.world != "grid" or not needed <= set(settings.caregivers):
        raise CaregiverError(f"'{options.run}' must hold a run in the grid with {', '.join(sorted(needed))}")
    houses = [plan.name for plan in settings.plans[: options.houses]]
    families = tuple(map(str, settings.families))
    jobs = [
        Job(house, "", ("none", "expected-danger", "foresight", *_NO_GATES), families, options.episodes)
        for house in houses
    ]
    jobs += [
        Job(house, weights, ("none", *RANKED), families, options.episodes)
        for weights in SWEEP.values()
        for house in houses
    ]
    found = dict(zip(jobs, run_all(damage, jobs, options.jobs, "in homes", options.out), strict=True))
    return page(episodes, pd.read_parquet(options.run / "houses.parquet"), settings, found)


class Job(NamedTuple):
    """A house to run episodes in, with several caregivers."""

    house: str
    weights: str
    caregivers: tuple[str, ...]
    families: tuple[str, ...]
    episodes: int


def damage(job: Job) -> dict[str, list[float]]:
    """Return the damage to all children in turn, by caregiver: of each episode number, added up over the families."""
    plans = houses_named([job.house], DamageWeights.of(job.weights or DamageWeights()))
    settings = Settings(plans, "grid", job.caregivers, tuple(map(ChildGroup.of, job.families)), job.episodes)
    found = evaluate(settings).episodes.groupby(["caregiver", "episode"]).damage.sum()
    return {name: found[name].tolist() for name in job.caregivers}


def page(
    episodes: pd.DataFrame, cells: pd.DataFrame, settings: Settings, found: dict[Job, dict[str, list[float]]]
) -> Page:
    """Return the page."""
    sums = {name: damage_sums(episodes[episodes.caregiver == name]) for name in settings.caregivers}
    total = {name: sum(map(np.mean, houses)) / len(houses) for name, houses in sums.items()}
    rule, ours, told = (total[name] for name in ("expected-danger", "foresight", "knows-goal"))
    ablated = _of(found, "", "studies.homes:NoGates")
    values = {
        "settings": settings,
        "sources": [(one, weight(one.admitted)) for one in SOURCES],
        "ends": {
            one.kind: [weight(one.admitted, least) for least in (BARE_TABLE / 2, 2 * BARE_TABLE)] for one in SOURCES
        },
        "default": DamageWeights(),
        "least": BARE_TABLE,
        "caregivers": [name for name in settings.caregivers if name != "none"],
        "by_family": {name: _by_family(episodes, name, settings) for name in settings.caregivers},
        "left": {name: two_level.of_ratio(houses, sums["none"]) for name, houses in sums.items()},
        "total": total,
        "closed": (rule - ours) / (rule - told),
        "too_large": sum(candles_at_a_time(plan) < min(1, len(plan.candle_tables)) for plan in settings.plans),
        "kinds": _by_kind(episodes),
        "harm": {
            name: _harm(cells[cells.caregiver == name]) for name in settings.caregivers if name not in ("none", "floor")
        },
        "gates": [
            (name, *_without(ablated, name, other))
            for name, other in zip(("expected-danger", "foresight"), _NO_GATES, strict=True)
        ],
        "sweep": [(title, *_ranking(_of(found, weights, RANKED[0]))) for title, weights in SWEEP.items()],
        "weights": SWEEP,
        "few": len(_of(found, SWEEP["table at 1 %"], RANKED[0])),
    }
    return Page(values)


class NoGates(PaperCaregiver):
    """The rule, but for gates: it never closes one."""

    def decide(self, percept: Percept) -> Interventions:
        return super().decide(_without_gates(self.plan.hazards.kinds, percept))


class ForesightNoGates(ForesightCaregiver):
    """The planner, but without gates."""

    def decide(self, percept: Percept) -> Interventions:
        return super().decide(_without_gates(self.plan.hazards.kinds, percept))


def _without_gates(kinds: tuple[HazardKind, ...], percept: Percept) -> Percept:
    barred = np.tile([kind is GATE for kind in kinds], (len(percept.caregiver_cell), 1))
    if percept.out_of_reach is not None:
        barred |= percept.out_of_reach
    return dataclasses.replace(percept, out_of_reach=barred)


def _by_family(episodes: pd.DataFrame, name: str, settings: Settings) -> list[float]:
    """Return the mean damage to each family."""
    means = episodes[episodes.caregiver == name].groupby("family").damage.mean()
    return [float(means[str(family)]) for family in settings.families]


def _by_kind(episodes: pd.DataFrame) -> dict[str, dict[str, float]]:
    """Return the mean damage of each kind, added up over the families, with each caregiver."""
    columns = [column for column in episodes if column.startswith("damage_") and column != "damage_until_stop"]
    kinds = [column for column in columns if column.removeprefix("damage_") in DamageWeights()]
    means = episodes.groupby(["caregiver", "family"])[kinds].mean().groupby(level="caregiver").sum()
    return {
        name: {kind.removeprefix("damage_"): float(value) for kind, value in row.items()}
        for name, row in means.iterrows()
    }


def _harm(cells: pd.DataFrame) -> tuple[int, int]:
    """Return in how many cells, houses and families, a caregiver is shown to do harm, and of how many."""
    return int((cells.harm_verdict == "more").sum()), len(cells)


def _of(found: dict[Job, dict[str, list[float]]], weights: str, having: str) -> list[dict[str, np.ndarray]]:
    """Return the damage in each house of the jobs with some weights and a caregiver."""
    return [
        {name: np.array(values) for name, values in result.items()}
        for job, result in found.items()
        if job.weights == weights and having in job.caregivers
    ]


def _without(houses: list[dict[str, np.ndarray]], name: str, other: str) -> tuple[float, float, Estimate[float]]:
    """Return the damage alone, that with a caregiver, and how much more it is without a verb."""
    alone, ours, less = ([house[key] for house in houses] for key in ("none", name, other))
    return float(np.mean(alone)), float(np.mean(ours)), two_level.of_difference(less, ours)


def _ranking(houses: list[dict[str, np.ndarray]]) -> tuple[dict[str, Estimate[float]], list[str]]:
    """Return what each caregiver leaves of the damage, and the caregivers from the least on."""
    left = {name: two_level.of_ratio([h[name] for h in houses], [h["none"] for h in houses]) for name in RANKED}
    return left, sorted(left, key=lambda name: left[name].value)

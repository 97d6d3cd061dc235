"""What foresight is worth, and what makes it: in the grid, on houses that nobody tuned.

Two parts. The first reads a run of `caregiver-mj evaluate` over many houses and says how much of the damage that the
rule leaves foresight removes, measured against what knowing the child would remove, and against what no caregiver can.
The second takes foresight apart: each variant lacks something, or has it otherwise. A frontier shows damage against
what the child pays for it.
"""

from __future__ import annotations

import argparse
import functools
import pathlib
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.foresight import HYSTERESIS, ForesightCaregiver
from caregiver_mj.caregivers.foresight.value_table import OBJECTIVE, Objective
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.experiments.verdicts import (
    LEVEL,
    MARGINS,
    Comparison,
    Verdict,
    compare_means,
    holm,
    judge,
    not_inferior,
    sign_flip_p,
)
from caregiver_mj.grid.world import FloorWorld, GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import house_set
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.style import INK, STYLE
from studies.ablations import RULES, where
from study import Page, Parser, read_run, rest, run_all, run_in_grid

OURS, RULE, TOLD, FLOOR = "foresight", "paper", "knows-goal", "floor"
_SHOWN = ("paper", "nearest", "paper-predictive", "foresight", "knows-goal", "clairvoyant", "floor")
COLUMNS = ("damage", "toys_reached", "moves_blocked_free", "interventions")
PRICE = "price of a denied move towards a toy (damage)"
PRICES = (0.0, 0.3, 0.75, 1.5, 3.0, 6.0)
BESIDE = ("paper", "nearest", "guard", "childproof", "knows-goal", "clairvoyant")  # on the frontier


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("run", [], "finished runs to judge foresight by", nargs="*", type=pathlib.Path, metavar="DIR")
    parser.add("houses", "train-10", "to take it apart in", metavar="SET")
    parser.add("episodes", 50, "in each house, with each novice; 0 for none")
    parser.add_file("out", "keep the variants' episodes, or take them", "DIR")
    parser.add_jobs()


def run(options: argparse.Namespace) -> Page:
    """Read the runs and run the variants; return the page."""
    runs = [read(folder) for folder in options.run]
    rows = pd.DataFrame()
    if options.episodes:
        work = [Job(plan.name, name, options.episodes) for plan in house_set(options.houses) for name in variants()]
        found = run_all(run_job, work, options.jobs, "variants", options.out)
        rows = pd.concat(map(pd.DataFrame, found), ignore_index=True)
    return page(runs, rows)


def read(folder: pathlib.Path) -> Bars:
    """The episodes of a finished run.

    Raises:
        CaregiverError: There are none, or none with foresight and without a caregiver.
    """
    rows, _ = read_run(folder)
    for name in ("none", "foresight"):
        if name not in set(rows.caregiver):
            raise CaregiverError(f"no episodes with caregiver '{name}' in {folder}")
    return Bars(folder.name, rows.replace({"caregiver": {where(name): name for name in RULES}}))


# -- What a run over many houses says of foresight; the house is the unit of chance ------------------


class Bars:
    """Episodes of a run.

    Attributes:
        name: What the run is called.
        caregivers: Their names.
        families: The children, in order of appearance.
        houses: Names of the houses.
    """

    def __init__(self, name: str, rows: pd.DataFrame):
        """Sort them: a row an episode, with the columns of `episodes.parquet`."""
        self.name, self.houses = name, sorted(rows.house.unique())
        self.caregivers, self.families = (tuple(rows[column].unique()) for column in ("caregiver", "family"))
        self._values = dict(iter(rows.sort_values(["house", "episode"]).groupby(["caregiver", "family"], sort=False)))

    def of(self, caregiver: str, family: str, column: str = "damage") -> list[np.ndarray]:
        """What was measured in each house, a list of (episodes,)."""
        rows = self._values[caregiver, family]
        return [part.to_numpy(float) for _, part in rows.groupby("house")[column]]

    def mean(self, caregiver: str, family: str) -> float:
        """Damage of an episode, the mean over houses."""
        return float(two_level.house_means(self.of(caregiver, family)).mean())

    def left(self, caregiver: str, family: str) -> Estimate[float]:
        """Share of the unassisted damage that is left, of means over houses."""
        return two_level.of_ratio(self.of(caregiver, family), self.of("none", family))

    def shares(self, caregiver: str, families: tuple[str, ...]) -> list[np.ndarray]:
        """Damage in each house, as that of several kinds of children added up, each over its unassisted mean."""
        each = [np.array(self.of(caregiver, family)) / self.mean("none", family) for family in families]
        return list(np.sum(each, axis=0) / len(families))

    def against(self, other: str, families: tuple[str, ...], caregiver: str = OURS) -> Comparison:
        """Damage less that with another caregiver, as a share of the unassisted damage."""
        return _by_houses(*(self.shares(name, families) for name in (caregiver, other)))

    def summed(self, caregiver: str) -> list[np.ndarray]:
        """Damage of an episode in each house, that of all children added up: episode i of each has the same chance."""
        return [np.sum(house, axis=0) for house in zip(*(self.of(caregiver, f) for f in self.families), strict=True)]

    def reduction(self, other: str) -> tuple[Comparison, Comparison]:
        """The summed damage less that with another caregiver; by houses, and by episodes."""
        ours, theirs = self.summed(OURS), self.summed(other)
        return _by_houses(ours, theirs), compare_means(np.concatenate(ours), np.concatenate(theirs))

    def gone(self, other: str, below: str | None = None) -> Estimate[float]:
        """The share of the summed damage with another caregiver that is gone, or of that above a third's."""
        ours, theirs = self.summed(OURS), self.summed(other)
        if below is not None:
            ours, theirs = (_less(one, self.summed(below)) for one in (ours, theirs))
        return rest(two_level.of_ratio(ours, theirs))

    def closed(self, families: tuple[str, ...]) -> Estimate[float]:
        """Share of the damage between the rule and who is told bin and epsilon that is gone."""
        rule, told, ours = (self.shares(name, families) for name in (RULE, TOLD, OURS))
        return two_level.of_ratio(_less(rule, ours), _less(rule, told))

    def removed(self, families: tuple[str, ...], caregiver: str = OURS) -> Estimate[float]:
        """Share of the damage between the rule and the floor that is gone."""
        rule, floor, ours = (self.shares(name, families) for name in (RULE, FLOOR, caregiver))
        return rest(two_level.of_ratio(_less(ours, floor), _less(rule, floor)))

    def houses_with(self, other: str, family: str, caregiver: str = OURS) -> tuple[int, int, int]:
        """In how many houses there is less damage than with another caregiver, as much, and more."""
        ours, theirs = (two_level.house_means(self.of(name, family)) for name in (caregiver, other))
        return int((ours < theirs).sum()), int((ours == theirs).sum()), int((ours > theirs).sum())

    def clear(self, other: str, family: str) -> tuple[int, int]:
        """In how many houses episodes show less damage, and more: by sign flips, at 5 % after Holm's correction."""
        gaps = np.stack(_less(self.of(OURS, family), self.of(other, family)), axis=1)  # (episodes, houses)
        shown, means = holm(np.asarray(sign_flip_p(gaps))) <= LEVEL, gaps.mean(axis=0)
        return int((shown & (means < 0)).sum()), int((shown & (means > 0)).sum())

    def toys(self, family: str) -> tuple[Estimate[float], Verdict]:
        """Toys reached over those without a caregiver, and whether that is no worse by the margin."""
        ours, alone = (self.of(name, family, "toys_reached") for name in (OURS, "none"))
        ratio = two_level.of_ratio(ours, alone)
        kept, whole = map(two_level.house_means, (ours, alone))
        return ratio, not_inferior(kept, whole, MARGINS["toys_reached"], more_is_better=True, ratio=ratio)

    def denied(self, family: str) -> tuple[float, Estimate[float]]:
        """Free moves denied in an episode, and how many more that are than with the rule."""
        ours, rule = (self.of(name, family, "moves_blocked_free") for name in (OURS, RULE))
        return float(two_level.house_means(ours).mean()), two_level.of_difference(ours, rule)


def _by_houses(ours: list[np.ndarray], theirs: list[np.ndarray]) -> Comparison:
    difference = two_level.house_means(ours) - two_level.house_means(theirs)
    return judge(two_level.of_difference(ours, theirs), difference)


def _less(ours: list[np.ndarray], theirs: list[np.ndarray]) -> list[np.ndarray]:
    return [a - b for a, b in zip(ours, theirs, strict=True)]


# -- Foresight with something changed ----------------------------------------------------------------


class UniformBelief(ForesightCaregiver):
    """Sees where the child is, but learns nothing from its moves."""

    def watch(self, percept: Percept) -> None:
        """Takes nothing in."""


Way = Callable[[FloorPlan], Caregiver] | str  # what makes the caregiver, or its name
_foresight = functools.partial(functools.partial, ForesightCaregiver)  # what makes it with some options


def _values(name: str, ours: float, others: Sequence[float]) -> dict[str, Way]:
    """Foresight as it is, and with other values of an option, or of a part of its objective."""
    options: list[dict[str, Any]] = [{name: value} for value in others if value != ours]
    if hasattr(OBJECTIVE, name):
        options = [{"objective": Objective(**one)} for one in options]
    named = (f"{value:g}" for value in others if value != ours)
    return {f"{ours:g}": OURS} | {value: _foresight(**one) for value, one in zip(named, options, strict=True)}


# By what is changed, then by how; the first of each is the caregiver as it is.
ABLATIONS: dict[str, dict[str, Way]] = {
    "belief": {
        "Bayes filter": OURS,
        "told bin and epsilon": "knows-goal",
        "uniform": UniformBelief,
        "epsilon never changes": _foresight(change=0.0),
        "epsilon changes often (.02)": _foresight(change=0.02),
    },
    "horizon (discount a timestep)": _values("discount", OBJECTIVE.discount, (0.9, 0.95, 0.97, 0.993)),
    "sweeps of value iteration": _values("sweeps", OBJECTIVE.sweeps, (10, 25, 50)),
    "hysteresis (share of the damage to come)": _values("hysteresis", HYSTERESIS, (0.0, 0.001, 0.02, 0.1)),
    PRICE: _values("price", OBJECTIVE.price, PRICES),
    "price of a denied random move (damage)": _values(
        "random_price", OBJECTIVE.random_price, (0.0, 0.1, 0.2, 0.6, 1.5)
    ),
}


def key_of(what: str, how: str) -> str:
    """Under what name `variants` has a way."""
    way = ABLATIONS[what][how]
    return way if isinstance(way, str) else f"{what}: {how}"


def variants() -> dict[str, Way]:
    """All of them by name, each once, and the other caregivers of the frontier."""
    named = {name: name for name in ("none", FLOOR, OURS, *BESIDE)}
    return named | {key_of(what, how): way for what, ways in ABLATIONS.items() for how, way in ways.items()}


def made(name: str, plan: FloorPlan) -> Caregiver | None:
    """Make the caregiver of a variant for a house; None for `none`."""
    way = variants()[name]
    return make_caregiver(way, plan) if isinstance(way, str) else way(plan)


class Job(NamedTuple):
    """All episodes with one variant in one house."""

    house: str
    variant: str
    episodes: int


def run_job(job: Job) -> dict[str, Any]:
    """Run the episodes of a job, those that `evaluate` runs with seed 0: columns of `episodes.parquet`."""
    plan = FloorPlan.load(job.house)
    make = FloorWorld if job.variant == FLOOR else functools.partial(GridWorld, caregiver=made(job.variant, plan))
    totals = run_in_grid(make, plan, EPSILONS, job.episodes).ledger.totals()
    return {
        "house": job.house,
        "caregiver": job.variant,
        "family": [f"{epsilon:g}" for epsilon in EPSILONS for _ in range(job.episodes)],
        "episode": list(range(job.episodes)) * len(EPSILONS),
        **{name: totals[name].tolist() for name in COLUMNS},
    }


def means(rows: pd.DataFrame) -> pd.DataFrame:
    """Means over episodes and houses, a row for each variant and kind of children."""
    return rows.groupby(["caregiver", "family"], sort=False)[list(COLUMNS)].mean()


# -- The page ----------------------------------------------------------------------------------------


def page(runs: Sequence[Bars], rows: pd.DataFrame) -> Page:
    """The page of runs to judge foresight by, and of what was measured with all variants, or nothing."""
    values = {
        "runs": [{"bars": bars, **_judged(bars)} for bars in runs],
        "ours": OURS,
        "rule": RULE,
        "told": TOLD,
        "floor": FLOOR,
        "margin": MARGINS["toys_reached"],
        "p": p,
        "apart": _apart(rows) if len(rows) else {},
        "families": [f"{epsilon:g}" for epsilon in EPSILONS],
        "houses": rows.house.nunique() if len(rows) else 0,
        "episodes": rows.episode.nunique() if len(rows) else 0,
    }
    return Page(values, {"foresight.svg": draw(rows)} if len(rows) else {})


def _judged(bars: Bars) -> dict[str, Any]:
    """What the page says of a run."""
    names = [name for name in _SHOWN if name in bars.caregivers]
    found: dict[str, Any] = {
        "left": [(name, [(bars.left(name, f), bars.mean(name, f)) for f in bars.families]) for name in names],
        "below": tuple(name for name in bars.families if name != "1"),
        "against": [],
    }
    if RULE in bars.caregivers and FLOOR in bars.caregivers:
        comparisons = [bars.against(RULE, (family,)) for family in bars.families]
        corrected = holm(np.array([comparison.p for comparison in comparisons]))
        found["against"] = list(zip(bars.families, comparisons, corrected, strict=True))
        found["reduction"] = bars.reduction(RULE)
        found["summed"] = {n: float(two_level.house_means(bars.summed(n)).mean()) for n in ("none", RULE, OURS)}
    return found


def _apart(rows: pd.DataFrame) -> dict[str, list[tuple[Any, ...]]]:
    """By what is changed, and how: damage left at each epsilon, beside foresight; toys, moves denied, interventions."""
    bars, alone = Bars("", rows), means(rows).xs("none", level="caregiver")
    below = [f"{epsilon:g}" for epsilon in EPSILONS[1:]]
    found: dict[str, list[tuple[Any, ...]]] = {}
    for what, ways in ABLATIONS.items():
        for how in ways:
            key = key_of(what, how)
            mean = means(rows).xs(key, level="caregiver")
            more = None if key == OURS else bars.against(OURS, tuple(below), key).estimate
            toys = mean.toys_reached[below].sum() / alone.toys_reached[below].sum()
            paid = mean.moves_blocked_free[below].mean(), mean.interventions[below].mean()
            found.setdefault(what, []).append((how, mean.damage / alone.damage, more, toys, *paid))
    return found


def p(value: float) -> str:
    """A p, or a dash where there can be none."""
    return "–" if np.isnan(value) else "< .001" if value < 0.001 else f"{value:.3f}".lstrip("0")


# -- The frontier: damage against what the child pays for less of it ---------------------------------


_BELOW = EPSILONS[1:]  # at 1 there are no toys to speak of
_PANELS = {"moves_blocked_free": "free moves denied an episode", "toys_reached": "toys kept"}


def draw(rows: pd.DataFrame) -> Figure:
    """A column of panels for each epsilon: damage left over free moves denied, and over toys kept."""
    found = means(rows)
    with mpl.rc_context(STYLE):
        figure = Figure((3.1 * len(_BELOW), 6.0), layout="constrained")
        grid = figure.subplots(len(_PANELS), len(_BELOW), squeeze=False)
        for column, epsilon in zip(grid.T, _BELOW, strict=True):
            for axes, (what, title) in zip(column, _PANELS.items(), strict=True):
                _panel(axes, found.xs(f"{epsilon:g}", level="family"), what)
                axes.set_xlabel(title)
            column[0].set_title(f"epsilon {epsilon:g}", fontsize=10)
        for row in grid:
            row[0].set_ylabel("damage left")
        handles, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8)
    return figure


def _panel(axes: Axes, found: pd.DataFrame, what: str) -> None:
    left = found.damage / found.damage["none"]
    across = found[what] / found[what]["none"] if what == "toys_reached" else found[what]
    axes.axhline(left[FLOOR], color=INK, linewidth=0.8, linestyle=":", label="floor of blocking and relocating")
    prices = sorted(ABLATIONS[PRICE], key=float)
    keys = [key_of(PRICE, price) for price in prices]
    line = colours.unit(colours.ROBOT)
    axes.plot(across[keys], left[keys], "-", color=line, linewidth=1.0, label="foresight, prices of a denied move")
    axes.plot(across[keys], left[keys], "o", color=line, markersize=3.0)
    axes.plot(across["foresight"], left["foresight"], "o", color=line, markeredgecolor=INK, label="foresight")
    palette = (colours.STAIRWELL, colours.CANDLE, colours.BIN, colours.FLAME, colours.HARM, colours.TODDLER)
    for name, colour, marker in zip(BESIDE, palette, "sD^vP*", strict=True):
        axes.plot(
            across[name], left[name], marker, color=colours.unit(colour), markeredgecolor=INK, markersize=6, label=name
        )
    if what == "toys_reached":
        axes.axvline(0.97, color=INK, linewidth=0.6, linestyle="--")

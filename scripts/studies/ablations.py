"""What each part of the rule and of `foresight` is worth: variants of them on the same episodes, in the grid.

The rules with something changed are caregivers, too: `evaluate` takes one as `--caregiver studies.ablations:Still` once
`PYTHONPATH=scripts` says where the studies are.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from caregiver_mj.caregivers.baselines import NearestCaregiver
from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver, KnowsGoalCaregiver
from caregiver_mj.caregivers.foresight.value_table import OBJECTIVE
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import HORIZON, Assessment, Percept, Prediction, bare_tables
from caregiver_mj.danger.belief import Belief
from caregiver_mj.danger.child_model import CHANGE, child_chain
from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.grid.world import CAREGIVER_ACTIONS, GridWorld
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.plans.sets import houses_named
from study import Page, Parser, damage_sums, interval, load_house, run_all, run_in_grid, side, table

NONE, RULE, FORESIGHT = "none", "the rule", "foresight"
COLUMNS = ("damage", "toys_reached", "moves_blocked_free", "interventions")
_CARELESS, _CAREFUL = 1.0, 0.05  # novices that P(safe) is to tell apart
_TIMES = (10, 50, 200)  # timesteps after which it is asked to


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("houses", ["test-5"], "houses to run in, or sets of them", metavar="SET")
    parser.add("episodes", 10, "with each family in each house")
    parser.add("epsilon", ["1", "0.5", "0.05", "1,0.25"], "children", metavar="FAMILY")
    parser.add("only", [*GROUPS], "these groups of variants", choices=GROUPS, metavar="GROUP")
    parser.add_file("out", "keep the episodes there, and go on with them", "DIR")
    parser.add_jobs()


def run(options: argparse.Namespace) -> Page:
    """Run all variants; return the page."""
    houses = [plan.name for plan in houses_named(options.houses)]
    needed = {NONE: None, **{GROUPS[group].base: None for group in options.only}}
    names = [*needed, *(f"{group}: {how}" for group in options.only for how in GROUPS[group].changed)]
    work = [Job(house, name, tuple(options.epsilon), options.episodes) for house in houses for name in names]
    rows = pd.concat(map(pd.DataFrame, run_all(run_job, work, options.jobs, "variants", options.out)))
    tells = "action prior" in options.only
    values = {
        "houses": " ".join(options.houses),
        "episodes": options.episodes,
        "tables": [variants_table(rows, group) for group in options.only],
        "shown": [line for group in options.only for line in shown_differences(rows, group)],
        "apart": apart_table(run_all(tell_apart, houses, options.jobs, "P(safe)")) if tells else "",
    }
    return Page(values)


# -- The rule with something changed -----------------------------------------------------------------


class Max(PaperCaregiver):
    """The rule with the greatest danger to any child instead of the sum over them."""

    def urgency(self, unsafe: np.ndarray, reach: np.ndarray) -> np.ndarray:
        return (unsafe[..., None] * reach * self.plan.hazards.damage).max(axis=1)


class Alike(PaperCaregiver):
    """The rule without the factor 1 - P(safe): all children count alike, however they behave."""

    def urgency(self, unsafe: np.ndarray, reach: np.ndarray) -> np.ndarray:
        return super().urgency(np.ones_like(unsafe), reach)


class MaxAlike(Alike, Max):
    """The rule without the factor, with the greatest danger to any child."""


class Still(PaperCaregiver):
    """The rule without making room: where a child bars its way, or there is nothing to do, it stays where it is.

    The paper says nothing about how its caregiver yields to the child. That it does is ours, and this is without it.
    """

    yields = False


class Predictive(PaperCaregiver):
    """The rule, equation (2), in which P(reach) is the probability that the child runs into the hazard soon.

    Soon is within `horizon` timesteps.

    That follows from where it is and from what its moves have told of its toy bin and its epsilon. P(safe), and with it
    what tells between several children, is the paper's.
    """

    def __init__(self, plan: FloorPlan, seed: int = 0, *, horizon: int = HORIZON):
        self._horizon = horizon
        super().__init__(plan, seed)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        super().reset(batch, seeds, children)
        self.belief = Belief(child_chain(self.plan), batch, children, CHANGE)

    def watch(self, percept: Percept) -> None:
        super().watch(percept)
        self.belief.watch(percept.previous_cell, percept.previous_action, percept.caregiver_cell)

    def assess(self, percept: Percept) -> Assessment:
        return dataclasses.replace(super().assess(percept), prediction=self._predict(percept))

    def reach(self, percept: Percept) -> np.ndarray:
        return self._predict(percept).reach(self.plan, percept, self._horizon)

    def _predict(self, percept: Percept) -> Prediction:
        return Prediction(child_chain(self.plan), percept.child_cell, self.belief.probability)


class NearestTable(PaperCaregiver):
    """Takes a candle to the bare table nearest, on foot, to its own."""

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        beside = plan.graph.beside(plan.tables)
        walk = plan.graph.distances_from(beside)  # (tables, caregiver cells)
        self._between = np.array([walk[:, cells].min(axis=1) for cells in beside], float)  # (tables, tables)

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        own = percept.candle_table[np.arange(len(candle)), candle]
        bare = bare_tables(percept.candle_table, len(self.plan.tables))
        return np.where(bare, self._between[own], np.inf).argmin(axis=1)


class LeastExposedTable(PaperCaregiver):
    """Takes a candle to the bare table into which one that moves as the action prior says bumps most rarely.

    Attributes:
        exposure: How often that one bumps into each table, bumps a move, (tables,).
    """

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed, prior="mean")
        next_cell, target, index = plan.graph.moves
        cells = np.arange(len(plan.free_cells))
        chain = np.zeros((len(cells), len(cells)))
        np.add.at(chain, (cells[:, None], next_cell), self.action_prior)
        # The share of its time that it spends in each cell: p chain = p, sum(p) = 1.
        equations = np.concatenate([chain.T - np.eye(len(cells)), np.ones((1, len(cells)))])
        share = np.linalg.lstsq(equations, np.eye(len(cells) + 1)[-1], rcond=None)[0]
        self.exposure = np.zeros(len(plan.tables))
        bumps = target == Target.TABLE
        np.add.at(self.exposure, index[bumps], (share[:, None] * self.action_prior)[bumps])

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        return self._exposure_where_bare(percept).argmin(axis=1)

    def worth_protecting(self, percept: Percept) -> np.ndarray:
        least, table = self._exposure_where_bare(percept).min(axis=1), percept.candle_table
        stairwells, _, lying = self.plan.hazards.split(super().worth_protecting(percept))
        return self.plan.hazards.join(stairwells, (table != NOTHING) & (self.exposure[table] > least[:, None]), lying)

    def _exposure_where_bare(self, percept: Percept) -> np.ndarray:
        """Exposure of each bare table, infinite for others, (B, tables)."""
        return np.where(bare_tables(percept.candle_table, len(self.exposure)), self.exposure, np.inf)


class UniformBelief(ForesightCaregiver):
    """The planner that sees where the child is, but learns nothing from its moves."""

    def watch(self, percept: Percept) -> None:
        """Take nothing in."""


# -- Variants ----------------------------------------------------------------------------------------


class Variant(NamedTuple):
    """A caregiver with something changed."""

    make: Callable[..., Caregiver] = PaperCaregiver  # makes it for a house
    options: Mapping[str, Any] = {}
    actions: int = CAREGIVER_ACTIONS  # how many actions it has in a novice timestep


class Group(NamedTuple):
    """Variants of one caregiver."""

    base: str  # its name in `BASES`
    changed: Mapping[str, Variant]  # by what is changed


def _planner(**options: Any) -> Variant:
    return Variant(ForesightCaregiver, options)


def _objectives(name: str, values: Sequence[Any]) -> dict[str, Variant]:
    return {f"{value:g}": _planner(objective=dataclasses.replace(OBJECTIVE, **{name: value})) for value in values}


# What the action prior is learned from, and how.
PRIORS = {
    "Dirichlet draw, hyperprior 1, 1,000 expert timesteps": Variant(),
    "Dirichlet mean": Variant(options={"prior": "mean"}),
    "hyperprior 0.1": Variant(options={"hyperprior": 0.1}),
    "hyperprior 10": Variant(options={"hyperprior": 10.0}),
    "100 expert timesteps": Variant(options={"expert_timesteps": 100}),
    "10,000 expert timesteps": Variant(options={"expert_timesteps": 10_000}),
    "no experts": Variant(options={"expert_timesteps": 0}),
}
BASES: dict[str, Variant | None] = {NONE: None, RULE: Variant(), FORESIGHT: _planner()}
GROUPS = {
    "action prior": Group(RULE, dict([*PRIORS.items()][1:])),
    "several children": Group(
        RULE,
        {
            "without 1 - P(safe)": Variant(Alike),
            "greatest danger to a child, not the sum": Variant(Max),
            "greatest danger, without 1 - P(safe)": Variant(MaxAlike),
        },
    ),
    "rule": Group(
        RULE,
        {
            "`nearest`": Variant(NearestCaregiver),
            "P(reach) linear in distance": Variant(options={"reach": "linear"}),
            "P(reach) of the belief, within 15 timesteps": Variant(Predictive),
            "makes no room for the child": Variant(Still),
            "candle to the nearest bare table": Variant(NearestTable),
            "candle to the least exposed bare table": Variant(LeastExposedTable),
            **{f"does nothing below a danger of {at:g}": Variant(options={"threshold": at}) for at in (0.1, 0.5, 1.0)},
        },
    ),
    "actions in a timestep": Group(RULE, {str(n): Variant(actions=n) for n in (1, 2, 4, 6)}),
    "belief": Group(
        FORESIGHT,
        {
            "told bin and epsilon (`knows-goal`)": Variant(KnowsGoalCaregiver),
            "learns nothing from moves": Variant(UniformBelief),
            "the child never becomes another": _planner(change=0.0),
            "it becomes another often (.1 a timestep)": _planner(change=0.1),
        },
    ),
    "discount in a timestep": Group(FORESIGHT, _objectives("discount", (0.9, 0.993))),
    "hysteresis": Group(FORESIGHT, {f"{share:g}": _planner(hysteresis=share) for share in (0.0, 0.02)}),
    "price of a denied move to a toy": Group(FORESIGHT, _objectives("price", (0.0, 3.0))),
    "price of a denied random move": Group(FORESIGHT, _objectives("random_price", (0.0, 1.5))),
}


def variant(name: str) -> Variant | None:
    """Return the variant of a name: of `BASES`, or a group's and what is changed; None for `none`."""
    group, _, how = name.partition(": ")
    return GROUPS[group].changed[how] if how else BASES[name]


class Job(NamedTuple):
    """All episodes with one variant in one house."""

    house: str
    variant: str
    families: tuple[str, ...]
    episodes: int


def run_job(job: Job) -> dict[str, Any]:
    """Run the episodes of a job, those that `evaluate` runs with seed 0: columns of `episodes.parquet`."""
    plan, found = load_house(job.house), variant(job.variant)
    caregiver = found and found.make(plan, **found.options)
    actions = found.actions if found else CAREGIVER_ACTIONS
    make = functools.partial(GridWorld, caregiver=caregiver, caregiver_actions=actions)
    totals = [run_in_grid(make, plan, [family], job.episodes).ledger.totals() for family in job.families]
    return {
        "house": job.house,
        "variant": job.variant,
        "family": [family for family in job.families for _ in range(job.episodes)],
        "episode": [*range(job.episodes)] * len(job.families),
        **{name: np.concatenate([one[name] for one in totals]).tolist() for name in COLUMNS},
    }


def tell_apart(house: str) -> list[list[float]]:
    """Return how often a careful novice looks safer than a careless one by each of `PRIORS`, after each of `_TIMES`."""
    plan, found = load_house(house), []
    for prior in PRIORS.values():
        caregiver = prior.make(plan, **prior.options)
        safe: dict[int, np.ndarray] = {}

        def look(world: GridWorld, caregiver: Caregiver = caregiver, safe: dict[int, np.ndarray] = safe) -> None:
            caregiver.watch(world.percept())
            if world.timestep in _TIMES:
                assessment = caregiver.assess(world.percept())
                assert assessment  # the rule has one
                safe[world.timestep] = assessment.safe[:, 0]

        episodes = 50
        caregiver.reset(2 * episodes)
        run_in_grid(functools.partial(GridWorld, caregiver=None), plan, (_CARELESS, _CAREFUL), episodes, look=look)
        pairs = [(one[episodes:, None], one[:episodes]) for one in safe.values()]
        found.append([float((ours > theirs).mean() + (ours == theirs).mean() / 2) for ours, theirs in pairs])
    return found


# -- Tables ------------------------------------------------------------------------------------------


def variants_table(rows: pd.DataFrame, group: str) -> str:
    """Return the table of a group: what is left, and what the child pays for it; first the caregiver as it is."""
    by = dict(iter(rows.groupby("variant", sort=False)))
    base, alone = by[GROUPS[group].base], by[NONE]
    families, lines = rows.family.unique(), []
    for how in ("", *GROUPS[group].changed):
        ours = by[f"{group}: {how}"] if how else base
        means, without = (one.groupby("family").damage.mean() for one in (ours, alone))
        left = (f"{means[family] / without[family]:.3f}" for family in families)
        more = interval(_difference(by, group, how), sign="+") if how else ""
        same = (ours[[*COLUMNS]].to_numpy() == base[[*COLUMNS]].to_numpy()).all(axis=1).mean()
        toys = ours.toys_reached.sum() / alone.toys_reached.sum()
        paid = f"{toys:.1%}", f"{ours.moves_blocked_free.mean():.2f}", f"{ours.interventions.mean():.1f}"
        lines.append((group, how or GROUPS[group].base, *left, more, *paid, f"{same:.0%}"))
    measured = "toys kept", "free moves denied", "interventions", "episodes equal"
    return table(("group", "variant", *families, "damage, less that of the first", *measured), lines)


def shown_differences(rows: pd.DataFrame, group: str) -> list[tuple[str, str, Estimate[float]]]:
    """Return the variants of a group whose damage differs from the base's: those whose interval excludes zero."""
    by = dict(iter(rows.groupby("variant", sort=False)))
    found = ((group, how, _difference(by, group, how)) for how in GROUPS[group].changed)
    return [line for line in found if side(line[2])]


def _difference(by: Mapping[str, pd.DataFrame], group: str, how: str) -> Estimate[float]:
    """Return the damage of a variant, less that of its base, an episode of all child groups."""
    return two_level.of_difference(damage_sums(by[f"{group}: {how}"]), damage_sums(by[GROUPS[group].base]))


def apart_table(found: Sequence[list[list[float]]]) -> str:
    """Return the table of what `tell_apart` has found in each house."""
    means = np.mean(found, axis=0)
    rows = [(name, *(f"{value:.3f}" for value in line)) for name, line in zip(PRIORS, means, strict=True)]
    return table(("action prior of", *(f"after {time}" for time in _TIMES)), rows)

"""Which parts of the model matter, in the grid world: prints the tables of docs/ablations.md.

Other studies take the rule apart, too: `RULES` are the rule with something changed, which `evaluate` takes as
`--caregiver studies.ablations:Still` once `PYTHONPATH=scripts` says where the studies are.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from caregiver_mj.caregivers.foresight.child_model import CHANGE, child_chain
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import HORIZON, Assessment, Outlook, Percept, bare_tables
from caregiver_mj.children.tape import Tape
from caregiver_mj.danger.belief import Belief
from caregiver_mj.experiments.intervals import of_ratio
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.grid.world import CAREGIVER_ACTIONS, GridWorld
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from study import Parser, progress, table

# What the action prior is learned from, and how; as arguments of `PaperCaregiver`.
PRIORS: dict[str, dict[str, Any]] = {
    "Dirichlet draw, hyperprior 1, 1,000 expert timesteps (default)": {},
    "Dirichlet mean": {"prior": "mean"},
    "hyperprior 0.1": {"hyperprior": 0.1},
    "hyperprior 0.3": {"hyperprior": 0.3},
    "hyperprior 3": {"hyperprior": 3.0},
    "hyperprior 10": {"hyperprior": 10.0},
    "100 expert timesteps": {"expert_timesteps": 100},
    "300 expert timesteps": {"expert_timesteps": 300},
    "3,000 expert timesteps": {"expert_timesteps": 3000},
    "10,000 expert timesteps": {"expert_timesteps": 10_000},
}
_ACTIONS = (1, 2, 4, 5, 6)  # of the caregiver, a timestep
_FEW_EPSILONS = (1.0, 0.5, 0.05)
_THRESHOLDS = (0.0, 0.1, 0.5, 1.0)
_MIDDLE = 0.5  # the threshold at which priors are compared
_TIMES = (10, 50, 200)  # timesteps after which P(safe) is told

Figures = dict[str, np.ndarray]  # what is measured of every episode, (B,) each


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("house", "paper", "name or file of the floor plan")
    parser.add("episodes", 2000, "episodes for every variant and epsilon")
    parser.add("seed", 0, "seed of the first episode")


def run(options: argparse.Namespace) -> None:
    """Run the study and print its tables."""
    seeds = range(options.seed, options.seed + options.episodes)
    tapes = [Tape.draw_family(np.random.RandomState(seed), 1) for seed in seeds]
    study = Study(FloorPlan.load(options.house), tapes)
    print(variants_table(study, variants()), end="\n\n", flush=True)
    print(thresholds_table(study, PRIORS), end="\n\n", flush=True)
    print(safety_table(study, PRIORS))


# -- The rule with something changed -----------------------------------------------------------------


class Max(PaperCaregiver):
    """The rule with the greatest danger to any child instead of the sum over them."""

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed, over_children="max")


class Alike(PaperCaregiver):
    """The rule without the factor 1 - P(safe): all children count alike, however they behave."""

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed, weighs_safety=False)


class MaxAlike(PaperCaregiver):
    """The rule without the factor, with the greatest danger to any child."""

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed, over_children="max", weighs_safety=False)


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
        return dataclasses.replace(super().assess(percept), outlook=self._outlook(percept))

    def reach(self, percept: Percept) -> np.ndarray:
        return self._outlook(percept).reach(self.plan, percept, self._horizon)

    def _outlook(self, percept: Percept) -> Outlook:
        return Outlook(child_chain(self.plan), percept.child_cell, self.belief.probability)


RULES = {
    "paper-max": Max,
    "paper-alike": Alike,
    "paper-max-alike": MaxAlike,
    "paper-still": Still,
    "paper-predictive": Predictive,
}


def where(name: str) -> str:
    """Return what a caregiver is found by: of `RULES` where it is, as `module:object`, of others the name."""
    return f"{__name__}:{RULES[name].__name__}" if name in RULES else name


# -- Variants ----------------------------------------------------------------------------------------


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


class Variant(NamedTuple):
    """A caregiver with something changed."""

    make: Callable[..., PaperCaregiver] = PaperCaregiver  # makes it for a house
    options: Mapping[str, Any] = {}
    actions: int = CAREGIVER_ACTIONS  # how many actions it has in a novice timestep


def variants() -> dict[str, Variant]:
    """All variants by name; the first one is the default."""
    found = {name: Variant(options=options) for name, options in PRIORS.items()}
    found["P(reach) linear"] = Variant(options={"reach": "linear"})
    for actions in _ACTIONS:
        found[f"{actions} caregiver action{'s' * (actions > 1)} a timestep"] = Variant(actions=actions)
    found["candle to the nearest bare table"] = Variant(NearestTable)
    found["candle to the least exposed bare table"] = Variant(LeastExposedTable)
    return found


@dataclasses.dataclass(frozen=True)
class Study:
    """Runs variants on the same novices."""

    plan: FloorPlan  # the house
    tapes: Sequence[tuple[Tape, ...]]  # the novices' chance, the same for every variant

    def run(self, variant: Variant, epsilons: Sequence[float] = EPSILONS) -> dict[float, Figures]:
        """Run all episodes with a variant, by epsilon."""
        caregiver = variant.make(self.plan, **variant.options)
        worlds = {e: GridWorld(self.plan, e, caregiver, caregiver_actions=variant.actions) for e in epsilons}
        return {epsilon: world.run(self.tapes).totals() for epsilon, world in worlds.items()}

    @functools.cached_property
    def alone(self) -> dict[float, Figures]:
        """All episodes without a caregiver, by epsilon."""
        return {epsilon: GridWorld(self.plan, epsilon, None).run(self.tapes).totals() for epsilon in EPSILONS}

    def safety(self, epsilon: float, caregiver: PaperCaregiver, at: Sequence[int]) -> np.ndarray:
        """P(safe) of unassisted novices after some timesteps, (times, episodes)."""
        world = GridWorld(self.plan, epsilon, None)
        world.reset(self.tapes)
        caregiver.reset(len(self.tapes))
        safe = []
        for timestep in range(1, max(at) + 1):
            world.step()
            caregiver.watch(world.percept())
            if timestep in at:
                safe.append(caregiver.assess(world.percept()).safe[:, 0])
        return np.array(safe)


# -- Tables ------------------------------------------------------------------------------------------


def variants_table(study: Study, made: Mapping[str, Variant]) -> str:
    """Damage left under every variant, and whether it changes any episode at all."""
    rows, default = [], dict[float, Figures]()
    for name, variant in progress(made.items(), "variants"):
        found = study.run(variant)
        default = default or found
        same = np.mean([np.all([found[e][what] == default[e][what] for what in found[e]], axis=0) for e in EPSILONS])
        toys, toys_alone = (sum(world[e]["toys_reached"].mean() for e in EPSILONS) for world in (found, study.alone))
        begun = np.mean([found[e]["interventions"].mean() for e in EPSILONS])
        rows.append((name, *_left(study, found), f"{toys / toys_alone:.1%}", f"{begun:.1f}", f"{same:.0%}"))
    left = (f"left at {epsilon:g}" for epsilon in EPSILONS)
    return table(("variant", *left, "toys kept", "interventions", "episodes as default"), rows)


def thresholds_table(study: Study, priors: Mapping[str, dict[str, Any]]) -> str:
    """What the prior does once expected danger is compared with a threshold."""
    made = {f"threshold {threshold:g}": {"threshold": threshold} for threshold in _THRESHOLDS}
    made |= {
        f"threshold {_MIDDLE:g}, {name}": {"threshold": _MIDDLE, **priors[name]} for name in priors if priors[name]
    }
    rows = []
    for name, options in progress(made.items(), "thresholds"):
        found = study.run(Variant(options=options), _FEW_EPSILONS)
        rows.append((name, *_left(study, found), *(f"{found[e]['interventions'].mean():.1f}" for e in found)))
    return table(("variant", *(f"{what} at {e:g}" for what in ("left", "interventions") for e in _FEW_EPSILONS)), rows)


def safety_table(study: Study, priors: Mapping[str, dict[str, Any]]) -> str:
    """P(safe) of careful and careless novices, and how well it tells them apart."""
    rows = []
    careless, *_, careful = _FEW_EPSILONS
    for name, options in progress(priors.items(), "P(safe)"):
        caregiver = PaperCaregiver(study.plan, **options)
        safe = {epsilon: study.safety(epsilon, caregiver, _TIMES) for epsilon in _FEW_EPSILONS}
        means = (f"{mean:.2f}" for epsilon in safe for mean in safe[epsilon].mean(axis=1))
        # The probability that a careful novice looks safer than a careless one, whichever two one takes.
        one, other = safe[careful][0][:, None], safe[careless][0]
        apart = (one > other).mean() + (one == other).mean() / 2
        rows.append((name, *means, f"{apart:.2f}"))
    columns = (f"{epsilon:g} after {timestep}" for epsilon in _FEW_EPSILONS for timestep in _TIMES)
    return table(("prior", *columns, f"told apart after {_TIMES[0]}"), rows)


def _left(study: Study, assisted: dict[float, Figures]) -> Iterator[str]:
    """Damage left at each epsilon, with half the width of its interval."""
    for epsilon in assisted:
        ratio, low, high = of_ratio(assisted[epsilon]["damage"], study.alone[epsilon]["damage"])
        yield f"{ratio:.3f} ± {(high - low) / 2:.3f}"

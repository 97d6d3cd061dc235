"""Which parts of the model matter, in the grid world: prints the tables of docs/ablations.md."""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import NOTHING, Caregiver, Observation, PaperCaregiver
from caregiver_mj.children.novice import NoviceTape
from caregiver_mj.experiments.statistics import ratio_interval
from caregiver_mj.grid.world import CAREGIVER_ACTIONS, GridWorld, Outcome
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.floor_plan import FloorPlan

_EPSILONS = (1.0, 0.75, 0.5, 0.25, 0.05)
_PRIORS = {
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


class NearestTable(PaperCaregiver):
    """Takes a candle to the bare table nearest, on foot, to its own."""

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        beside = [[plan.cell_index[cell] for cell in plan.free_neighbours(table)] for table in plan.tables]
        walk = plan.graph.distances_from(beside)  # (tables, caregiver cells)
        self._between = np.array([walk[:, cells].min(axis=1) for cells in beside], float)  # (tables, tables)

    def safe_table(self, observation: Observation, candle: np.ndarray) -> np.ndarray:
        own = observation.candle_table[np.arange(len(candle)), candle]
        return np.where(_bare(observation, len(self.plan.tables)), self._between[own], np.inf).argmin(axis=1)


class LeastExposedTable(PaperCaregiver):
    """Takes a candle to the bare table into which one that moves as the action prior says bumps most rarely."""

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

    def safe_table(self, observation: Observation, candle: np.ndarray) -> np.ndarray:
        return np.where(_bare(observation, len(self.exposure)), self.exposure, np.inf).argmin(axis=1)

    def worth_protecting(self, observation: Observation) -> np.ndarray:
        least = np.where(_bare(observation, len(self.exposure)), self.exposure, np.inf).min(axis=1)
        table = observation.candle_table
        worth = super().worth_protecting(observation)
        worth[:, self.stairwell_count :] = (table != NOTHING) & (self.exposure[table] > least[:, None])
        return worth


def _bare(observation: Observation, tables: int) -> np.ndarray:
    """Whether a table bears no candle, (B, tables)."""
    return ~(observation.candle_table[:, :, None] == np.arange(tables)).any(axis=1)


@dataclasses.dataclass(frozen=True)
class Study:
    """Runs variants on the same novices.

    Attributes:
        plan: The house.
        tapes: The novices' chance, the same for every variant.
    """

    plan: FloorPlan
    tapes: Sequence[NoviceTape]

    def run(self, epsilon: float, caregiver: Caregiver | None, actions: int = CAREGIVER_ACTIONS) -> Outcome:
        return GridWorld(self.plan, epsilon, caregiver, caregiver_actions=actions).run(self.tapes)

    def alone(self) -> dict[float, Outcome]:
        return {epsilon: self.run(epsilon, None) for epsilon in _EPSILONS}

    def safety(self, epsilon: float, caregiver: PaperCaregiver, at: Sequence[int]) -> np.ndarray:
        """P(safe) of unassisted novices after some timesteps, (times, episodes)."""
        world = GridWorld(self.plan, epsilon, None)
        world.reset(self.tapes)
        caregiver.reset(len(self.tapes))
        safe = []
        for timestep in range(1, max(at) + 1):
            world.step()
            caregiver.watch(world.observation())
            if timestep in at:
                safe.append(caregiver.assess(world.observation()).safe)
        return np.array(safe)


def print_variants(study: Study, alone: dict[float, Outcome]) -> None:
    """Damage left under every variant, and whether it changes any episode at all."""
    plan = study.plan
    variants: dict[str, tuple[Callable[[], Caregiver], int]] = {
        name: (lambda options=options: PaperCaregiver(plan, **options), CAREGIVER_ACTIONS)
        for name, options in _PRIORS.items()
    }
    variants["P(reach) linear"] = (lambda: PaperCaregiver(plan, reach="linear"), CAREGIVER_ACTIONS)
    for actions in (1, 2, 4, 5, 6):
        variants[f"{actions} caregiver action{'s' * (actions > 1)} a timestep"] = (
            lambda: PaperCaregiver(plan),
            actions,
        )
    variants["candle to the nearest bare table"] = (lambda: NearestTable(plan), CAREGIVER_ACTIONS)
    variants["candle to the least exposed bare table"] = (lambda: LeastExposedTable(plan), CAREGIVER_ACTIONS)

    print(_row("variant", *(f"left at {e:g}" for e in _EPSILONS), "toys kept", "interventions", "episodes as default"))
    print(_row("---", *["---:"] * (len(_EPSILONS) + 3)))
    default: dict[float, Outcome] = {}
    for name, (make, actions) in variants.items():
        outcomes = {epsilon: study.run(epsilon, make(), actions) for epsilon in _EPSILONS}
        default = default or outcomes
        same = np.mean([_same(outcomes[e], default[e]) for e in _EPSILONS])
        toys = sum(outcomes[e].toys_reached.mean() for e in _EPSILONS) / sum(
            alone[e].toys_reached.mean() for e in _EPSILONS
        )
        begun = np.mean([outcomes[e].interventions.mean() for e in _EPSILONS])
        left = [_damage_left(outcomes[e], alone[e]) for e in _EPSILONS]
        print(_row(name, *left, f"{toys:.1%}", f"{begun:.1f}", f"{same:.0%}"), flush=True)


def print_thresholds(study: Study, alone: dict[float, Outcome]) -> None:
    """What the prior does once expected danger is compared with a threshold."""
    plan = study.plan
    epsilons = (1.0, 0.5, 0.05)
    rows = {f"threshold {threshold:g}": {"threshold": threshold} for threshold in (0.0, 0.1, 0.5, 1.0)}
    rows |= {f"threshold 0.5, {name}": {"threshold": 0.5, **options} for name, options in _PRIORS.items() if options}
    print(_row("variant", *(f"left at {e:g}" for e in epsilons), *(f"interventions at {e:g}" for e in epsilons)))
    print(_row("---", *["---:"] * (2 * len(epsilons))))
    for name, options in rows.items():
        outcomes = {epsilon: study.run(epsilon, PaperCaregiver(plan, **options)) for epsilon in epsilons}
        left = [_damage_left(outcomes[e], alone[e]) for e in epsilons]
        print(_row(name, *left, *(f"{outcomes[e].interventions.mean():.1f}" for e in epsilons)), flush=True)


def print_safety(study: Study) -> None:
    """P(safe) of careful and careless novices, and how well it tells them apart."""
    at = (10, 50, 200)
    columns = [f"{epsilon:g} after {timestep}" for epsilon in (1.0, 0.5, 0.05) for timestep in at]
    print(_row("prior", *columns, "told apart after 10"))
    print(_row("---", *["---:"] * (len(columns) + 1)))
    for name, options in _PRIORS.items():
        caregiver = PaperCaregiver(study.plan, **options)
        safe = {epsilon: study.safety(epsilon, caregiver, at) for epsilon in (1.0, 0.5, 0.05)}
        means = [f"{mean:.2f}" for epsilon in safe for mean in safe[epsilon].mean(axis=1)]
        # The probability that a careful novice looks safer than a careless one, whichever two one takes.
        careful, careless = safe[0.05][0][:, None], safe[1.0][0]
        apart = (careful > careless).mean() + (careful == careless).mean() / 2
        print(_row(name, *means, f"{apart:.2f}"), flush=True)


def _damage_left(assisted: Outcome, alone: Outcome) -> str:
    ratio, low, high = ratio_interval(assisted.damage, alone.damage)
    return f"{ratio:.3f} ± {(high - low) / 2:.3f}"


def _same(one: Outcome, other: Outcome) -> np.ndarray:
    """Whether every figure of an episode is the same, (B,)."""
    figures = [field.name for field in dataclasses.fields(Outcome)]
    return np.all([getattr(one, name) == getattr(other, name) for name in figures], axis=0)


def _row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--house", default="paper", help="name or file of the floor plan")
    parser.add_argument("--episodes", type=int, default=2000, help="episodes for every variant and epsilon")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first episode")
    arguments = parser.parse_args()
    seeds = range(arguments.seed, arguments.seed + arguments.episodes)
    study = Study(FloorPlan.load(arguments.house), [NoviceTape.draw(np.random.RandomState(seed)) for seed in seeds])
    alone = study.alone()
    for print_table in (print_variants, print_thresholds):
        print_table(study, alone)
        print()
    print_safety(study)


if __name__ == "__main__":
    main()

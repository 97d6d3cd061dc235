"""Variants of the caregiver, run on the same novices."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.children.tape import Tape
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.grid.world import CAREGIVER_ACTIONS, GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.studies.ablations.destinations import LeastExposedTable, NearestTable

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

Figures = dict[str, np.ndarray]  # what is measured of every episode, (B,) each


@dataclasses.dataclass(frozen=True)
class Variant:
    """A caregiver with something changed.

    Attributes:
        make: Makes it for a house.
        actions: How many actions it has in a novice timestep.
    """

    make: Callable[[FloorPlan], Caregiver]
    actions: int = CAREGIVER_ACTIONS


def paper(**options: Any) -> Callable[[FloorPlan], Caregiver]:
    """What makes the paper's caregiver with some options."""
    return lambda plan: PaperCaregiver(plan, **options)


def variants() -> dict[str, Variant]:
    """All variants by name; the first one is the default."""
    found = {name: Variant(paper(**options)) for name, options in PRIORS.items()}
    found["P(reach) linear"] = Variant(paper(reach="linear"))
    for actions in _ACTIONS:
        found[f"{actions} caregiver action{'s' * (actions > 1)} a timestep"] = Variant(paper(), actions)
    found["candle to the nearest bare table"] = Variant(NearestTable)
    found["candle to the least exposed bare table"] = Variant(LeastExposedTable)
    return found


@dataclasses.dataclass(frozen=True)
class Study:
    """Runs variants on the same novices.

    Attributes:
        plan: The house.
        tapes: The novices' chance, the same for every variant.
    """

    plan: FloorPlan
    tapes: Sequence[tuple[Tape, ...]]

    def run(self, epsilon: float, variant: Variant) -> Figures:
        """Runs all episodes with a variant."""
        caregiver = variant.make(self.plan)
        return GridWorld(self.plan, epsilon, caregiver, caregiver_actions=variant.actions).run(self.tapes).totals()

    def alone(self) -> dict[float, Figures]:
        """Runs all episodes without a caregiver, by epsilon."""
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

"""Whose routes a caregiver has seen before it meets a child: where its action prior comes from."""

from __future__ import annotations

import abc
from collections.abc import Iterable

import numpy as np

from caregiver_mj.children.novice import EXPERT_TIMESTEPS, expert_trajectories
from caregiver_mj.danger import safety
from caregiver_mj.danger.safety import carried_prior, context, context_counts, sector
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.floor_plan import FloorPlan


class Experts(abc.ABC):
    """Whoever the action prior is learned from."""

    @abc.abstractmethod
    def action_prior(self, plan: FloorPlan, random: np.random.Generator, draws: bool) -> np.ndarray:
        """Return theta_s(a) in a house.

        Args:
            plan: The house.
            random: Source of all chance in it.
            draws: Whether theta is a draw from its Dirichlet distribution; else it is the mean.

        Returns:
            Array (free cells, 4), rows sum to 1.
        """


class InPlace(Experts):
    """Experts who walk about the caregiver's own house, as in the paper (section V.C)."""

    def __init__(self, timesteps: int = EXPERT_TIMESTEPS, hyperprior: float = safety.HYPERPRIOR):
        """Take how long their trajectories are together, and alpha^0."""
        self._timesteps, self._hyperprior = timesteps, hyperprior

    def action_prior(self, plan: FloorPlan, random: np.random.Generator, draws: bool) -> np.ndarray:
        experts = expert_trajectories(plan, random, self._timesteps)
        return _theta(safety.action_counts(experts, len(plan.free_cells), self._hyperprior), random, draws)


class Elsewhere(Experts):
    """Experts who walked about other houses; what they did there is carried over by what was around them.

    Attributes:
        alpha: alpha_phi(a) of every context, (contexts, 4); see `danger.safety`.
    """

    def __init__(self, alpha: np.ndarray):
        self.alpha = alpha

    @classmethod
    def in_houses(cls, plans: Iterable[FloorPlan]) -> Elsewhere:
        """Learn from experts who walk about some houses."""
        random, seen = np.random.default_rng(0), []
        for plan in plans:
            around, sectors = surroundings(plan)
            for cells, actions, goal in routes(plan, random):
                seen.append((around[cells], sectors[cells, goal], actions))
        around, sectors, moves = map(np.concatenate, zip(*seen, strict=True))
        return cls(context_counts(around, sectors, moves, safety.HYPERPRIOR))

    def action_prior(self, plan: FloorPlan, random: np.random.Generator, draws: bool) -> np.ndarray:
        around, sectors = surroundings(plan)
        return carried_prior(_theta(self.alpha, random, draws), context(around[:, None], sectors))


def surroundings(plan: FloorPlan) -> tuple[np.ndarray, np.ndarray]:
    """Return what is around every free cell, (free cells, 4), and each bin's sector from it, (free cells, bins)."""
    cells, bins = np.array(plan.free_cells), np.array(plan.bins)
    down, right = np.moveaxis(bins - cells[:, None], 2, 0)
    return plan.graph.moves[1], sector(down, right)


def routes(
    plan: FloorPlan, random: np.random.Generator, timesteps: int = EXPERT_TIMESTEPS
) -> list[tuple[np.ndarray, np.ndarray, int]]:
    """Return expert trajectories that end in a bin: the cells of each, its moves, and the bin."""
    _, target, index = plan.graph.moves
    found = []
    for trajectory in expert_trajectories(plan, random, timesteps):
        cells, actions = np.array(trajectory).T
        if target[cells[-1], actions[-1]] == Target.BIN:  # else it was cut off
            found.append((cells, actions, int(index[cells[-1], actions[-1]])))
    return found


def _theta(alpha: np.ndarray, random: np.random.Generator, draws: bool) -> np.ndarray:
    return safety.action_prior_draw(alpha, random) if draws else safety.action_prior_mean(alpha)

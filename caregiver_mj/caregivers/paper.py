"""The paper's rule: protect the object of greatest expected danger (sections III and IV)."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver, first_of_greatest
from caregiver_mj.caregivers.percept import Assessment, Followers, Percept
from caregiver_mj.children.novice import EXPERT_TIMESTEPS, expert_trajectories
from caregiver_mj.danger import safety
from caregiver_mj.errors import CaregiverError
from caregiver_mj.interventions.verb import Interventions
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Where

_OPTIONS = {"reach": ("inverse", "linear"), "prior": ("draw", "mean")}


class PaperCaregiver(Caregiver):
    """Protects the children from the hazard of greatest expected danger, equation (2), over all of them.

    The paper has one child; with several, the dangers of a hazard to each are added up.
    """

    def __init__(
        self,
        plan: FloorPlan,
        seed: int = 0,
        *,
        reach: str = "inverse",
        prior: str = "draw",
        threshold: float = 0.0,
        expert_timesteps: int = EXPERT_TIMESTEPS,
        hyperprior: float = safety.HYPERPRIOR,
    ):
        """Learn the action prior from experts in this house.

        Args:
            plan: The house.
            seed: Seed of the expert trajectories and the Dirichlet draw.
            reach: Reading of P(reach): "inverse" or "linear" distance.
            prior: theta_s as a "draw" from Dir(alpha_s), or its "mean".
            threshold: Expected danger below which it does nothing.
            expert_timesteps: Total length of the expert trajectories; 0 for no experts.
            hyperprior: alpha_s^0(a).

        Raises:
            CaregiverError: An option has an invalid value.
            ValueError: The hyperprior is not positive.
        """
        super().__init__(plan, seed)
        for what, value in (("reach", reach), ("prior", prior)):
            if value not in _OPTIONS[what]:
                raise CaregiverError(f"{what} must be one of {', '.join(_OPTIONS[what])}, got {value!r}")
        random = np.random.default_rng(seed)
        experts = expert_trajectories(plan, random, expert_timesteps)
        alpha = safety.action_counts(experts, len(plan.free_cells), hyperprior)
        draws = prior == "draw"
        self.action_prior = safety.action_prior_draw(alpha, random) if draws else safety.action_prior_mean(alpha)
        self._reach, self._threshold = reach, threshold
        # Candles can stand on any table, so the largest distance is over all tables.
        self._largest_distance = max(
            d.max()
            for d in (self.table_distances, self.stairwell_distances, self.floor_distances, np.ones(1))
            if d.size
        )
        self.reset(1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        self._log_ratio = np.zeros((batch, children))
        self.followers = Followers(self.plan, batch, children)

    def watch(self, percept: Percept) -> None:
        super().watch(percept)
        moved = percept.previous_action != NOTHING
        ratio = safety.log_likelihood_ratio(self.action_prior, percept.previous_cell, percept.previous_action)
        self._log_ratio += np.where(moved, ratio, 0.0)

    def assess(self, percept: Percept) -> Assessment:
        return self.weigh(self.reach(percept))

    def weigh(self, reach: np.ndarray) -> Assessment:
        """Return the present P(safe|tau) and expected danger, given P(reach|tau), (B, K, hazards)."""
        safe, damage = safety.probability_safe(self._log_ratio), self.plan.hazards.damage
        danger = safety.expected_danger(safe, reach, damage)
        # 1 - P(safe) may round to 0 after a long safe walk. Only its ratios between children matter, so it is computed
        # in log space, relative to the greatest; for a single child it is exactly 1.
        unsafe = safety.log_probability_unsafe(self._log_ratio)
        weight = np.exp(unsafe - unsafe.max(axis=1, keepdims=True))
        return Assessment(safe, reach, danger, self.urgency(weight, reach))

    def urgency(self, unsafe: np.ndarray, reach: np.ndarray) -> np.ndarray:
        """Return the urgency of each hazard, (B, hazards), given the children's unsafety, (B, K), and P(reach|tau)."""
        return (unsafe[..., None] * reach * self.plan.hazards.damage).sum(axis=1)

    def reach(self, percept: Percept) -> np.ndarray:
        """Return P(reach_o|tau) of each hazard by each child, (B, K, hazards), normalised over hazards, not tables."""
        if percept.belief:  # expectation over all cells
            presence = percept.belief.presence
            anywhere = np.broadcast_to(np.arange(presence.shape[2]), (len(presence), presence.shape[2]))
            reach = self.reach(dataclasses.replace(percept, child_cell=anywhere, belief=None))
            return np.einsum("bkc,bch->bkh", presence, reach)
        distance = self.hazard_distances(percept)
        if self._reach == "inverse":
            return safety.reach_inverse(distance)
        return safety.reach_linear(distance, self._largest_distance)

    def choose(self, percept: Percept) -> np.ndarray:
        return self.target(percept, self.assess(percept))

    def target(self, percept: Percept, assessment: Assessment) -> np.ndarray:
        """Return the hazard of greatest expected danger, (B,), or NOTHING, given an assessment."""
        target, most = first_of_greatest(np.where(self.worth_protecting(percept), assessment.urgency, 0.0))
        danger = np.where(most > 0, (1.0 - assessment.safe).max(axis=1) * most, -np.inf)
        return np.where(danger >= self._threshold, target, NOTHING)


class StairsCaregiver(PaperCaregiver):
    """The rule on stairwells only: it never touches a candle."""

    def worth_protecting(self, percept: Percept) -> np.ndarray:
        hazards = self.plan.hazards
        return super().worth_protecting(percept) & hazards.are_at(Where.OPENING, np.arange(len(hazards)))


class CandlesCaregiver(PaperCaregiver):
    """The rule on candles only: it never blocks a stairwell."""

    def worth_protecting(self, percept: Percept) -> np.ndarray:
        hazards = self.plan.hazards
        return super().worth_protecting(percept) & hazards.are_at(Where.ON_TABLE, np.arange(len(hazards)))


class LastSeenCaregiver(PaperCaregiver):
    """The rule without a tracker: it assumes that an unseen child is where it was last seen."""

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        super().reset(batch, seeds, children)
        self._last = np.full((batch, children), NOTHING)

    def watch(self, percept: Percept) -> None:
        super().watch(self._as_seen(percept))

    def assess(self, percept: Percept) -> Assessment:
        return super().assess(self._as_seen(percept))

    def decide(self, percept: Percept) -> Interventions:
        return super().decide(self._as_seen(percept))

    def _as_seen(self, percept: Percept) -> Percept:
        """Return the percept without belief; a child that it has never seen is in its most probable cell."""
        if not percept.belief:
            return percept
        self._last = np.where(percept.belief.seen, percept.child_cell, self._last)
        known = np.where(self._last == NOTHING, percept.child_cell, self._last)
        return dataclasses.replace(percept, child_cell=known, belief=None)

"""The action priors that are compared, and how well P(safe) tells with each of them."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.stats import rankdata

from caregiver_mj.caregivers.experts import Elsewhere, Experts, InPlace, Nobody, routes
from caregiver_mj.children.family import Family
from caregiver_mj.children.side_by_side import side_by_side
from caregiver_mj.danger import safety
from caregiver_mj.experiments.seeds import episode_seed, episode_tapes
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan

IN_PLACE, ELSEWHERE, NOBODY = "in place", "elsewhere", "nobody"
WHOSE = (IN_PLACE, ELSEWHERE, NOBODY)
HOW = ("draw", "mean")
PRIORS = tuple((whose, how) for how in HOW for whose in WHOSE)
HORIZON = 15  # timesteps without a collision that are called safe
HALF = 0.5  # epsilon below which a child is called safe, and above which it is not
_NEW_ROUTES = 1  # seed of expert routes that no caregiver has learnt from
MEASURES = {  # by the name of what `tell` has, what it is called
    "careful": "AUC, epsilon below .5",
    "safe": "AUC, no collision",
    "brier_careful": "Brier, epsilon",
    "brier_safe": "Brier, collision",
    "routes": "log likelihood",
}


@dataclasses.dataclass(frozen=True)
class Telling:
    """How well P(safe|tau) tells in one house, with one prior.

    Attributes:
        measures: One number for each of `MEASURES`; NaN where there is nothing to tell.
        course: Area under the curve for epsilon after every timestep, (timesteps,).
    """

    measures: tuple[float, ...]
    course: np.ndarray


@dataclasses.dataclass(frozen=True)
class Walks:
    """Children alone in a house, a column an episode.

    Attributes:
        cell: The cell in which each move was made, (timesteps, B).
        action: The move, likewise.
        hurt: Whether it was a collision that does damage, likewise.
        epsilon: Share of random moves in each episode, (B,).
    """

    cell: np.ndarray
    action: np.ndarray
    hurt: np.ndarray
    epsilon: np.ndarray


def walks(plan: FloorPlan, episodes: int) -> Walks:
    """Watches novices of each of `EPSILONS` in so many episodes each."""
    families = [Family.of(epsilon) for epsilon in EPSILONS]
    world = GridWorld(plan, side_by_side(plan, families, episodes), None)
    tapes = [episode_tapes(episode_seed(0, episode), 1) for episode in range(episodes)] * len(EPSILONS)
    seen, damage = [], [np.zeros(len(tapes))]

    def look() -> None:
        seen.append((world.previous_cell[:, 0], world.previous_action[:, 0]))
        damage.append(world.ledger.damage)

    world.run(tapes, look)
    cell, action = np.array(seen).swapaxes(0, 1)
    return Walks(cell, action, np.diff(damage, axis=0) > 0, np.repeat(EPSILONS, episodes))


def experts(whose: str, elsewhere: Elsewhere) -> Experts:
    """Those of a name."""
    return {IN_PLACE: InPlace(), ELSEWHERE: elsewhere, NOBODY: Nobody()}[whose]


def tell(plan: FloorPlan, theta: np.ndarray, seen: Walks) -> Telling:
    """How well P(safe|tau) tells safe walks from others, and theta the routes of experts.

    Args:
        plan: The house.
        theta: The action prior, (free cells, 4).
        seen: The walks.
    """
    ratio = safety.log_likelihood_ratio(theta, seen.cell, seen.action).cumsum(axis=0)  # (timesteps, B)
    ahead = np.cumsum(seen.hurt, axis=0)
    unhurt = ahead[HORIZON:] == ahead[:-HORIZON]  # after each timestep that has so many after it
    told = np.broadcast_to(seen.epsilon, ratio.shape)
    clear = told != HALF
    new = routes(plan, np.random.default_rng(_NEW_ROUTES))
    cells, actions = (np.concatenate([route[part] for route in new]) for part in (0, 1))
    measures = (
        area_under_curve(ratio[clear], told[clear] < HALF),
        area_under_curve(ratio[:-HORIZON], unhurt),
        _brier(ratio[clear], told[clear] < HALF),
        _brier(ratio[:-HORIZON], unhurt),
        float(np.log(theta[cells, actions]).mean()),
    )
    of = clear[0]
    course = [area_under_curve(row[of], seen.epsilon[of] < HALF) for row in ratio]
    return Telling(measures, np.array(course))


def area_under_curve(score: np.ndarray, positive: np.ndarray) -> float:
    """How often a positive has a higher score than a negative, ties counting half; NaN where one kind is missing."""
    score, positive = np.ravel(score), np.ravel(positive)
    count = int(positive.sum())
    others = len(positive) - count
    if not count or not others:
        return np.nan
    return float((rankdata(score)[positive].sum() - count * (count + 1) / 2) / (count * others))


def _brier(ratio: np.ndarray, positive: np.ndarray) -> float:
    return float(((safety.probability_safe(ratio) - positive) ** 2).mean())

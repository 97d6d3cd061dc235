"""Caregivers to compare with: baselines that estimate no danger, and caregivers that look for a share of the time."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver, first_of_greatest
from caregiver_mj.caregivers.percept import Followers, Percept, bare_tables
from caregiver_mj.children.novice import Novice
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS, pick
from caregiver_mj.danger.chain import ChildChain, expected_visits
from caregiver_mj.interventions.verb import Interventions
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Where

EPSILON = 0.5  # of the novice that `childproof` expects


class RandomCaregiver(Caregiver):
    """Draws a hazard worth protecting from in every novice timestep; drawn more often, it would never arrive."""

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        self.reset(1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        seeds = [0] * batch if seeds is None else seeds
        length = EPISODE_TIMESTEPS + 1
        self._draws = np.stack([np.random.default_rng((self.seed, int(s))).random(length) for s in seeds], axis=1)
        self._timestep = 0

    def watch(self, percept: Percept) -> None:
        self._timestep = (self._timestep + 1) % len(self._draws)

    def choose(self, percept: Percept) -> np.ndarray:
        worth = self.worth_protecting(percept)
        count = worth.sum(axis=1)
        chosen = pick(self._draws[self._timestep], count)
        target, _ = first_of_greatest(worth & (worth.cumsum(axis=1) == chosen[:, None] + 1))
        return np.where(count > 0, target, NOTHING)


class NearestCaregiver(Caregiver):
    """Protects from the hazard nearest to a child, regardless of its damage."""

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        self.followers = Followers(self.plan, batch, children)

    def choose(self, percept: Percept) -> np.ndarray:
        distance = self.hazard_distances(percept).min(axis=1)
        target, nearness = first_of_greatest(np.where(self.worth_protecting(percept), 1.0 / distance, 0.0))
        return np.where(nearness > 0, target, NOTHING)


class GuardCaregiver(Caregiver):
    """Goes to the stairwell nearest to its start, and stays there."""

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        landings = [plan.cell_index[cell] for cell in plan.landings]
        self._walk = plan.graph.distances_from(landings).T  # (caregiver cells, landings)
        self.reset(1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        self._post = np.full(batch, NOTHING)

    def choose(self, percept: Percept) -> np.ndarray:
        if self.plan.landings:
            nearest = self._walk[percept.caregiver_cell].argmin(axis=1)  # they are the first hazards
            self._post = np.where(self._post == NOTHING, nearest, self._post)
        return self._post


class NearestFirstCaregiver(GuardCaregiver):
    """Removes hazards, the nearest first, regardless of the children; then guards stairs.

    It closes gates, picks up things on the floor, and takes things on tables to the table with the fewest cells beside
    it. It guards the stairwell of `GuardCaregiver`.
    """

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        graph, beside = plan.graph, plan.graph.beside(plan.tables)
        mouths = [plan.cell_index[cell] for cell in plan.mouths.values()]
        # Distances to gates and to things on the floor, (caregiver cells, gates or things).
        self._to_gate, self._to_floor = (graph.distances_from(cells).T for cells in (mouths, plan.floor_cells))
        self._to_table = graph.distances_from(beside).T
        self._beside = np.array([len(cells) for cells in beside], float)

    def choose(self, percept: Percept) -> np.ndarray:
        far = self.distance(percept)
        worth = np.isfinite(far)
        if percept.out_of_reach is not None:
            worth &= ~percept.out_of_reach
        nearest, _ = first_of_greatest(np.where(worth, 1.0 / (1.0 + far), 0.0))
        return np.where(worth.any(axis=1), nearest, super().choose(percept))

    def distance(self, percept: Percept) -> np.ndarray:
        """Return the distance to the next step against each hazard, (B, hazards); infinite if there is none."""
        hazards, cell = self.plan.hazards, percept.caregiver_cell
        openings = np.full((len(cell), len(self.plan.stairwells)), np.inf)
        openings[:, len(self.plan.landings) :] = self._to_gate[cell]
        lying = self._to_floor[cell].astype(float)
        if percept.shut is not None:
            openings[percept.shut] = np.inf
        if percept.gone is not None:
            lying[percept.gone] = np.inf
        return hazards.join(openings, self._to_things(percept), lying)

    def _to_things(self, percept: Percept) -> np.ndarray:
        """Return the distance to each thing on the floor, or on a table worse than a bare one, (B, things)."""
        cell, table, graph = percept.caregiver_cell, percept.candle_table, self.plan.graph
        if not table.size:
            return np.empty(table.shape)
        least = np.where(bare_tables(table, len(self._beside)), self._beside, np.inf).min(axis=1)
        worse = (table != NOTHING) & (self._beside[table] > least[:, None])
        far = np.where(worse, self._to_table[cell[:, None], table], np.inf)
        for world, thing, moves in percept.fallen(graph):
            far[world, thing] = moves[cell[world]]
        return far

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        """Return the bare table with the fewest cells beside it, (B,)."""
        bare = bare_tables(percept.candle_table, len(self._beside))
        return np.where(bare, self._beside, np.inf).argmin(axis=1)


class ChildproofCaregiver(NearestFirstCaregiver):
    """Puts candles on the tables that a novice is least likely to bump into, before it comes in.

    Then it closes gates and picks up things on the floor, the nearest first, and guards stairs.
    """

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        chosen = np.argsort(table_exposure(plan), kind="stable")[: len(plan.candle_tables)].tolist()
        # A candle on a chosen table stays; the others fill the remaining tables in turn.
        left = iter([table for table in chosen if table not in plan.candle_tables])
        self._tables = np.array([table if table in chosen else next(left) for table in plan.candle_tables], int)

    def prepare(self, candle_table: np.ndarray) -> np.ndarray:
        return np.tile(self._tables, (len(candle_table), 1))

    def distance(self, percept: Percept) -> np.ndarray:
        openings, things, lying = self.plan.hazards.split(super().distance(percept))
        return self.plan.hazards.join(openings, np.full_like(things, np.inf), lying)


def table_exposure(plan: FloorPlan, epsilon: float = EPSILON, timesteps: int = EPISODE_TIMESTEPS) -> np.ndarray:
    """Return the exact expected bumps of an undisturbed novice into each table in an episode, (tables,).

    The novice is a Markov chain on pairs of its cell and its bin, all equally likely at the start.
    """
    next_cell, target, index = plan.graph.moves
    reaches = np.where(target == Target.BIN, index, NOTHING)[..., None] == np.arange(len(plan.bins))
    greedy, objects = Novice(plan, 0.0).action_probabilities(), len(plan.stairwells) + len(plan.tables)
    chain = ChildChain(greedy, np.array([epsilon]), next_cell, reaches, plan.graph.bumps, objects)
    visits = expected_visits(chain.transition, np.full(chain.size, 1.0 / chain.size), timesteps)
    return (visits @ chain.hits)[len(plan.stairwells) :]


class WandererCaregiver(RandomCaregiver):
    """Draws a random hazard, and another when it is done with the first.

    It is done when it stands in the stairwell, when the candle is on another table, or when the hazard is no longer
    worth protecting from.
    """

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        super().reset(batch, seeds, children)
        self._target = np.full(batch, NOTHING)
        self._table = np.full(batch, NOTHING)  # the candle's table when it was drawn

    def choose(self, percept: Percept) -> np.ndarray:
        drawn, goes_on = super().choose(percept), self._goes_on(percept)
        self._target = np.where(goes_on, self._target, drawn)
        self._table = np.where(goes_on, self._table, self._table_of(drawn, percept))
        return self._target

    def _goes_on(self, percept: Percept) -> np.ndarray:
        """Return whether the hazard still needs an intervention, (B,)."""
        hazards, target = self.plan.hazards, self._target
        if len(hazards) == 0:
            return np.zeros(len(target), bool)
        worlds, table = np.arange(len(target)), self._table_of(target, percept)
        stairwell, candle = (hazards.among(where, target) for where in (Where.OPENING, Where.ON_TABLE))
        there = (stairwell != NOTHING) & (percept.caregiver_cell == len(self.plan.free_cells) + stairwell)
        moved = (candle != NOTHING) & (table != NOTHING) & (table != self._table)
        held = (candle != NOTHING) & (candle == percept.holding)  # must be put down, worth protecting from or not
        worth = self.worth_protecting(percept)[worlds, target] | held
        return (target != NOTHING) & worth & ~there & ~moved

    def _table_of(self, hazard: np.ndarray, percept: Percept) -> np.ndarray:
        """Return the table of each hazard, (B,); NOTHING for stairwells and candles on no table."""
        candle = self.plan.hazards.among(Where.ON_TABLE, hazard)
        if percept.candle_table.shape[1] == 0:
            return np.full(len(hazard), NOTHING)
        return np.where(candle == NOTHING, NOTHING, percept.candle_table[np.arange(len(hazard)), candle])


BOUT = 6.0  # timesteps, 10 s; mean bout of looking. Assumed: no measurement of parents at home is known
_OWN_STREAM = 1  # of draws, separate from a random caregiver's


class Attentive(Caregiver):
    """Mixin that lets a caregiver act only while it looks, and stand aside otherwise.

    Looking is a Markov chain with the given share and mean bout, stationary from the start. An inattentive caregiver
    still observes the children and still puts down a candle in its hand.

    Attributes:
        share: Share of the time in which it looks; one for all episodes, or (B,).
        bout: Mean bout of looking, timesteps.
    """

    share: float | np.ndarray = 1.0
    bout = BOUT

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        super().reset(batch, seeds, children)
        numbers, length = [0] * batch if seeds is None else seeds, EPISODE_TIMESTEPS + 1
        keys = [(_OWN_STREAM, self.seed, int(number)) for number in numbers]
        draws = np.stack([np.random.default_rng(key).random(length) for key in keys])
        self._looks, self._moment = looks(draws, self.share, self.bout), 0

    def watch(self, percept: Percept) -> None:
        super().watch(percept)
        self._moment = (self._moment + 1) % self._looks.shape[1]

    def decide(self, percept: Percept) -> Interventions:
        looking = self._looks[:, self._moment]
        aside = Interventions.idle(len(looking))
        aside.destination[:] = percept.caregiver_cell  # unlike bare idling, this interrupts the robot
        return super().decide(percept).where(looking, aside)


@functools.cache
def attentive(share: float, caregiver: type[Caregiver]) -> type[Attentive]:
    """Return the attentive class of a caregiver, which looks for a share of the time."""
    details = {"share": share, "__doc__": Attentive.__doc__, "__module__": caregiver.__module__}
    return type(f"Attentive{caregiver.__name__}", (Attentive, caregiver), details)


def looks(draws: np.ndarray, share: float | np.ndarray, bout: float) -> np.ndarray:
    """Return whether a caregiver looks, bool (B, T), from uniform draws, (B, T), and shares of the time, (B,).

    A bout of looking ends with probability 1 / bout. The mean of the others follows from the share; as it is at least
    one timestep, shares above bout / (bout + 1) lengthen the bouts of looking.
    """
    share, tiny = np.broadcast_to(share, len(draws)), np.finfo(float).tiny
    ends = np.minimum(1.0 / bout, (1.0 - share) / np.maximum(share, tiny))
    goes_on, begins = 1.0 - ends, np.minimum(1.0, share * ends / np.maximum(1.0 - share, tiny))
    found = draws < share[:, None]  # the first column is final
    for now in range(1, draws.shape[1]):
        found[:, now] = draws[:, now] < np.where(found[:, now - 1], goes_on, begins)
    return found

"""The base class of caregivers, for grid and house.

A world gives the caregiver a `Percept` and carries out the `Interventions` that it returns. Both hold a batch of
worlds: thousands of episodes in the grid, one in the house.
"""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from caregiver_mj.caregivers.percept import PAPER, Assessment, Followers, Pace, Percept, bare_tables
from caregiver_mj.errors import CaregiverError
from caregiver_mj.interventions.verb import DO_NOTHING, STAND_ASIDE, Interventions, Verb, verb_of
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Hazards, Where, kinds_at
from caregiver_mj.plans.visibility import FULL, Sight


class Caregiver(abc.ABC):
    """Chooses interventions. One instance serves one batch of episodes at a time.

    Most caregivers only `choose` a hazard; the kind of hazard decides the verb, and `destination` the table of a
    candle. A caregiver that needs more control overrides `decide`.

    Attributes:
        plan: The house.
        seed: Seed of the caregiver's own randomness.
        table_distances: Moves that a child needs to bump into each table, (free cells, tables).
        stairwell_distances: Moves after which it falls down each stairwell, (free cells, stairwells).
        floor_distances: Moves after which it takes each thing on the floor, (free cells, things).
        takes_orders: Whether it only passes on orders, which the robot must carry out as given.
        waits: Whether it may send the robot to any cell to wait there.
        yields: Whether it steps aside, or follows, where a child bars its way, and makes room for children when it has
            nothing to do. Otherwise it stays.
        needs_pictures: Whether it needs a percept's `frames`, so that it acts in the house only.
        pace: Durations of its actions, set by the world before the first `reset`.
        sight: How it sees children, set by the world before the first `reset`.
        followers: Detects children that follow it. With followers it protects from nothing, but stays away from
            hazards. None to ignore them.
        serves: Token of the present episodes, set by the world after `reset` to detect that another world has begun
            episodes with it.
    """

    takes_orders = False
    waits = False
    yields = True
    needs_pictures = False
    pace: Pace = PAPER
    sight: Sight = FULL
    followers: Followers | None = None
    serves: object = None

    def __init__(self, plan: FloorPlan, seed: int = 0):
        self.plan = plan
        self.seed = seed
        self.table_distances = plan.graph.table_distances.astype(float)
        self.stairwell_distances = plan.graph.stairwell_distances.astype(float)
        self.floor_distances = plan.graph.floor_distances.astype(float)

    def reset(  # noqa: B027 (most remember nothing)
        self, batch: int, seeds: Sequence[int] | None = None, children: int = 1
    ) -> None:
        """Begin B new episodes.

        Args:
            batch: B, the number of episodes.
            seeds: A seed for each episode, for random caregivers: an episode must not depend on its batch.
            children: K, the number of children in each.
        """

    def prepare(self, candle_table: np.ndarray) -> np.ndarray:
        """Make the house safe before the children come in; called after `reset`.

        Args:
            candle_table: Index of each candle's table in the floor plan, (B, candles).

        Returns:
            Index of each candle's table at the start of the episode, (B, candles).
        """
        return candle_table

    def watch(self, percept: Percept) -> None:
        """Observe the children's last moves. Called once a novice timestep."""
        if self.followers:
            self.followers.watch(percept)

    @abc.abstractmethod
    def choose(self, percept: Percept) -> np.ndarray:
        """Choose the hazard to protect the children from now, (B,), or NOTHING."""

    def decide(self, percept: Percept) -> Interventions:
        """Return the interventions to do now. A world may call it at any time."""
        return self.protect(percept, self.choose(percept))

    def assess(self, percept: Percept) -> Assessment | None:
        """Return the numbers behind a decision, or None."""
        return None

    # -- What most caregivers share --------------------------------------------------------------

    @property
    def idle_verb(self) -> str:
        """Verb for when it has nothing to do."""
        return STAND_ASIDE if self.yields else DO_NOTHING

    def protect(self, percept: Percept, hazard: np.ndarray) -> Interventions:
        """Return interventions against hazards (B,); for NOTHING, the idle verb."""
        hazards, who = self.plan.hazards, f"{type(self).__name__}.choose must answer with"
        hazard = check_numbers(who, hazard, len(percept.child_cell), NOTHING, len(hazards) - 1)
        if self.followers is not None:
            hazard = np.where(self.followers.there, NOTHING, hazard)
        verb = np.append(hazards.verb, self.idle_verb)[hazard]
        candle, destination = hazards.among(Where.ON_TABLE, hazard), np.full(len(hazard), NOTHING)
        if (candle != NOTHING).any():
            destination = np.where(candle != NOTHING, self.destination(percept, candle), NOTHING)
        return Interventions(verb, hazard, destination)

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        """Choose the table for a candle (B,), (B,): the bare one with the longest way from its nearest child."""
        distance = self.table_distances[percept.child_cell].min(axis=1)
        return np.where(bare_tables(percept.candle_table, len(self.plan.tables)), distance, -np.inf).argmax(axis=1)

    def worth_protecting(self, percept: Percept) -> np.ndarray:
        """Return whether the caregiver can do something about each hazard, bool (B, hazards).

        It can about every stairwell, every candle that would be farther from the nearest child on a bare table, and
        every thing still on the floor, but not about hazards in cooldown.
        """
        table = percept.candle_table
        distance = self.table_distances[percept.child_cell].min(axis=1)
        farthest = np.where(bare_tables(table, len(self.plan.tables)), distance, 0.0).max(axis=1, initial=0.0)
        stairwells, candles, lying = self.plan.hazards.split(self.hazard_distances(percept).min(axis=1))
        every = np.ones(stairwells.shape, bool)
        worth = self.plan.hazards.join(every, candles < farthest[:, None], np.isfinite(lying))
        return worth if percept.out_of_reach is None else worth & ~percept.out_of_reach

    def hazard_distances(self, percept: Percept) -> np.ndarray:
        """Return the novice timesteps from each child to each hazard, (B, K, hazards).

        Infinite for a carried or removed one. A child collides with a thing on the floor by entering its cell.
        """
        cell, table = percept.child_cell, percept.candle_table
        candles = np.where(table[:, None] == NOTHING, np.inf, self.table_distances[cell[..., None], table[:, None]])
        for world, candle, steps in percept.fallen(self.plan.graph):
            candles[world, :, candle] = np.maximum(1, steps[cell[world]])
        lying = self.floor_distances[cell]
        if percept.gone is not None:
            lying = np.where(percept.gone[:, None], np.inf, lying)
        return self.plan.hazards.join(self.stairwell_distances[cell], candles, lying)


def first_of_greatest(score: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the first hazard of the greatest score (NOTHING if there are none), and that score, both (B,).

    Scores, (B, hazards), are at least 0; those that differ by rounding only count as equal.
    """
    if score.shape[1] == 0:
        return np.full(len(score), NOTHING), np.zeros(len(score))
    greatest = score.max(axis=1)
    return (score >= greatest[:, None] * (1 - 1e-9)).argmax(axis=1), greatest


def answer(caregiver: Caregiver, percept: Percept) -> Interventions:
    """Return a caregiver's decision, or raise CaregiverError if it is invalid for B worlds of its house."""
    given, batch, who = caregiver.decide(percept), len(percept.child_cell), f"{type(caregiver).__name__}.decide"
    if not isinstance(given, Interventions) or np.shape(given.verb) != (batch,):
        raise CaregiverError(f"{who} must answer with Interventions for {batch} worlds, got {given!r}")
    plan, verbs = caregiver.plan, np.asarray(given.verb)
    hazard = check_numbers(f"{who}: hazard must be", given.hazard, batch, NOTHING, len(plan.hazards) - 1)
    for name in dict.fromkeys(verbs.tolist()):
        verb, which = verb_of(name), verbs == name
        _check_kinds(f"{who}: '{name}'", plan.hazards, verb, hazard[which])
        if verb.to_table or name == DO_NOTHING:
            cells = len(plan.caregiver_cells) if caregiver.waits else 0
            last = (len(plan.tables) if verb.to_table else cells) - 1
            destination = np.where(which, given.destination, NOTHING)
            check_numbers(f"{who}: destination of '{name}' must be", destination, batch, NOTHING, last)
    return given


def _check_kinds(who: str, hazards: Hazards, verb: Verb, numbers: np.ndarray) -> None:
    """Raise CaregiverError unless a verb suits all hazards with these numbers."""
    if not verb.where:
        return
    at = [kind for kind in kinds_at(verb.where) if kind.verb == verb.name] or kinds_at(verb.where)
    right = [number for number, kind in enumerate(hazards.kinds) if kind in at]
    if wrong := set(numbers.tolist()).difference(right):
        kinds = " or ".join(kind.name for kind in at)
        raise CaregiverError(
            f"{who} must be for a {kinds}, {right or 'of which there is none'}, got hazard {min(wrong)}"
        )


def check_numbers(what: str, numbers: np.ndarray, batch: int, least: int, most: int) -> np.ndarray:
    """Return an array (B,) of integers, or raise CaregiverError unless all are from `least` to `most`."""
    numbers = np.asarray(numbers)
    if numbers.shape != (batch,) or not np.issubdtype(numbers.dtype, np.integer):
        raise CaregiverError(f"{what} {batch} integers, got {numbers!r}")
    if ((numbers < least) | (numbers > most)).any():
        raise CaregiverError(f"{what} {least} to {most}, got {numbers}")
    return numbers


def starting_tables(plan: FloorPlan, caregiver: Caregiver | None, batch: int = 1) -> np.ndarray:
    """Return the tables of the candles at the start: those of the floor plan, or of the caregiver's `prepare`.

    Args:
        plan: The house.
        caregiver: The caregiver, after its `reset`, or None.
        batch: B, the number of episodes.

    Returns:
        Table indices, (B, candles).

    Raises:
        CaregiverError: The caregiver's answer is invalid.
    """
    as_planned = np.tile(np.array(plan.candle_tables, int), (batch, 1))
    if caregiver is None:
        return as_planned
    tables = np.asarray(caregiver.prepare(as_planned.copy()))
    who, last = f"{type(caregiver).__name__}.prepare", len(plan.tables) - 1
    if tables.shape != as_planned.shape or not np.issubdtype(tables.dtype, np.integer):
        raise CaregiverError(f"{who} must answer with integers of shape {as_planned.shape}, got {tables!r}")
    if ((tables < 0) | (tables > last)).any() or (np.diff(np.sort(tables, axis=1), axis=1) == 0).any():
        raise CaregiverError(f"{who} must give each candle its own table, 0 to {last}, got {tables}")
    return tables


@dataclasses.dataclass(frozen=True)
class Future:
    """The children's next T moves if nobody stands in their way."""

    cell: np.ndarray  # cells after each move, (T, B, K)
    # object of each bump: stairwells first, then tables, or NOTHING, (T, B, K)
    object: np.ndarray


@dataclasses.dataclass(frozen=True)
class Truth:
    """The hidden state of the children."""

    goal: np.ndarray  # index of each child's toy bin, (B, K)
    epsilon: np.ndarray  # share of random moves of each child, (B, K)
    # computes the rest of the episode; None if the world cannot
    future: Callable[[], Future] | None = None


class PrivilegedCaregiver(abc.ABC):
    """A caregiver that receives the hidden state beside the percept: an upper bound for the others."""

    @abc.abstractmethod
    def hear(self, truth: Truth) -> None:
        """Receive the hidden state once a timestep, after the children's moves and `watch`."""

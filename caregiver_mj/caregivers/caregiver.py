"""The caregiver: what to protect next. It never knows whether its world is the grid or the house.

A world shows it a `Percept` and carries out the `Interventions` that it answers with. Both hold a batch of worlds, so
that the grid can run thousands of episodes at once; the house is a batch of one.
"""

from __future__ import annotations

import abc
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.percept import PAPER, Assessment, Followers, Pace, Percept, bare_tables
from caregiver_mj.errors import CaregiverError
from caregiver_mj.interventions.verb import DO_NOTHING, STAND_ASIDE, VERBS, Interventions
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Hazards, Where, kinds_at
from caregiver_mj.plans.visibility import FULL, Sight


class Caregiver(abc.ABC):
    """Decides what to protect, and how. One instance serves one batch of episodes at a time.

    Most caregivers only `choose` a hazard; the rest follows: a stairwell is blocked, a gate closed, a candle taken to
    the table that `destination` says. One that wants more overrides `decide`.

    Attributes:
        plan: The house.
        seed: Seed for whatever is random in the caregiver.
        table_distances: Moves that a child needs to bump into each table, (free cells, tables).
        stairwell_distances: Moves after which it falls down each stairwell, (free cells, stairwells).
        floor_distances: Moves after which it takes each thing on the floor, (free cells, things).
        takes_orders: Whether it only passes on what it was told, which leaves no choice to the one who carries it out.
        waits: Whether it may go to any cell to do nothing there.
        yields: Whether it steps aside, or follows, where a child bars its way, and keeps out of the children's way when
            there is nothing to do. One that does not stays where it is.
        needs_pictures: Whether it asks for a percept's `frames`, for which its house must be made: it acts in no grid.
        pace: How long it takes for what it does. Its world enters it before the first `reset` there.
        sight: What it sees children with. Its world enters that likewise.
        followers: Whoever comes after it wherever it goes. It then protects nobody from anything, but stays away from
            hazards. Left out by a caregiver that does not care.
        serves: What stands for the episodes that it serves now. Its world enters it after `reset`, to see whether
            another world has begun some with it meanwhile.
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
            batch: B.
            seeds: A seed for each episode, for caregivers that draw lots: an episode must not depend on its batch.
            children: K, how many children there are in each.
        """

    def prepare(self, candle_table: np.ndarray) -> np.ndarray:
        """Make the house safe before the children come in; asked after `reset`, at the start of every episode.

        Args:
            candle_table: Index of the table on which each candle stands in the floor plan, (B, candles).

        Returns:
            Index of that on which it shall stand when the episode begins, likewise.
        """
        return candle_table

    def watch(self, percept: Percept) -> None:
        """Take in the children's last moves. Called once a novice timestep."""
        if self.followers:
            self.followers.watch(percept)

    @abc.abstractmethod
    def choose(self, percept: Percept) -> np.ndarray:
        """Choose the hazard to protect the children from now, (B,), or NOTHING."""

    def decide(self, percept: Percept) -> Interventions:
        """Say what to do now. Called as often as the world likes."""
        return self.protect(percept, self.choose(percept))

    def assess(self, percept: Percept) -> Assessment | None:
        """Return the numbers behind a decision; None for a caregiver that has no such numbers."""
        return None

    # -- What most caregivers share --------------------------------------------------------------

    @property
    def idle_verb(self) -> str:
        """What it does when there is nothing to do."""
        return STAND_ASIDE if self.yields else DO_NOTHING

    def protect(self, percept: Percept, hazard: np.ndarray) -> Interventions:
        """Return interventions that protect the children from hazards (B,); make room, or stay, where it is NOTHING."""
        hazards, who = self.plan.hazards, f"{type(self).__name__}.choose must answer with"
        hazard = check_numbers(who, hazard, len(percept.child_cell), NOTHING, len(hazards) - 1)
        if self.followers is not None:
            hazard = np.where(self.followers.there, NOTHING, hazard)
        verb = np.append(hazards.verb, self.idle_verb)[hazard]  # the last one is for NOTHING
        candle, destination = hazards.among(Where.ON_TABLE, hazard), np.full(len(hazard), NOTHING)
        if (candle != NOTHING).any():
            destination = np.where(candle != NOTHING, self.destination(percept, candle), NOTHING)
        return Interventions(verb, hazard, destination)

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        """Choose where a candle shall go: the bare table farthest, on foot, from the child that is nearest to it.

        Args:
            percept: What is seen at the moment of the choice.
            candle: Index of the candle for each world, (B,).

        Returns:
            Table indices (B,).
        """
        distance = self.table_distances[percept.child_cell].min(axis=1)
        return np.where(bare_tables(percept.candle_table, len(self.plan.tables)), distance, -np.inf).argmax(axis=1)

    def worth_protecting(self, percept: Percept) -> np.ndarray:
        """Return which hazards the caregiver can do something about, bool (B, hazards).

        Every stairwell, every candle that would be farther from the nearest child on a bare table than where it is, and
        everything that still lies on the floor; but none that is out of reach.
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

        Infinite for one that is carried, or gone. A child collides with what is on the floor by stepping into its cell,
        if it is not in there already.
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

    Scores that only rounding tells apart count as equal.

    Args:
        score: A number of at least 0 for each hazard, (B, hazards).
    """
    if score.shape[1] == 0:
        return np.full(len(score), NOTHING), np.zeros(len(score))
    greatest = score.max(axis=1)
    return (score >= greatest[:, None] * (1 - 1e-9)).argmax(axis=1), greatest


def answer(caregiver: Caregiver, percept: Percept) -> Interventions:
    """Return what a caregiver decides, checked.

    Raises:
        CaregiverError: It is nothing that could be done in B worlds of its house.
    """
    given, batch, who = caregiver.decide(percept), len(percept.child_cell), f"{type(caregiver).__name__}.decide"
    if not isinstance(given, Interventions) or np.shape(given.verb) != (batch,):
        raise CaregiverError(f"{who} must answer with Interventions for {batch} worlds, got {given!r}")
    hazards = caregiver.plan.hazards
    check_numbers(f"{who}: hazard must be", given.hazard, batch, NOTHING, len(hazards) - 1)
    _check_kinds(who, hazards, given)
    to_table = np.any([np.asarray(given.verb) == name for name, verb in VERBS.items() if verb.to_table], axis=0)
    moved = np.where(to_table, given.destination, NOTHING)
    check_numbers(f"{who}: destination must be", moved, batch, NOTHING, len(caregiver.plan.tables) - 1)
    cells = len(caregiver.plan.caregiver_cells) if caregiver.waits else 0
    waits = np.where(np.asarray(given.verb) == DO_NOTHING, given.destination, NOTHING)
    check_numbers(f"{who}: destination of '{DO_NOTHING}' must be", waits, batch, NOTHING, cells - 1)
    return given


def _check_kinds(who: str, hazards: Hazards, given: Interventions) -> None:
    """Raise CaregiverError unless verbs are about hazards that they act on."""
    for name, where in ((name, verb.where) for name, verb in VERBS.items() if verb.where):
        numbers = np.asarray(given.hazard)[np.asarray(given.verb) == name]
        if not numbers.size:
            continue
        at = [kind for kind in kinds_at(where) if kind.verb == name] or kinds_at(where)
        right = [number for number, kind in enumerate(hazards.kinds) if kind in at]
        wrong = numbers[(numbers[:, None] != right).all(axis=1)]
        if wrong.size:
            kinds = " or ".join(kind.name for kind in at)
            raise CaregiverError(
                f"{who}: '{name}' must be for a {kinds}, {right or 'of which there is none'}, got hazard {wrong[0]}"
            )


def check_numbers(what: str, numbers: np.ndarray, batch: int, least: int, most: int) -> np.ndarray:
    """Return an array (B,), or raise CaregiverError unless it is one of integers from least to most."""
    numbers = np.asarray(numbers)
    if numbers.shape != (batch,) or not np.issubdtype(numbers.dtype, np.integer):
        raise CaregiverError(f"{what} {batch} integers, got {numbers!r}")
    if ((numbers < least) | (numbers > most)).any():
        raise CaregiverError(f"{what} {least} to {most}, got {numbers}")
    return numbers


def starting_tables(plan: FloorPlan, caregiver: Caregiver | None, batch: int = 1) -> np.ndarray:
    """Return where the candles stand at first: as in the floor plan, or where the caregiver has put them before.

    Args:
        plan: The house.
        caregiver: Who protects the children; it has been reset for as many episodes. None if nobody does.
        batch: Number of episodes.

    Returns:
        Table indices, (episodes, candles).

    Raises:
        CaregiverError: The caregiver's are none.
    """
    as_planned = np.tile(np.array(plan.candle_tables, int), (batch, 1))
    if caregiver is None:
        return as_planned
    tables = np.asarray(caregiver.prepare(as_planned.copy()))
    who, last = f"{type(caregiver).__name__}.prepare", len(plan.tables) - 1
    if tables.shape != as_planned.shape or not np.issubdtype(tables.dtype, np.integer):
        raise CaregiverError(f"{who} must answer with integers of shape {as_planned.shape}, got {tables!r}")
    if ((tables < 0) | (tables > last)).any() or (np.diff(np.sort(tables, axis=1), axis=1) == 0).any():
        raise CaregiverError(f"{who} must give each candle a table of its own, 0 to {last}, got {tables}")
    return tables

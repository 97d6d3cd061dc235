"""Watches children in one house: what was predicted of each before every move, and what became of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.child_model import child_chain
from caregiver_mj.caregivers.foresight.foresight import CHANGE
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.children.family import Family
from caregiver_mj.children.side_by_side import side_by_side
from caregiver_mj.children.tape import Tape
from caregiver_mj.danger.belief import Belief
from caregiver_mj.danger.chain import ChildChain
from caregiver_mj.danger.passage import first_passage
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING


@dataclasses.dataclass(frozen=True, eq=False)
class Questions:
    """What is asked of a house's future: whether the child bumps into this or that.

    Attributes:
        kinds: What each question is about, (Q,): "stairwell", "candle" (a table that bears one) or "table" for one of
            them; "any stairwell", "any candle" or "anything".
        groups: Which objects each takes together, bool (objects, Q).
    """

    kinds: np.ndarray
    groups: np.ndarray

    @classmethod
    def of(cls, plan: FloorPlan) -> Questions:
        """Those of a house in which the candles stay where they are."""
        stairwells = len(plan.stairwells)
        kinds = np.array(["stairwell"] * stairwells + ["table"] * len(plan.tables), object)
        kinds[stairwells + np.array(plan.candle_tables, int)] = "candle"
        any_of = [kinds == "stairwell", kinds == "candle", np.ones(len(kinds), bool)]
        names = ["any stairwell", "any candle", "anything"]
        groups = np.concatenate([np.eye(len(kinds), dtype=bool), np.stack(any_of, axis=1)], axis=1)
        return cls(np.concatenate([kinds, names]), groups)


@dataclasses.dataclass(frozen=True, eq=False)
class Watched:
    """N children watched for T timesteps; time t is before move t, when moves 0 to t - 1 have been seen.

    Attributes:
        predicted: Probability of a bump within each horizon, from each time on, (horizons, T, N, Q).
        possible: Whether there can be one at all in that time, whatever the child does, likewise.
        bumped: Whether each move bumped, (T, N, Q).
        safe: P(safe|tau) of the paper, (T, N).
    """

    predicted: np.ndarray
    possible: np.ndarray
    bumped: np.ndarray
    safe: np.ndarray

    def happened(self, timesteps: int) -> np.ndarray:
        """Whether there was a bump within some timesteps, at every time from which so many were seen.

        Returns:
            bool (T - timesteps + 1, N, Q).
        """
        count = np.concatenate([np.zeros((1, *self.bumped.shape[1:]), int), self.bumped.cumsum(axis=0)])
        return count[timesteps:] > count[:-timesteps]


def watch_children(
    plan: FloorPlan,
    families: Sequence[Family],
    tapes: Sequence[Sequence[Tape]],
    horizons: Sequence[int],
    caregiver: Caregiver | None = None,
    change: float = CHANGE,
) -> Watched:
    """Watches children of several kinds, as many episodes of each.

    Args:
        plan: The house.
        families: Only children.
        tapes: The chance of every episode, the same for each of them.
        horizons: In how many timesteps something may happen.
        caregiver: Who is beside them.
        change: Probability, in a timestep, that an epsilon is thought to change.
    """
    world = GridWorld(plan, side_by_side(plan, families, len(tapes)), caregiver)
    world.reset([*tapes] * len(families))
    timesteps, batch = len(tapes[0][0].steps), len(tapes) * len(families)
    chain, questions = child_chain(plan), Questions.of(plan)
    passages = [_by_cell(chain, first_passage(chain, horizon, questions.groups)) for horizon in horizons]
    belief, rule = Belief(chain, batch, 1, change), PaperCaregiver(plan)
    rule.reset(batch)
    shape = timesteps, batch, len(questions.kinds)
    predicted = np.empty((len(horizons), *shape), np.float32)
    possible, bumped = np.empty(predicted.shape, bool), np.empty(shape, bool)
    safe = np.empty(shape[:2])
    for time in range(timesteps):
        cell, safe[time] = world.child_cell[:, 0], rule.assess(world.percept()).safe[:, 0]
        probability = belief.probability.reshape(batch, 1, -1)
        for number, passage in enumerate(passages):
            predicted[number, time] = (probability @ passage[cell])[:, 0]
            possible[number, time] = np.any(passage > 0, axis=1)[cell]
        world.step()
        percept = world.percept()
        bumped[time] = _bumps(chain, percept.previous_cell[:, 0], percept.previous_action[:, 0]) @ questions.groups
        belief.watch(percept.previous_cell, percept.previous_action, percept.caregiver_cell)
        rule.watch(percept)
    return Watched(predicted, possible, bumped, safe)


def _by_cell(chain: ChildChain, values: np.ndarray) -> np.ndarray:
    """Values of states (states, Q) as (cells, states of a cell, Q)."""
    return values.reshape(chain.shape[0], -1, values.shape[1])


def _bumps(chain: ChildChain, cell: np.ndarray, move: np.ndarray) -> np.ndarray:
    """Which object each child has just bumped into, bool (N, objects)."""
    bumped = np.where(move == NOTHING, NOTHING, chain.object_at[cell, move])
    return bumped[:, None] == np.arange(chain.objects)

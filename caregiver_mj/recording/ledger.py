"""Episodes in both worlds: `Rollout` is their only loop, `Ledger` their only account."""

from __future__ import annotations

import abc
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from caregiver_mj.children.rules import DENIED
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import KINDS
from caregiver_mj.recording.contacts import COUNTED
from caregiver_mj.recording.record import DAMAGE_THRESHOLD

SPENT = ("looking", "guarding", "handling")  # activities of a caregiver
BLOCKED = tuple(target.name.lower() for target in DENIED)  # targets of moves that the caregiver blocked
MET = ("entered", "entered_blocked", "held_up")  # other encounters with the caregiver; see `EpisodeRecord`


class Ledger:
    """The account of a batch of B episodes with K children each. Worlds report through its methods only.

    Attributes:
        timestep: Novice timesteps booked so far.
        harm: Damage of each kind that each child has taken, (B, K, kinds), in the order of `KINDS`.
        toys: Toy bins that each child has reached, (B, K).
        moves_blocked: Moves of each child into the caregiver, by target, (B, K, targets), in the order of `BLOCKED`.
        moves_met: Moves of each child that met the caregiver otherwise, (B, K, kinds), in the order of `MET`.
        longest_blocked: Most consecutive timesteps in which each child was blocked, (B, K).
        interventions: Interventions begun, (B,).
        interventions_done: Interventions completed, (B,).
        seen: Timesteps in which each child was seen, (B, K).
        spent: Timesteps that the caregiver spent on each of `SPENT`, (B, 3).
        candles_dropped: Candles that fell, (B,).
        stopped_at: Timestep in which the damage exceeded the threshold, (B,); 0 if it did not.
        damage_until_stop: Damage up to and including that timestep, else all damage, (B,).
        visits: Timesteps that children ended in each free cell, (B, free cells).
        damage_at: Damage to children in each free cell, (B, free cells).
    """

    def __init__(self, plan: FloorPlan, cells: np.ndarray, timesteps: int):
        """Begin B episodes of a number of timesteps, with children in free cells (B, K)."""
        batch, children = cells.shape
        self._timesteps = timesteps
        self.timestep = 0
        self.harm = np.zeros((batch, children, len(KINDS)))
        self.toys, self.longest_blocked, self._blocked_since = np.zeros((3, batch, children), int)
        self.moves_blocked = np.zeros((batch, children, len(BLOCKED)), int)
        self.moves_met = np.zeros((batch, children, len(MET)), int)
        self.interventions, self.interventions_done = np.zeros((2, batch), int)
        self.seen, self.spent = np.zeros((batch, children), int), np.zeros((batch, len(SPENT)), int)
        self.candles_dropped = np.zeros(batch, int)
        self.stopped_at, self.damage_until_stop = np.zeros(batch, int), np.zeros(batch)
        self._visited = np.zeros((batch, len(plan.free_cells)), bool)
        self._visited[np.arange(batch)[:, None], cells] = True
        self.visits, self.damage_at = np.zeros((2, batch, len(plan.free_cells)))
        self._each = np.arange(batch)

    def book(
        self,
        begun: np.ndarray,
        ended: np.ndarray,
        harm: np.ndarray,
        toys: np.ndarray,
        blocked: np.ndarray,
        met: np.ndarray | int = 0,
    ) -> None:
        """Book one novice timestep.

        Args:
            begun: Free cells of the children at its start, (B, K).
            ended: Free cells of the children at its end, (B, K).
            harm: Damage of each kind that each child took, (B, K, kinds).
            toys: Whether each child reached its toy bin, (B, K).
            blocked: Whether the caregiver blocked each child, by the target of its move, (B, K, `BLOCKED`).
            met: Other encounters of each child with the caregiver, (B, K, `MET`); 0 for none.
        """
        self.timestep += 1
        self.harm += harm
        self.toys += toys
        self.moves_blocked += blocked
        self.moves_met += met
        self._blocked_since = np.where(blocked.any(axis=2), self._blocked_since + 1, 0)
        self.longest_blocked = np.maximum(self.longest_blocked, self._blocked_since)
        for child in range(begun.shape[1]):
            self.damage_at[self._each, begun[:, child]] += harm[:, child].sum(axis=1)
            self.visits[self._each, ended[:, child]] += 1
        running = np.flatnonzero(self.stopped_at == 0)
        self._visited[running[:, None], ended[running]] = True
        damage = self.damage
        self.damage_until_stop[running] = damage[running]
        self.stopped_at[(self.stopped_at == 0) & (damage > DAMAGE_THRESHOLD)] = self.timestep

    def intervene(self, begun: np.ndarray | int, done: np.ndarray | int) -> None:
        """Count interventions begun and completed, (B,)."""
        self.interventions += begun
        self.interventions_done += done

    def attend(self, seen: np.ndarray | int, spent: np.ndarray | int = 0) -> None:
        """Count for a novice timestep the children seen, (B, K), and the shares of activities, (B, `SPENT`)."""
        self.seen += seen
        self.spent += spent

    def drop(self, candles: int) -> None:
        """Count candles that have fallen."""
        self.candles_dropped += candles

    @property
    def damage(self) -> np.ndarray:
        """Damage so far, (B,)."""
        return self.harm.sum(axis=(1, 2))

    @property
    def strikes(self) -> np.ndarray:
        """Zeros, (B,): the grid has no strikes, and in the house `Contacts` counts them."""
        return np.zeros(len(self.seen), int)

    def totals(self) -> dict[str, np.ndarray]:
        """Return the measures of every episode so far, over its children, (B,) each, by column of `EpisodeRecord`."""
        by_kind = self.harm.sum(axis=1).T
        return {
            "damage": self.damage,
            **{f"damage_{kind.name}": damage for kind, damage in zip(KINDS, by_kind, strict=True)},
            "damage_until_stop": self.damage_until_stop,
            "stopped": (self.stopped_at > 0).astype(int),
            "timesteps_to_threshold": np.where(self.stopped_at > 0, self.stopped_at, self._timesteps),
            "cells_visited": self._visited.sum(axis=1),
            "toys_reached": self.toys.sum(axis=1),
            "moves_blocked": self.moves_blocked.sum(axis=(1, 2)),
            **{f"moves_blocked_{what}": self.moves_blocked[..., i].sum(axis=1) for i, what in enumerate(BLOCKED)},
            "longest_blocked": self.longest_blocked.max(axis=1),
            **{f"moves_{how}": self.moves_met[..., i].sum(axis=1) for i, how in enumerate(MET)},
            "interventions": self.interventions,
            "interventions_done": self.interventions_done,
            "seen": self.seen.mean(axis=1) / max(1, self.timestep),
            **{what: self.spent[:, i] / max(1, self.timestep) for i, what in enumerate(SPENT)},
            "candles_dropped": self.candles_dropped,
            **{name: np.zeros(len(self.seen), kind) for name, kind in COUNTED.items()},  # see `Contacts`
        }

    def by_child(self) -> dict[str, np.ndarray]:
        """Return the measures of each child so far, (B, K) each, by column of `EpisodeRecord`."""
        return {"damage_by_child": self.harm.sum(axis=2), "toys_by_child": self.toys.astype(float)}

    def outcomes(self) -> list[dict[str, Any]]:
        """Return the measures of each episode so far, also of each child, by column of `EpisodeRecord`."""
        columns = {name: values.tolist() for name, values in (self.totals() | self.by_child()).items()}
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]

    def outcome(self) -> dict[str, Any]:
        """Return `outcomes` of the first episode."""
        return self.outcomes()[0]


class Rollout(abc.ABC):
    """A run of episodes: one in the house, a batch in the grid.

    `run_on` is the only loop over an episode. Data sets and logs of answers observe it, films and viewers run it from
    picture to picture, and Gymnasium environments, whose actions come from outside, drive it step by step.

    Attributes:
        observers: Called with the rollout at the start and after every step. They must change nothing.
        ledger: Account of the episodes.
    """

    observers: Sequence[Callable[[Any], None]] = ()
    ledger: Ledger

    @property
    @abc.abstractmethod
    def over(self) -> bool:
        """Whether its episodes are over."""

    @abc.abstractmethod
    def step(self) -> None:
        """Run one step: a control step in the house, a novice timestep in the grid."""

    @abc.abstractmethod
    def outcomes(self) -> list[dict[str, Any]]:
        """Return the measures of each episode, by column."""

    def notify(self) -> None:
        """Call the observers."""
        for observer in self.observers:
            observer(self)

    def run_on(self, until: Callable[[], bool] = lambda: False) -> bool:
        """Run until a condition holds; return False if the episodes end before."""
        while not until():
            if self.over:
                return False
            self.step()
            self.notify()
        return True

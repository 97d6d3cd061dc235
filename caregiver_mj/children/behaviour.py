"""The moves of children: how a behaviour chooses them, and what they meet in both worlds."""

from __future__ import annotations

import abc
import dataclasses
import functools
import inspect
import numbers
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from caregiver_mj.children.random_stream import pick
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import ACTIONS, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

_OWN = __name__.partition(".")[0]


@dataclasses.dataclass(frozen=True)
class ChildPercept:
    """Observation of a child before its move, in B episodes."""

    cell: np.ndarray  #: index of its free cell, (B,)
    goal: np.ndarray  #: index of its toy bin, (B,)
    caregiver_cell: np.ndarray  #: the caregiver's cell, or NOTHING without one, (B,)
    bumped: np.ndarray  #: whether its last move left it in its cell, unless it chose to stay, (B,)

    def of(self, share: slice) -> ChildPercept:
        """Return the percept of a part of the batch."""
        return ChildPercept(self.cell[share], self.goal[share], self.caregiver_cell[share], self.bumped[share])


class Behaviour(abc.ABC):
    """Chooses the moves of one child in a batch of episodes; the given draws are its only randomness."""

    def __init_subclass__(cls, **options: Any) -> None:
        """Check the methods' results if the class belongs to another package."""
        super().__init_subclass__(**options)
        for name in ("act", "epsilons", "reconsider", "next_bin"):
            method = cls.__dict__.get(name)
            if inspect.isfunction(method) and cls.__module__.partition(".")[0] != _OWN:
                setattr(cls, name, _checked(name, method))

    def __init__(self, plan: FloorPlan, epsilon: float):
        """Prepare a behaviour for a house; raise CaregiverError unless epsilon is in [0, 1]."""
        self.plan = plan
        self.epsilon = check_epsilon(epsilon)

    def reset(self, batch: int) -> None:  # noqa: B027 (most remember nothing)
        """Begin B new episodes."""

    @abc.abstractmethod
    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        """Choose the moves.

        Args:
            sight: The observations.
            draws: Uniform draws, (B, 3): the first two for the move, the last for the next bin.

        Returns:
            Indices into `ACTIONS`, or NOTHING to stay, (B,).
        """

    def epsilons(self, batch: int) -> np.ndarray:
        """Return the share of random moves, (B,); if it changes, that of the next move."""
        return np.full(batch, self.epsilon)

    def reconsider(self, goal: np.ndarray, draw: np.ndarray) -> np.ndarray:
        """Return the present toy bins, (B,), given the previous ones and uniform draws for the next, (B,) each.

        Called before every move: a child may change its goal before it arrives.
        """
        return goal

    def next_bin(self, draw: np.ndarray) -> np.ndarray:
        """Return the next toy bins, (B,), from uniform draws, (B,); uniform over all bins."""
        return pick(draw, len(self.plan.bins))


def _checked(name: str, method: Callable[..., Any]) -> Callable[..., np.ndarray]:
    """Wrap a method so that it raises CaregiverError unless it returns valid moves, bins or shares, (B,)."""

    @functools.wraps(method)
    def checked(self: Behaviour, *given: Any, **named: Any) -> np.ndarray:
        answer, (asked, *_) = np.asarray(method(self, *given, **named)), (*given, *named.values())
        batch = asked if name == "epsilons" else len(asked.cell if name == "act" else asked)
        bins = "iu", 0, len(self.plan.bins) - 1  # dtype kinds, least and greatest value
        kinds, low, most = {"act": ("iu", NOTHING, len(ACTIONS) - 1), "epsilons": ("iuf", 0, 1)}.get(name, bins)
        fits = answer.shape == (batch,) and answer.dtype.kind in kinds
        wrong = answer[~((answer >= low) & (answer <= most))] if fits else answer  # also NaN
        if fits and not wrong.size:
            return answer
        got = f"{wrong[0]} among them" if fits else repr(wrong.tolist())
        raise CaregiverError(
            f"{type(self).__name__}.{name} must answer with {batch} {'numbers' if 'f' in kinds else 'integers'}, "
            f"{low} to {most}, got {got}"
        )

    return checked


def check_epsilon(epsilon: float) -> float:
    """Return epsilon as a float; raise CaregiverError unless it is in [0, 1]."""
    if not isinstance(epsilon, numbers.Real) or not 0.0 <= epsilon <= 1.0:  # also rejects NaN
        raise CaregiverError(f"epsilon must be in [0, 1], got {epsilon!r}")
    return float(epsilon)


DENIED = Target.STAIRWELL, Target.FREE  # targets that a caregiver in them blocks


class Way(NamedTuple):
    """The targets of moves, (...) each."""

    next_cell: np.ndarray  # free cell after an unobstructed move; the present one for a bump or no move
    target: np.ndarray  # the `Target`, or NOTHING for no move
    number: np.ndarray  # number of the target among stairwells, tables or bins, or NOTHING
    entered: np.ndarray  # caregiver cell to enter, or NOTHING

    def waits(self, others: np.ndarray) -> np.ndarray:
        """Return whether another child's free cell, (..., n), is in the way."""
        return (self.target == Target.FREE) & (self.next_cell[..., None] == others).any(axis=-1)

    def meets(self, caregiver_cell: np.ndarray | int) -> np.ndarray:
        """Return whether the caregiver is in the way; NOTHING stands for none."""
        return (self.entered == caregiver_cell) & (self.entered != NOTHING)

    def reaches(self, goal: np.ndarray | int) -> np.ndarray:
        """Return whether the move reaches the toy bin with this number."""
        return (self.target == Target.BIN) & (self.number == goal)


class MoveRules:
    """The moves of children in a house."""

    def __init__(self, plan: FloorPlan):
        self._moves, self._free = plan.graph.moves, len(plan.free_cells)

    def way(self, cell: np.ndarray | int, action: np.ndarray | int) -> Way:
        """Return the targets of moves, indices into `ACTIONS` or NOTHING, from free cells, (...) each."""
        stays = np.equal(action, NOTHING)
        next_cell, target, index = (table[cell, action] for table in self._moves)
        next_cell, target = np.where(stays, cell, next_cell), np.where(stays, NOTHING, target)
        # Landings follow the free cells; the cell behind a gate is no caregiver cell.
        stairwell = np.where(target == Target.STAIRWELL, self._free + index, NOTHING)
        entered = np.where(target == Target.FREE, next_cell, stairwell)
        return Way(next_cell, target, np.where(stays, NOTHING, index), entered)


def denied(target: np.ndarray | int, blocked: np.ndarray | bool) -> np.ndarray:
    """Return whether each of `DENIED` was denied, bool (..., 2), from targets and whether moves were blocked."""
    return np.stack([np.asarray(blocked & (target == one)) for one in DENIED], axis=-1)

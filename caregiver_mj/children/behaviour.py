"""Who decides the moves of a child: what a behaviour is asked, and the behaviours by name."""

from __future__ import annotations

import abc
import dataclasses
import functools
import inspect
import numbers
from collections.abc import Callable
from typing import Any

import numpy as np

from caregiver_mj.children.random_stream import pick
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import ACTIONS
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

_OWN = __name__.partition(".")[0]


@dataclasses.dataclass(frozen=True)
class ChildPercept:
    """What one child each of B families knows when it chooses its move."""

    cell: np.ndarray  #: index of its free cell, (B,)
    goal: np.ndarray  #: index of the toy bin that it is to go to, (B,)
    caregiver_cell: np.ndarray  #: the caregiver's cell, (B,), or NOTHING where there is none
    bumped: np.ndarray  #: whether its last move left it where it was, (B,); not if it meant to stay there

    def of(self, share: slice) -> ChildPercept:
        """Return that of a part of the batch."""
        return ChildPercept(self.cell[share], self.goal[share], self.caregiver_cell[share], self.bumped[share])


class Behaviour(abc.ABC):
    """Decides the moves of one child, for a batch of families at once.

    All its chance comes from the draws that it is given, so that an episode is the same whatever runs beside it.
    """

    def __init_subclass__(cls, **options: Any) -> None:
        """Have the answers of a class of another package looked at, whatever world asks for them."""
        super().__init_subclass__(**options)
        for name in ("act", "epsilons", "reconsider", "next_bin"):
            method = cls.__dict__.get(name)
            if inspect.isfunction(method) and cls.__module__.partition(".")[0] != _OWN:
                setattr(cls, name, _checked(name, method))

    def __init__(self, plan: FloorPlan, epsilon: float):
        """Prepare a behaviour for a house, with a share of moves that are random.

        Raises:
            CaregiverError: Epsilon is not in [0, 1].
        """
        self.plan = plan
        self.epsilon = check_epsilon(epsilon)

    def reset(self, batch: int) -> None:  # noqa: B027 (most remember nothing)
        """Begin B new episodes."""

    @abc.abstractmethod
    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        """Choose the moves.

        Args:
            sight: What the children know.
            draws: Uniform draws, (B, 3): the first two are for the move, the last one for the next bin.

        Returns:
            Indices into `ACTIONS`, (B,), or NOTHING for a child that stays where it is.
        """

    def epsilons(self, batch: int) -> np.ndarray:
        """Return the share of random moves in each of B episodes, (B,): that of the next move, if it changes."""
        return np.full(batch, self.epsilon)

    def reconsider(self, goal: np.ndarray, draw: np.ndarray) -> np.ndarray:
        """Return the bins to go to now, by those they were going to and uniform draws for the next one, (B,) all.

        It is asked before every move: a child may want another one before it arrives.
        """
        return goal

    def next_bin(self, draw: np.ndarray) -> np.ndarray:
        """Return bins to go to next (B,), uniform over all bins, from uniform draws (B,)."""
        return pick(draw, len(self.plan.bins))


def _checked(name: str, method: Callable[..., Any]) -> Callable[..., np.ndarray]:
    """The method of a behaviour that raises CaregiverError unless it answers with moves, bins or shares, (B,)."""

    @functools.wraps(method)
    def checked(self: Behaviour, *given: Any, **named: Any) -> np.ndarray:
        answer, (asked, *_) = np.asarray(method(self, *given, **named)), (*given, *named.values())
        batch = asked if name == "epsilons" else len(asked.cell if name == "act" else asked)
        bins = "iu", 0, len(self.plan.bins) - 1  # kinds of NumPy, and from where to where
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
    """Return epsilon, or raises CaregiverError unless it lies in [0, 1]."""
    if not isinstance(epsilon, numbers.Real) or not 0.0 <= epsilon <= 1.0:  # also refuses NaN
        raise CaregiverError(f"epsilon must be in [0, 1], got {epsilon!r}")
    return float(epsilon)

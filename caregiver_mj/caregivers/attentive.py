"""Attentive caregivers: they act only while they look, for a share of the time, in bouts."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.interventions.verb import Interventions

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

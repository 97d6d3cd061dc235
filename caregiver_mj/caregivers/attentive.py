"""Attentive caregivers: as another one, but they act only while they look, a share of the time and in bouts."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.interventions.verb import Interventions

# Timesteps; mean of a bout of looking, 10 s. An assumption: no measurement of parents at home is known.
BOUT = 6.0
_OWN_STREAM = 1  # apart from the draws of a random caregiver


class Attentive(Caregiver):
    """Mixin before a caregiver, which then acts only while it looks.

    Whether it looks is a Markov chain with the given share and mean bout, in the long run already at the start. It
    keeps seeing the children meanwhile, and a candle in the hand is put down all the same; else it stands aside.

    Attributes:
        share: Share of the time; one for all episodes, or (B,).
        bout: Mean of a bout of looking, timesteps.
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
        aside.destination[:] = percept.caregiver_cell  # with one it ends what the robot is about; just to idle does not
        return super().decide(percept).where(looking, aside)


@functools.cache
def attentive(share: float, caregiver: type[Caregiver]) -> type[Attentive]:
    """Return the class of a caregiver that acts as another one does for a share of the time."""
    details = {"share": share, "__doc__": Attentive.__doc__, "__module__": caregiver.__module__}
    return type(f"Attentive{caregiver.__name__}", (Attentive, caregiver), details)


def looks(draws: np.ndarray, share: float | np.ndarray, bout: float) -> np.ndarray:
    """Return whether it looks in each timestep, bool (B, T), by uniform draws, (B, T), and the share of each, (B,).

    A bout of looking ends with probability 1 / bout; one of not looking lasts so long that the share is as given. It
    lasts a timestep at least, so that of shares above bout / (bout + 1) those of looking are longer.
    """
    share, tiny = np.broadcast_to(share, len(draws)), np.finfo(float).tiny
    ends = np.minimum(1.0 / bout, (1.0 - share) / np.maximum(share, tiny))
    goes_on, begins = 1.0 - ends, np.minimum(1.0, share * ends / np.maximum(1.0 - share, tiny))
    found = draws < share[:, None]  # at the start; later ones follow from those before
    for now in range(1, draws.shape[1]):
        found[:, now] = draws[:, now] < np.where(found[:, now - 1], goes_on, begins)
    return found

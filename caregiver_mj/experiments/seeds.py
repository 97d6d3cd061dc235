"""Seeds: what makes episode i of a run the same under every caregiver, with every family and in both worlds."""

from __future__ import annotations

import numpy as np

from caregiver_mj.children.tape import Tape


def episode_seed(seed: int, episode: int) -> int:
    """The seed of an episode, by the run's seed and the episode's number alone."""
    return int(np.random.SeedSequence([seed, episode]).generate_state(1)[0])


def episode_random(seed: int) -> np.random.RandomState:
    """The source of all chance in the episode of a seed; the house draws more from it than the grid."""
    return np.random.RandomState(seed)


def episode_tapes(seed: int, children: int) -> tuple[Tape, ...]:
    """What is drawn of it first in both worlds: the chance of the children."""
    return Tape.draw_family(episode_random(seed), children)

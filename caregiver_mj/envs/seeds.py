"""Which episode an environment begins."""

from __future__ import annotations

import numpy as np

from caregiver_mj.errors import CaregiverError

_SEEDS = 2**32  # as many as a `RandomState` takes


def episode_seed(seed: int | None, random: np.random.Generator) -> int:
    """The seed of the next episode: the one that is asked for, or else one that is drawn.

    What is drawn depends on what was drawn before, but not on what happened in these episodes.

    Raises:
        CaregiverError: There is no episode of that seed.
    """
    if seed is None:
        return int(random.integers(_SEEDS))
    if not 0 <= seed < _SEEDS:
        raise CaregiverError(f"the seed of an episode is 0 to {_SEEDS - 1}, not {seed}")
    return int(seed)

"""What environments share: Gymnasium's spaces of what is observed and done, the cost, and seeds."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from gymnasium import spaces

from caregiver_mj.caregivers.target_observation import Encoder
from caregiver_mj.errors import LARGEST_SEED, CaregiverError, check_integer

STRIKE_COST = 1.0  # of a contact with a part of the robot that moves towards the child, beside what comes of it


def observation_space(encoder: Encoder) -> spaces.Space[Any]:
    """Return the space of the observations of one world: a dictionary, or a plain box where they are flat."""
    keys = spaces.Dict({key: spaces.Box(0, 1, shape, np.float32) for key, shape in encoder.shapes.items()})
    if "edges" in keys.spaces:
        keys["edges"] = spaces.Box(0, encoder.shapes["node_mask"][0] - 1, encoder.shapes["edges"], np.int64)
    return spaces.flatten_space(keys) if encoder.observation == "flat" else keys


class CostMeter:
    """Reads what each step of an episode has cost: the damage to the children, and `STRIKE_COST` for every strike.

    Over the episode that is its `damage` and its `strikes`, as in the tables.
    """

    def __init__(self, harmed: Any):
        """Take what has all `damage` to the children in an episode so far, and all `strikes`; or those of a batch."""
        self._harmed = harmed
        self._damage: float | np.ndarray = 0.0
        self._strikes: int | np.ndarray = 0

    def read(self) -> dict[str, Any]:
        """Return what has come since it was last read: `cost`, and of that `damage` and the number of `strikes`."""
        damage, strikes = self._harmed.damage - self._damage, self._harmed.strikes - self._strikes
        self._damage, self._strikes = self._harmed.damage, self._harmed.strikes
        return {"cost": damage + STRIKE_COST * strikes, "damage": damage, "strikes": strikes}


Seed: TypeAlias = "int | np.random.Generator | np.random.RandomState | None"


def plain_seed(seed: Seed) -> int | None:
    """Return a seed as Gymnasium takes it: NumPy's integer as Python's, of a source of randomness one that it draws."""
    if isinstance(seed, np.random.Generator):
        return int(seed.integers(LARGEST_SEED + 1))
    if isinstance(seed, np.random.RandomState):
        return int(seed.randint(LARGEST_SEED + 1, dtype=np.int64))
    return int(seed) if isinstance(seed, np.integer) else seed


def episode_seed(seed: int | None, random: np.random.Generator) -> int:
    """Return the seed of the next episode: the one that is asked for, or else one that is drawn.

    What is drawn depends on what was drawn before, but not on what happened in these episodes.

    Raises:
        CaregiverError: There is no episode of that seed.
    """
    if seed is None:
        return int(random.integers(LARGEST_SEED + 1))
    check_integer("the seed of an episode", seed, 0, LARGEST_SEED)
    return int(seed)


def check_render_mode(mode: str | None) -> None:
    """Raise CaregiverError unless it is "rgb_array" or None."""
    if mode == "human":
        raise CaregiverError(
            "no render mode 'human', which needs a window: take rgb_array, and caregiver_mj.envs.film.RecordFilm "
            "for a film; `caregiver-mj view` opens a window"
        )
    if mode not in (None, "rgb_array"):
        raise CaregiverError(f"no render mode '{mode}': there is rgb_array")

"""Common parts of the environments: spaces, cost, and seeds."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from gymnasium import spaces

from caregiver_mj.caregivers.target_observation import Encoder
from caregiver_mj.errors import LARGEST_SEED, CaregiverError, check_integer

STRIKE_COST = 1.0  # cost of a strike, in addition to damage


def observation_space(encoder: Encoder) -> spaces.Space[Any]:
    """Return the space of the observations of one world: a dictionary, or a box if they are flat."""
    keys = spaces.Dict({key: spaces.Box(0, 1, shape, np.float32) for key, shape in encoder.shapes.items()})
    if "edges" in keys.spaces:
        keys["edges"] = spaces.Box(0, encoder.shapes["node_mask"][0] - 1, encoder.shapes["edges"], np.int64)
    return spaces.flatten_space(keys) if encoder.observation == "flat" else keys


class CostMeter:
    """Meters the cost of each step: the damage to the children, and `STRIKE_COST` for every strike.

    The sums over an episode are the columns `damage` and `strikes`, and the damage of a move that its end cut off.
    """

    def __init__(self, harmed: Any):
        """Take an object with the total `damage` and `strikes` of an episode, or of a batch, so far."""
        self._harmed = harmed
        self._damage: float | np.ndarray = 0.0
        self._strikes: int | np.ndarray = 0

    def read(self) -> dict[str, Any]:
        """Return the `cost` since the last call, with its `damage` and number of `strikes`."""
        damage, strikes = self._harmed.damage - self._damage, self._harmed.strikes - self._strikes
        self._damage, self._strikes = self._harmed.damage, self._harmed.strikes
        return {"cost": damage + STRIKE_COST * strikes, "damage": damage, "strikes": strikes}


Seed: TypeAlias = "int | np.random.Generator | np.random.RandomState | None"


def plain_seed(seed: Seed) -> int | None:
    """Return a seed for Gymnasium: a Python integer, drawn if `seed` is a source of randomness, or None."""
    if isinstance(seed, np.random.Generator):
        return int(seed.integers(LARGEST_SEED + 1))
    if isinstance(seed, np.random.RandomState):
        return int(seed.randint(LARGEST_SEED + 1, dtype=np.int64))
    return int(seed) if isinstance(seed, np.integer) else seed


def episode_seed(seed: int | None, random: np.random.Generator) -> int:
    """Return the seed of the next episode: the given one, or a drawn one.

    Draws do not depend on the events of earlier episodes.

    Raises:
        CaregiverError: The seed is out of range.
    """
    if seed is None:
        return int(random.integers(LARGEST_SEED + 1))
    check_integer("the seed of an episode", seed, 0, LARGEST_SEED)
    return int(seed)


def check_render_mode(mode: str | None) -> None:
    """Raise CaregiverError unless a mode is "rgb_array" or None."""
    if mode == "human":
        raise CaregiverError(
            "no render mode 'human', which needs a window: take rgb_array; `caregiver-mj view` opens a window"
        )
    if mode not in (None, "rgb_array"):
        raise CaregiverError(f"no render mode '{mode}': there is rgb_array")

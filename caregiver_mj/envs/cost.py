"""Cost, as in safe reinforcement learning: harm to the children, beside the reward."""

from __future__ import annotations

from typing import Any, Protocol, SupportsFloat

import gymnasium
import numpy as np

STRIKE_COST = 1.0  # of a contact with a part of the robot that moves towards the child, beside what comes of it


class Harmed(Protocol):
    """What a cost is read from.

    Attributes:
        damage: All damage to the children in an episode so far, or that in each of a batch.
        strikes: How often the robot has struck one, likewise.
    """

    @property
    def damage(self) -> float | np.ndarray: ...

    @property
    def strikes(self) -> int | np.ndarray: ...


class CostMeter:
    """Reads what each step has cost: the damage to the children in it, and `STRIKE_COST` for every strike.

    Over an episode that is its `damage` and its `strikes`, as in the tables.
    """

    def __init__(self, harmed: Harmed):
        self._harmed = harmed
        self._damage: float | np.ndarray
        self._strikes: int | np.ndarray

    def reset(self) -> None:
        """Begins an episode."""
        self._damage, self._strikes = 0.0, 0

    def read(self) -> dict[str, Any]:
        """What has come since it was last read: `cost`, and of that `damage` and the number of `strikes`."""
        damage, strikes = self._harmed.damage - self._damage, self._harmed.strikes - self._strikes
        self._damage, self._strikes = self._harmed.damage, self._harmed.strikes
        return {"cost": damage + STRIKE_COST * strikes, "damage": damage, "strikes": strikes}


class SixValueStep(gymnasium.Wrapper):
    """Has a step return six values, as Safety-Gymnasium's do: observation, reward, cost, terminated, truncated, info.

    It has to be the outermost wrapper, for Gymnasium's own expect five.
    """

    def step(  # type: ignore[override]  # a value more
        self, action: Any
    ) -> tuple[Any, SupportsFloat, float, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward, info["cost"], terminated, truncated, info

"""Where children are now, and how they move."""

from __future__ import annotations

import numpy as np

from caregiver_mj.house.sensing import Blur
from caregiver_mj.policy.self_estimate import gain, remaining

_UNSTEADY = 0.005  # metres by which a child is elsewhere than foreseen, one control timestep later
_STARTS = 0.05  # m/s by which its velocity changes meanwhile
_LOST = 0.3  # metres off what is expected beyond which an estimate begins anew


def child_error(blur: Blur) -> float:
    """White error of where a child is taken to be, one sigma, metres."""
    return remaining(blur.noise, gain(blur.noise, _UNSTEADY))


class ChildEstimates:
    """Children go on as they do; what is measured corrects that."""

    def __init__(self, blur: Blur, timestep: float, age: float):
        self._gain, self._velocity_gain = gain(blur.noise, _UNSTEADY), gain(blur.velocity_noise, _STARTS)
        self._timestep, self._age = timestep, age
        self._position: np.ndarray | None = None
        self._velocity: np.ndarray | None = None
        self._seen: np.ndarray | None = None  # poses and velocities

    def update(self, poses: np.ndarray, velocities: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Takes in what has been seen: poses x, y, yaw (..., 3) and velocities (..., 3); returns those of now."""
        seen = np.concatenate([poses, velocities], axis=-1)
        if self._position is None:
            self._position, self._velocity = poses.copy(), velocities.copy()
        else:
            new = (seen != self._seen).any(axis=-1, keepdims=True)  # or it has not been seen anew
            self._velocity = self._velocity + new * self._velocity_gain * (velocities - self._velocity)
            expected = self._position + self._timestep * self._velocity
            off = poses - expected
            lost = np.linalg.norm(off[..., :2], axis=-1, keepdims=True) > _LOST
            self._position = expected + new * np.where(lost, 1.0, self._gain) * off
            self._position[..., 2] = poses[..., 2]
        self._seen = seen
        now = self._position.copy()
        now[..., :2] += self._age * self._velocity[..., :2]
        return now, self._velocity

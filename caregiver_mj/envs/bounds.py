"""Finite bounds of observations in the house, and clipping to them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from dm_env import specs
from gymnasium import spaces

from caregiver_mj.errors import CaregiverError
from caregiver_mj.house.rendering import control
from caregiver_mj.robot.embodiment import CommandLayout

# Regular motion stays well within these bounds; the effects of wild actions are clipped.
_SPEED, _TURN_RATE = 2.0, 26.0  # m/s, rad/s; the latter of a child that turns round
_ARM_SLACK, _FINGER_SLACK = 0.1, 0.03  # rad, m; compliance of a joint limit
_ARM_SPEED = 50.0  # rad/s; with random actions, which jump across the range fifty times a second
_LOWEST, _HIGHEST = -1.0, 2.0  # m; height of a candle
_UNKNOWN = 1e6  # for observations of user tasks, and for the clock of an endless one

Bounds = tuple[np.ndarray | float, np.ndarray | float]


class BoundedObservations:
    """Clips the observations of an environment to finite bounds.

    Positions are clipped one cell outside the house, headings are wrapped to [-pi, pi). A scalar becomes an array of
    one, because learners such as those of Stable-Baselines3 reject scalars.

    Attributes:
        keys: The space of observations as dictionaries.
        space: The space of the results, a box if they are flat.
    """

    def __init__(self, env: control.Environment, observation: str):
        """Prepare the spaces; observations are "numbers", by name, or "flat", one array in the order of `keys`.

        Raises:
            CaregiverError: `observation` is neither.
        """
        if observation not in ("numbers", "flat"):
            raise CaregiverError(f"no observation '{observation}' of the robot's own actions: there are numbers, flat")
        bounds = _bounds(env)
        within = {key: seen.within for key, seen in env.task.observed.items()}
        self._boxes: dict[str, spaces.Space[Any]] = {
            key: _box(*bounds.get(within.get(key, ""), (-_UNKNOWN, _UNKNOWN)), spec.shape or (1,))
            for key, spec in env.observation_spec().items()
        }
        self._poses = {key for key in within if within[key] == "pose"}
        self.keys = spaces.Dict(self._boxes)
        self.space: spaces.Space[Any] = spaces.flatten_space(self.keys) if observation == "flat" else self.keys

    def __call__(self, observation: Mapping[str, np.ndarray]) -> dict[str, np.ndarray] | np.ndarray:
        """Return a clipped observation, in new arrays."""
        within = {}
        for key in self.keys:
            box = self._boxes[key]
            assert isinstance(box, spaces.Box)
            value = np.array(observation[key], float).reshape(box.shape)
            if key in self._poses:
                value[..., 2] = np.remainder(value[..., 2] + np.pi, 2 * np.pi) - np.pi
            within[key] = np.clip(value, box.low, box.high, out=value)
        if self.space is self.keys:
            return within
        return np.concatenate([value.ravel() for value in within.values()])


def _box(low: np.ndarray | float, high: np.ndarray | float, shape: tuple[int, ...]) -> spaces.Box:
    """Return a box; bounds are broadcast, and may be longer than the last dimension."""
    low, high = (np.broadcast_to(np.atleast_1d(bound)[: shape[-1]], shape).astype(float) for bound in (low, high))
    return spaces.Box(low, high, shape, np.float64)


def _bounds(env: control.Environment) -> dict[str, Bounds]:
    """Return the bounds by the names of `Observed.within`."""
    task = env.task
    rows, columns = task.plan.shape
    x, y = (columns / 2 + 1) * task.plan.cell_size, (rows / 2 + 1) * task.plan.cell_size
    pose, rates = np.array([x, y, np.pi]), np.array([_SPEED, _SPEED, _TURN_RATE])
    place = np.array([-x, -y, _LOWEST]), np.array([x, y, _HIGHEST])
    way = np.array([2 * x, 2 * y, _HIGHEST - _LOWEST])
    bounds: dict[str, Bounds] = {
        "clock": (0.0, min(task.time_limit / task.novice_timestep + 1, _UNKNOWN)),
        "pose": (-pose, pose),  # the last number is an angle
        "rates": (-rates, rates),
        "place": place,
        "way": (-way, way),
        "height": (0.0, _HIGHEST),
        "gate": (-0.1, 1.6),
        "quaternion": (-1.0, 1.0),
        "share": (0.0, 1.0),
        "arm speed": (-_ARM_SPEED, _ARM_SPEED),
    }
    if task.has_robot:
        action, layout = env.action_spec(), task.embodiment.layout
        bounds["arm"] = _within(action, layout, "arm", _ARM_SLACK)
        bounds["fingers"] = _within(action, layout, "gripper", _FINGER_SLACK)
    return bounds


def _within(action: specs.BoundedArray, layout: CommandLayout, part: str, slack: float) -> Bounds:
    which = getattr(layout, part)
    return action.minimum[which] - slack, action.maximum[which] + slack

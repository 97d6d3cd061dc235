"""Eyes that are not quite right: candles are seen a little off where they are."""

from __future__ import annotations

import math
from collections.abc import Callable

import dm_env
import numpy as np

from caregiver_mj.studies.relocations.course import LIFTED

_CLOSED = 0.024  # metres of each finger off the middle below which the hand has closed


class Eyes:
    """Lets a policy see candles where they are not: off by a normally distributed error in x, y and z.

    An error belongs to a sighting, and lasts: what is left after averaging over many pictures is bias, of calibration
    and of the model of the candle. A new sighting begins when a candle is lifted or set down, and when the hand opens
    again after a grasp. In the hand the error is constant relative to the robot, elsewhere in the world.
    """

    def __init__(self, policy: Callable[[dm_env.TimeStep], np.ndarray], sigma: float, seed: int):
        self._policy, self._sigma, self._random = policy, sigma, np.random.default_rng(seed)
        self._situation: np.ndarray | None = None  # which candles are lifted, and whether the hand has closed

    def __call__(self, timestep: dm_env.TimeStep) -> np.ndarray:
        """Answers an observation as the policy does to what it would see of it."""
        observation = dict(timestep.observation)
        positions = observation["candle_position"]
        lifted = positions[:, 2] > LIFTED
        situation = np.append(lifted, observation["finger_position"].sum() < 2 * _CLOSED)
        if self._situation is None or (situation != self._situation).any():
            self._see_anew(situation)
        yaw = observation["base_position"][2]
        c, s = math.cos(yaw), math.sin(yaw)
        turned = self._errors @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        observation["candle_position"] = positions + np.where(lifted[:, None], turned, self._errors)
        return self._policy(dm_env.TimeStep(timestep.step_type, timestep.reward, timestep.discount, observation))

    def _see_anew(self, situation: np.ndarray) -> None:
        """Draws the errors of the sightings that begin with a situation."""
        before, self._situation = self._situation, situation
        draws = self._random.normal(scale=self._sigma, size=(len(situation) - 1, 3))
        if before is None:
            self._errors = draws
            return
        opens = before[-1] and not situation[-1]
        self._errors = np.where((situation[:-1] != before[:-1])[:, None] | opens, draws, self._errors)

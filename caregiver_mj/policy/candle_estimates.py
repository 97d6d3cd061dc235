"""Where candles are now: one that nobody touches where it has been seen on average, one in the hand with the hand."""

from __future__ import annotations

import numpy as np

from caregiver_mj.house.sensing import Blur
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.policy.self_estimate import Posture, gain, remaining
from caregiver_mj.robot import geometry
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.kinematics import arm_of, is_round_candle
from caregiver_mj.robot.view import CANDLE_HEIGHT

_MOST = 50  # sightings that count of a candle that stands
_AFTER_TOUCH = 3  # and what was known counts as so many, once it has been touched
_LATEST = 0.25  # share that a sighting counts in the latest ones, which tell whether it has been moved
_MOVED, _MOVED_SIGMAS = 0.004, 1.8  # metres, and sigmas of a sighting, between the latest ones and the rest
_TILTED, _TILTED_SIGMAS = 0.1, 3.0  # radians, and sigmas, likewise
_SLIPS = 0.001  # metres that a candle slips in the hand within a control timestep
_KEPT = 0.3, 0.002  # sigmas, and metres, that an estimate must be off the last one that was told to be told
_NEAR = 0.25  # metres about the hand in which it may have touched something


def candle_error(blur: Blur) -> float:
    """White error of where a candle is taken to be, one sigma, metres."""
    return remaining(blur.noise, gain(blur.noise, _SLIPS))


class CandleEstimates:
    """All candles of a house."""

    def __init__(self, blur: Blur, robot: Embodiment):
        self._blur, self._arm = blur, arm_of(robot)
        self._keeps = max(_KEPT[0] * blur.noise, _KEPT[1]) if blur.noise else 0.0
        self._told: np.ndarray | None = None  # positions that have been given out, (candles, 3)
        self._held = NOTHING
        self._in_hand = self._in_hand_told = np.zeros(3)  # of the held one, from the pinch point, in the base's frame

    def update(
        self, positions: np.ndarray, orientations: np.ndarray, fingers: float, then: Posture, now: Posture
    ) -> tuple[np.ndarray, np.ndarray]:
        """Takes in what has been seen.

        Args:
            positions: Of each candle's foot, (candles, 3).
            orientations: Likewise, quaternions (candles, 4).
            fingers: How far the fingers stand off the middle, both together.
            then: The robot's posture when all that was seen.
            now: Its posture now.

        Returns:
            Positions and orientations of now.
        """
        if self._told is None:
            told = self._told = positions.copy()
            self._begin(positions, orientations)
        else:
            told = self._told
            self._average(told, positions, orientations)
        self._follow_hand(told, positions, fingers, then)
        self._seen = positions
        places = told.copy()
        if self._held != NOTHING:
            places[self._held] = self._to_house(self._in_hand_told, now)
        return places, self._turned

    def _begin(self, positions: np.ndarray, orientations: np.ndarray) -> None:
        self._mean, self._latest = positions.copy(), positions.copy()
        self._turned, self._latest_turned = orientations.copy(), orientations.copy()
        self._count = np.ones(len(positions))

    def _average(self, told: np.ndarray, positions: np.ndarray, orientations: np.ndarray) -> None:
        """Takes in where candles are seen, as if nobody held them, and tells of them."""
        blur = self._blur
        new = (positions != self._seen).any(axis=1) if blur.dropout else np.ones(len(positions), bool)
        latest = _LATEST if blur.noise else 1.0
        self._latest = self._latest + np.where(new, latest, 0.0)[:, None] * (positions - self._latest)
        self._latest_turned = _mixed(self._latest_turned, orientations, np.where(new, _share(blur), 0.0))
        off = np.linalg.norm(self._latest - self._mean, axis=1)
        moved = off > (_MOVED + _MOVED_SIGMAS * blur.noise if blur.noise else 0.0)
        moved |= _angles(self._latest_turned, self._turned) > _TILTED + _TILTED_SIGMAS * blur.turn_noise
        self._count = np.where(moved, 1 / latest, np.minimum(self._count + new, _MOST))
        share = np.where(new, 1 / self._count, 0.0)
        self._mean = self._mean + share[:, None] * (positions - self._mean)
        self._turned = _mixed(self._turned, orientations, share if blur.turn_noise else np.where(new, 1.0, 0.0))
        self._mean[moved], self._turned[moved] = self._latest[moved], self._latest_turned[moved]
        tell = moved | (np.linalg.norm(self._mean - told, axis=1) > self._keeps)
        told[tell] = self._mean[tell]

    def _follow_hand(self, told: np.ndarray, positions: np.ndarray, fingers: float, then: Posture) -> None:
        """Takes in which candle is in the hand, and where in it."""
        grips = is_round_candle(fingers)
        if not grips and self._held != NOTHING:
            self._let_go(told, then)
        if not grips:
            return
        pinch = self._to_house(np.zeros(3), then)
        if self._held == NOTHING:
            distances = np.linalg.norm(told - pinch, axis=1)
            nearest = int(distances.argmin())
            if distances[nearest] < CANDLE_HEIGHT:
                self._held = nearest
                self._in_hand = self._in_hand_told = self._to_hand(told[nearest], then)
        elif not (self._blur.dropout and np.array_equal(positions[self._held], self._seen[self._held])):
            off = self._to_hand(positions[self._held], then) - self._in_hand
            self._in_hand = self._in_hand + gain(self._blur.noise, _SLIPS) * off
            if np.linalg.norm(self._in_hand - self._in_hand_told) > self._keeps:
                self._in_hand_told = self._in_hand

    def _let_go(self, told: np.ndarray, then: Posture) -> None:
        """The hand has opened: the candle is where it was in it, and whatever else is near may have been touched."""
        here = self._to_house(self._in_hand, then)
        near = np.linalg.norm(told - here, axis=1) < _NEAR
        self._mean[self._held] = self._latest[self._held] = told[self._held] = here
        near[self._held] = True
        self._count[near] = np.minimum(self._count[near], _AFTER_TOUCH)
        self._held = NOTHING

    def _to_house(self, offset: np.ndarray, posture: Posture) -> np.ndarray:
        """A point (3,) of the house by its offset from the pinch point, in the base's frame."""
        base, arm = posture
        x, y, z = (self._arm.pinch(arm) + offset).tolist()
        return np.array([*geometry.to_world(tuple(base.tolist()), (x, y)), z])

    def _to_hand(self, point: np.ndarray, posture: Posture) -> np.ndarray:
        """Its offset from the pinch point, in the base's frame."""
        base, arm = posture
        ahead, aside = geometry.to_local(tuple(base.tolist()), (float(point[0]), float(point[1])))
        return np.array([ahead, aside, point[2]]) - self._arm.pinch(arm)


def _share(blur: Blur) -> float:
    """What a sighting counts in the latest ones of how a candle is turned."""
    return _LATEST if blur.turn_noise else 1.0


def _mixed(quaternions: np.ndarray, others: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Means of quaternions (n, 4) that are close to each other, of which the others count a share (n,)."""
    opposite = (quaternions * others).sum(axis=1, keepdims=True) < 0.0
    mixed = quaternions + share[:, None] * (np.where(opposite, -others, others) - quaternions)
    return mixed / np.linalg.norm(mixed, axis=1, keepdims=True)


def _angles(quaternions: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Angles between orientations, (n,), radians."""
    return 2 * np.arccos(np.abs((quaternions * others).sum(axis=1)).clip(0.0, 1.0))

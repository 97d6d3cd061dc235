"""What the robot's senses make of what there is: see `sensing` for the options."""

from __future__ import annotations

import collections
import math
from collections.abc import Mapping

import mujoco
import numpy as np

from caregiver_mj.house.sensing import KINDS, Blur, Sensing

Observation = Mapping[str, np.ndarray]

_LIFTED = 0.03  # metres above a table's top from which on a candle counts as lifted (one that lies there: 0.022), ...
_OFF_FLOOR = 0.2  # ... and above the floor, where there is no table: one that lies there has its foot lower
_CLOSED = 0.024  # metres of each finger off the middle below which the hand has closed


class _Eye:
    """The sight of all things of one kind.

    Attributes:
        bias: Lasting errors, (things, axes).
    """

    def __init__(self, blur: Blur, axes: int, turns: int, seed: list[int]):
        self._blur, self._random = blur, np.random.default_rng(seed)
        places = axes - turns
        self._white = np.array([blur.noise] * places + [blur.turn_noise] * turns)
        self._lasting = np.array([blur.bias] * places + [blur.turn_bias] * turns)
        self._last: np.ndarray | None = None
        self.bias: np.ndarray

    def see_anew(self, things: int, which: np.ndarray | None = None) -> None:
        """Draws lasting errors, of all things or of some (things,)."""
        drawn = self._random.normal(size=(things, len(self._lasting))) * self._lasting
        self.bias = drawn if which is None else np.where(which[:, None], drawn, self.bias)

    def noise(self) -> np.ndarray:
        """White errors of this moment, (things, axes)."""
        return self._random.normal(size=self.bias.shape) * self._white

    def velocity_noise(self) -> np.ndarray:
        """White errors of velocities, (things, axes)."""
        return self._random.normal(size=self.bias.shape) * self._blur.velocity_noise

    def show(self, seen: np.ndarray) -> np.ndarray:
        """What is seen (things, numbers), of each thing that is not what was seen last."""
        gone = self._random.random(len(seen)) < self._blur.dropout
        if self._last is not None:
            seen = np.where(gone[:, None], self._last, seen)
        self._last = seen
        return seen


class Sensor:
    """Makes observations as they are perceived of exact ones."""

    def __init__(self, sensing: Sensing, control_timestep: float, tables: np.ndarray):
        """Prepares it.

        Args:
            sensing: How well it sees.
            control_timestep: Seconds between observations.
            tables: Rectangles of the tables and the heights of their tops, (tables, 5), metres.
        """
        self.sensing, self._tables = sensing, tables
        self._queue: collections.deque[dict[str, np.ndarray]] = collections.deque(
            maxlen=sensing.delay_steps(control_timestep) + 1
        )
        self._step: int | None = None  # of the last observation; None before an episode

    def reset(self, seed: int) -> None:
        """Begins an episode, all of whose errors come from a seed."""
        sensing = self.sensing
        axes = {"candle": (6, 3), "child": (3, 1), "base": (3, 1)}
        self._eyes = {
            kind: _Eye(getattr(sensing, kind), *axes[kind], [seed, number]) for number, kind in enumerate(KINDS)
        }
        self._queue.clear()
        self._step = -1
        self._situation: tuple[np.ndarray, bool] | None = (
            None  # which candles are lifted, and whether the hand has closed
        )

    def sense(self, step: int, exact: Observation) -> dict[str, np.ndarray]:
        """What is perceived at a control timestep, counted from 0; however often it is asked for.

        Args:
            step: Which.
            exact: What there is, by the observation's keys.
        """
        if self._step is None:
            return dict(exact)
        if step != self._step:
            self._step = step
            self._queue.append(self._blurred(exact))
        return {key: value.copy() for key, value in self._queue[0].items()}

    def _blurred(self, exact: Observation) -> dict[str, np.ndarray]:
        seen = {key: value.copy() for key, value in exact.items()}
        self._look_at(self._eyes["child"], seen, "toddler")
        if "base_position" in seen:
            self._look_at(self._eyes["base"], seen, "base")
        if "candle_position" in seen:
            self._look_at_candles(exact, seen)
        return seen

    def _look_at(self, eye: _Eye, seen: dict[str, np.ndarray], name: str) -> None:
        """Blurs poses (x, y, yaw) and velocities."""
        poses, velocities = (np.atleast_2d(seen[f"{name}_{what}"]) for what in ("position", "velocity"))
        if self._step == 0:
            eye.see_anew(len(poses))
        found = np.hstack([poses + eye.bias + eye.noise(), velocities + eye.velocity_noise()])
        shown = eye.show(found).reshape(*seen[f"{name}_position"].shape[:-1], 6)
        seen[f"{name}_position"], seen[f"{name}_velocity"] = shown[..., :3], shown[..., 3:]

    def _look_at_candles(self, exact: Observation, seen: dict[str, np.ndarray]) -> None:
        eye, positions, orientations = self._eyes["candle"], exact["candle_position"], exact["candle_orientation"]
        lifted = self._lifted(positions)
        closed = "finger_position" in exact and bool(exact["finger_position"].sum() < 2 * _CLOSED)
        self._note(eye, lifted, closed)
        errors = eye.bias.copy()
        yaw = float(exact["base_position"][2]) if "base_position" in exact else 0.0
        c, s = math.cos(yaw), math.sin(yaw)
        turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        errors[lifted] = np.hstack([errors[lifted, :3] @ turn, errors[lifted, 3:] @ turn])  # it turns with the robot
        errors += eye.noise()
        turned = np.array([_turned(q, error) for q, error in zip(orientations, errors[:, 3:], strict=True)])
        shown = eye.show(np.hstack([positions + errors[:, :3], turned.reshape(-1, 4)]))
        seen["candle_position"], seen["candle_orientation"] = shown[:, :3], shown[:, 3:]

    def _note(self, eye: _Eye, lifted: np.ndarray, closed: bool) -> None:
        """Begins new sightings: of candles that are lifted or set down, and of all when the hand opens again."""
        before, self._situation = self._situation, (lifted, closed)
        if before is None:
            eye.see_anew(len(lifted))
        elif (anew := (lifted != before[0]) | (before[1] and not closed)).any():
            eye.see_anew(len(lifted), anew)

    def _lifted(self, positions: np.ndarray) -> np.ndarray:
        """Whether each candle is in the air, (candles,)."""
        over = (np.abs(positions[:, None, :2] - self._tables[:, :2]) < self._tables[:, 2:4]).all(axis=2)
        top = np.where(over, self._tables[:, 4], 0.0).max(axis=1, initial=0.0)
        return positions[:, 2] > np.where(top > 0.0, top + _LIFTED, _OFF_FLOOR)


def _turned(quaternion: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """A quaternion (4,), turned in the house by a rotation vector (3,) in radians."""
    by, turned = np.empty(4), np.empty(4)
    angle = float(np.linalg.norm(rotation))
    mujoco.mju_axisAngle2Quat(by, rotation / angle if angle else np.array([0.0, 0.0, 1.0]), angle)
    mujoco.mju_mulQuat(turned, by, quaternion)
    return turned

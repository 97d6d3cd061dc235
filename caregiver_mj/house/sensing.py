"""Sensing: errors, gaps and delay of observations in the house, all off by default."""

from __future__ import annotations

import collections
import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from caregiver_mj.errors import CaregiverError, check_number
from caregiver_mj.plans import layout
from caregiver_mj.robot.view import loose, off_table

LONGEST_DELAY = 1.0  # s
_OFTENEST = 0.95  # greatest probability of a gap
KINDS = ("candle", "child", "base")  # of observed things
Observation = Mapping[str, np.ndarray]
_OFF_FLOOR = 0.2  # m above the floor; a higher candle beside tables counts as lifted


@dataclasses.dataclass(frozen=True)
class Blur:
    """Normally distributed errors of one kind of thing; standard deviations.

    White errors are drawn at every control step. Lasting errors of the base and of children last for the episode,
    those of a candle until it is lifted, set down, or released.
    """

    noise: float = 0.0  # m; white error of the position along each axis
    bias: float = 0.0  # m; lasting error of the position along each axis
    turn_noise: float = 0.0  # rad; white error of the heading, for a candle about each axis
    turn_bias: float = 0.0  # rad; lasting error of the heading, for a candle about each axis
    # m/s, rad/s; white error of the velocity and of the turning rate; not for candles
    velocity_noise: float = 0.0
    dropout: float = 0.0  # probability per control step that the last value is repeated


@dataclasses.dataclass(frozen=True)
class Sensing:
    """Errors, gaps and delay of a task's observations."""

    candle: Blur = Blur()  # errors of candles and small things
    child: Blur = Blur()  # errors of children
    base: Blur = Blur()  # errors of the robot's base
    # s; delay of all observations except the clock, rounded up to whole control steps
    delay: float = 0.0

    @classmethod
    def of(cls, value: Sensing | Mapping[str, Any] | None) -> Sensing:
        """Make sensing from None, for exact observations, or a dictionary such as `{"candle": {"noise": 0.01}}`."""
        sensing = value if isinstance(value, cls) else cls(**_known("sensing", cls, {} if value is None else value))
        candle, child, base = (_blur(name, getattr(sensing, name)) for name in KINDS)
        check_number("sensing: delay", sensing.delay, 0, LONGEST_DELAY)
        return dataclasses.replace(sensing, candle=candle, child=child, base=base)

    @property
    def is_exact(self) -> bool:
        """Whether observations have neither errors nor delay."""
        return self == Sensing()

    def delay_steps(self, control_timestep: float) -> int:
        """Return the delay in control steps."""
        return -int(-(self.delay / control_timestep - 1e-6) // 1) if self.delay else 0


def _blur(kind: str, value: Blur | Mapping[str, Any]) -> Blur:
    blur = value if isinstance(value, Blur) else Blur(**_known(f"sensing: {kind}", Blur, value))
    for field in dataclasses.fields(Blur):
        most = _OFTENEST if field.name == "dropout" else math.inf
        check_number(f"sensing: {kind}.{field.name}", getattr(blur, field.name), 0, most)
    if kind == "candle" and blur.velocity_noise:
        raise CaregiverError("sensing: candle.velocity_noise must be left out: no velocity of a candle is observed")
    return blur


def _known(what: str, cls: type, value: Any) -> Mapping[str, Any]:
    """Return a dictionary; raise CaregiverError unless all its keys are fields of a class."""
    if not isinstance(value, Mapping):
        raise CaregiverError(f"{what} must be a {cls.__name__} or a dictionary, got {value!r}")
    names = [field.name for field in dataclasses.fields(cls)]
    for name in value:
        if name not in names:
            raise CaregiverError(f"{what} has no '{name}': there are {', '.join(names)}")
    return value


class _Eye:
    """The errors of all things of one kind."""

    bias: np.ndarray  #: lasting errors, (things, axes)

    def __init__(self, blur: Blur, axes: int, turns: int, seed: list[int]):
        self._blur, self._random = blur, np.random.default_rng(seed)
        places = axes - turns
        self._white = np.array([blur.noise] * places + [blur.turn_noise] * turns)
        self._lasting = np.array([blur.bias] * places + [blur.turn_bias] * turns)
        self._last: np.ndarray | None = None  # last values of each thing, NaN at first

    def see_anew(self, things: int, which: np.ndarray | None = None) -> None:
        """Draw lasting errors of all things, or of some, bool (things,)."""
        drawn = self._random.normal(size=(things, len(self._lasting))) * self._lasting
        self.bias = drawn if which is None else np.where(which[:, None], drawn, self.bias)

    def noise(self, of_velocity: bool = False) -> np.ndarray:
        """Return white errors, (things, axes)."""
        return self._random.normal(size=self.bias.shape) * (self._blur.velocity_noise if of_velocity else self._white)

    def show(self, seen: np.ndarray, in_sight: np.ndarray | None = None) -> np.ndarray:
        """Return values (things, numbers) with gaps filled by the last ones; 0 for things out of view."""
        if self._last is None:
            self._last = np.full_like(seen, np.nan)
        gone = self._random.random(len(seen)) < self._blur.dropout
        shown = np.where(gone[:, None] & ~np.isnan(self._last), self._last, seen)
        there = np.ones(len(seen), bool) if in_sight is None else in_sight > 0.0
        self._last = np.where(there[:, None], shown, self._last)
        return np.where(there[:, None], shown, 0.0)


class Sensor:
    """Turns exact observations into perceived ones."""

    def __init__(self, sensing: Sensing, control_timestep: float, tables: np.ndarray, things: Sequence[layout.Thing]):
        self.sensing = sensing
        self._loose, self._off_table = loose(things), off_table(things)
        self._tables = tables  # rectangles and heights of their tops, (tables, 5), m
        self._queue: collections.deque[dict[str, np.ndarray]] = collections.deque(
            maxlen=sensing.delay_steps(control_timestep) + 1
        )
        self._step: int | None = None  # number of the last observation's step; None before an episode

    def reset(self, seed: int) -> None:
        """Begin an episode, whose errors all come from a seed."""
        sensing = self.sensing
        axes = {"candle": (6, 3), "child": (3, 1), "base": (3, 1)}
        self._eyes = {
            kind: _Eye(getattr(sensing, kind), *axes[kind], [seed, number]) for number, kind in enumerate(KINDS)
        }
        self._eyes["thing"] = _Eye(sensing.candle, 3, 0, [seed, len(KINDS)])
        self._queue.clear()
        self._step = -1
        # Whether each candle is lifted, and whether the hand is closed.
        self._situation: tuple[np.ndarray, bool] | None = None

    def sense(self, step: int, exact: Observation) -> dict[str, np.ndarray]:
        """Return the perceived observation at a control step, from 0; repeated calls return the same."""
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
        if "battery_position" in seen:  # lasting errors for the episode
            eye, positions = self._eyes["thing"], seen["battery_position"]
            if self._step == 0:
                eye.see_anew(len(positions))
            seen["battery_position"] = eye.show(positions + eye.bias + eye.noise())
        return seen

    def _look_at(self, eye: _Eye, seen: dict[str, np.ndarray], name: str) -> None:
        """Blur poses (x, y, yaw) and velocities."""
        poses, velocities = (np.atleast_2d(seen[f"{name}_{what}"]) for what in ("position", "velocity"))
        if self._step == 0:
            eye.see_anew(len(poses))
        found = np.hstack([poses + eye.bias + eye.noise(), velocities + eye.noise(of_velocity=True)])
        shown = eye.show(found, seen.get(f"{name}_seen")).reshape(*seen[f"{name}_position"].shape[:-1], 6)
        seen[f"{name}_position"], seen[f"{name}_velocity"] = shown[..., :3], shown[..., 3:]

    def _look_at_candles(self, exact: Observation, seen: dict[str, np.ndarray]) -> None:
        eye, positions, orientations = self._eyes["candle"], exact["candle_position"], exact["candle_orientation"]
        over = (np.abs(positions[:, None, :2] - self._tables[:, :2]) < self._tables[:, 2:4]).all(axis=2)
        top = np.where(over, self._tables[:, 4], 0.0).max(axis=1, initial=0.0)
        lifted = positions[:, 2] > np.where(top > 0.0, top + self._off_table, _OFF_FLOOR)
        closed = "finger_position" in exact and bool(exact["finger_position"].sum() < 2 * self._loose)
        self._note(eye, lifted, closed)
        errors = eye.bias.copy()
        yaw = float(exact["base_position"][2]) if "base_position" in exact else 0.0
        c, s = math.cos(yaw), math.sin(yaw)
        turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        turned = np.einsum("nki,ij->nkj", errors[lifted].reshape(-1, 2, 3), turn)  # the error turns with the robot
        errors[lifted] = turned.reshape(-1, 6)
        errors += eye.noise()
        quaternions = np.array([_turned(q, error) for q, error in zip(orientations, errors[:, 3:], strict=True)])
        shown = eye.show(np.hstack([positions + errors[:, :3], quaternions.reshape(-1, 4)]))
        seen["candle_position"], seen["candle_orientation"] = shown[:, :3], shown[:, 3:]

    def _note(self, eye: _Eye, lifted: np.ndarray, closed: bool) -> None:
        """Draw new lasting errors of candles that were lifted or set down, and of all when the hand opens."""
        before, self._situation = self._situation, (lifted, closed)
        if before is None:
            eye.see_anew(len(lifted))
        elif (anew := (lifted != before[0]) | (before[1] and not closed)).any():
            eye.see_anew(len(lifted), anew)


def _turned(quaternion: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Return a quaternion (4,) rotated in the house by a rotation vector (3,), rad."""
    by, turned = np.empty(4), np.empty(4)
    angle = math.hypot(*rotation.tolist())
    mujoco.mju_axisAngle2Quat(by, rotation / angle if angle else np.array([0.0, 0.0, 1.0]), angle)
    mujoco.mju_mulQuat(turned, by, quaternion)
    return turned

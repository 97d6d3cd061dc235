"""How a relocation goes, moment by moment, and how long its parts take."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from caregiver_mj.house.physics import Physics
from caregiver_mj.robot.handling import Grasp
from caregiver_mj.robot.motion import RobotMotion

LIFTED = 0.02  # metres above the table
_ARRIVED, _ARRIVED_SPEED = 0.006, 0.03  # metres, m/s
_CLEAR = 0.62  # of the reach: from there on the base may drive
_SHAKEN = 1e-4  # metres by which the command to the fingers must change to count


@dataclasses.dataclass(frozen=True)
class Moment:
    """One control timestep.

    Attributes:
        time: Seconds since the start.
        x: Of the base, metres.
        y: Likewise.
        speed: Of the base, m/s.
        fingers: What they are told: metres that each shall stand off the middle.
        height: Of the candle's foot above the table from which it is taken, metres.
        reach: How far the hand reaches out, as a share.
        held: Whether the fingers are round something.
    """

    time: float
    x: float
    y: float
    speed: float
    fingers: float
    height: float
    reach: float
    held: bool


class Course:
    """The moments of one relocation."""

    def __init__(self, physics: Physics, robot: RobotMotion, candle: int, table: float):
        self._physics, self._robot, self._candle, self._table = physics, robot, candle, table
        self._moments: list[Moment] = []

    def note(self, action: np.ndarray) -> None:
        """Call with every action, before the physics go on."""
        physics = self._physics
        x, y, _ = physics.base_position()
        self._moments.append(
            Moment(
                time=physics.time(),
                x=x,
                y=y,
                speed=math.hypot(*physics.base_velocity()[:2]),
                fingers=action[self._robot.robot.layout.gripper.start],
                height=physics.candle_poses()[self._candle, 2] - self._table,
                reach=self._robot.reached,
                held=physics.is_gripping(),
            )
        )

    def times(self) -> tuple[float, float]:
        """Seconds from arrived to lifted and from arrived to clear, NaN for what did not happen."""
        return times(self._moments, self._robot.robot.grasp)


def times(moments: Sequence[Moment], grasp: Grasp) -> tuple[float, float]:
    """Seconds from arrived to lifted and from arrived to clear, NaN for what did not happen.

    Args:
        moments: All moments of a relocation.
        grasp: How the robot takes a candle.
    """
    rows = np.array([dataclasses.astuple(moment) for moment in moments], float)
    time, x, y, speed, fingers, height, reach, held = rows.T

    def arrived(at: int | None, start: int | None) -> int | None:
        """When the base was first at rest where it is at some time, since another time; None if it never was."""
        near = np.hypot(x - x[at], y - y[at]) < _ARRIVED
        return _first(near & (speed < _ARRIVED_SPEED), start)

    closing = _first(fingers < grasp.open - _SHAKEN, 0)
    lifted = _first(height > LIFTED, closing)
    release = _first(fingers > grasp.closed + _SHAKEN, lifted)
    clear = _first((reach <= _CLEAR) & (held == 0.0), release)

    def since_arrived(end: int | None, at: int | None, start: int | None) -> float:
        """Seconds; NaN if it never ended, or the hand opened before the base had arrived: a candle was lost."""
        begun = None if end is None else arrived(at, start)
        return math.nan if begun is None else float(time[end] - time[begun])

    return since_arrived(lifted, closing, 0), since_arrived(clear, release, lifted)


def _first(condition: np.ndarray, start: int | None) -> int | None:
    """The first index from a start on at which a condition holds; None if there is none, or no start."""
    if start is None:
        return None
    found = np.flatnonzero(condition[start:])
    return start + int(found[0]) if len(found) else None

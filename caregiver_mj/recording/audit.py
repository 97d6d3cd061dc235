"""Audits: whether the robot kept its limits in an episode, and how it moved near the child."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from caregiver_mj.recording.telemetry import EpisodeLog

if TYPE_CHECKING:
    from caregiver_mj.robot.embodiment import Embodiment

_MOVES = 0.05  # m/s above which a part of the robot counts as moving; a contact at more than that is a strike
_NEAR = 0.5  # metres from the child within which the robot should be slow, ...
_SLOW = 0.25  # m/s: ... the reduced speed of ISO 10218-1


@dataclasses.dataclass(frozen=True)
class Check:
    """The worst that came of one limit.

    Attributes:
        name: What is limited.
        unit: Its unit.
        worst: The value that came closest to its limit, or exceeded it most.
        limit: That limit.
        time: When that was, seconds since the start.
        where: Which joint or finger it was, if there are several.
    """

    name: str
    unit: str
    worst: float
    limit: float
    time: float
    where: str = ""

    @property
    def ratio(self) -> float:
        """The worst value over the limit: at most 1 if it was kept."""
        return self.worst / self.limit


def check_limits(log: EpisodeLog, robot: Embodiment) -> list[Check]:
    """Compares what was commanded in an episode, and the base's speed, with a robot's limits.

    They are those that are published, not the lower ones that it plans for. What else was measured: `check_motion`.

    Velocity, acceleration and jerk of the arm are finite differences of the commanded joint positions at the control
    timestep; before the first command it was at rest there.
    """
    step, limits, joints = log.control_timestep, robot.limits, robot.names.arm
    rest = np.concatenate([log.commands[:1]] * 3 + [log.commands])  # (n + 3, actuators)
    targets, fingers = rest[:, robot.actuators.arm], rest[2:, robot.actuators.gripper]
    arm = [np.diff(targets, order, axis=0)[3 - order :] / step**order for order in (1, 2, 3)]  # (n, joints) each
    speed = np.hypot(*log.base_velocity[:, :2].T)[:, None]
    gripper = np.full(2, limits.finger_speed)
    return [
        worst("arm velocity, commanded", "rad/s", arm[0], limits.arm.velocity, step, joints),
        worst("arm acceleration, commanded", "rad/s^2", arm[1], limits.arm.acceleration, step, joints),
        worst("arm jerk, commanded", "rad/s^3", arm[2], limits.arm.jerk, step, joints),
        worst("base speed, measured", "m/s", speed, np.array([limits.base_speed]), log.physics_timestep),
        worst("finger speed, commanded", "m/s", np.diff(fingers, axis=0) / step, gripper, step, ("left", "right")),
    ]


@dataclasses.dataclass(frozen=True)
class NearChild:
    """How the robot moved near the child in an episode.

    Attributes:
        separation: The least distance between the child and a part of the robot that moved, metres. It is 0 or less
            where the child ran into the robot.
        approach_separation: The least distance to a part that moved towards the child, metres.
        fast_seconds: How long a part was within 0.5 m of the child and faster than 0.25 m/s.
        contact_speed: How fast, at the most, a part that touched the child moved towards it, m/s; 0 without contact.
    """

    separation: float
    approach_separation: float
    fast_seconds: float
    contact_speed: float


def near_child(log: EpisodeLog) -> NearChild:
    """Measures how the robot moved near the child."""
    fast = (log.distance < _NEAR) & (log.speed > _SLOW)
    return NearChild(
        separation=float(log.distance.min(where=log.speed > _MOVES, initial=np.inf)),
        approach_separation=float(log.distance.min(where=log.approach > _MOVES, initial=np.inf)),
        fast_seconds=float(fast.any(axis=1).sum() * log.physics_timestep),
        contact_speed=float(log.contact_speed.max(initial=0.0)),
    )


def strike_times(log: EpisodeLog) -> np.ndarray:
    """When a part of the robot touched the child while it moved towards it, seconds, at every physics step of it."""
    return np.flatnonzero(log.contact_speed > _MOVES) * log.physics_timestep


def worst(
    name: str, unit: str, values: np.ndarray, bounds: np.ndarray, timestep: float, names: tuple[str, ...] = ("",)
) -> Check:
    """The check of values (steps, things) with bounds, (things,) or of every step (steps, things)."""
    size = np.abs(values)
    bounds = np.broadcast_to(bounds, size.shape)
    place = row, column = np.unravel_index(np.argmax(size / bounds), size.shape)
    return Check(name, unit, float(size[place]), float(bounds[place]), float(row * timestep), names[column])

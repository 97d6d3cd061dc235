"""Audits: whether the robot kept its limits in an episode, and how it moved near the child.

Nothing of this is in the hot path. A `Recorder` looks on at every physics step; the checks read its log afterwards,
and judge by what the servos were told and the simulation measured, not by what the skills meant to do.
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from caregiver_mj.robot import limits
from caregiver_mj.robot.kinematics import ARM_JOINTS

if TYPE_CHECKING:  # dm_control must not be imported before caregiver_mj.house.rendering
    import dm_env
    from dm_control.rl import control

_ARM, _GRIPPER = slice(3, 10), slice(10, 12)  # of the actuators
_FAR = 1.0  # metres from the child beyond which distances are not measured
_REACH = 1.2  # metres from the base's centre within which all of the robot is

_MOVES = 0.05  # m/s above which a part of the robot counts as moving; a contact at more than that is a strike
_NEAR = 0.5  # metres from the child within which the robot should be slow, ...
_SLOW = 0.25  # m/s: ... the reduced speed of ISO 10218-1


@dataclasses.dataclass(frozen=True)
class EpisodeLog:
    """What the robot did in an episode: n control timesteps of m physics steps together.

    Attributes:
        control_timestep: Seconds.
        physics_timestep: Seconds.
        commands: What the actuators were told, in the order of `models/robot.xml`, (n, 12).
        base_velocity: Velocity of the base in the world, m/s and rad/s, (m, 3).
        distance: From each part of the robot that can touch something to the child, metres, (m, parts); infinite if
            far away.
        speed: Of the point of each part that is nearest to the child, m/s, (m, parts); 0 if far away.
        approach: The component of that towards the child, m/s, (m, parts).
        contact_speed: How fast a part that touches the child moves towards it, m/s, (m,); the fastest, and minus
            infinity where none touches it.
    """

    control_timestep: float
    physics_timestep: float
    commands: np.ndarray
    base_velocity: np.ndarray
    distance: np.ndarray
    speed: np.ndarray
    approach: np.ndarray
    contact_speed: np.ndarray

    @classmethod
    def record(
        cls, env: control.Environment, policy: Callable[[dm_env.TimeStep], np.ndarray], steps: int
    ) -> EpisodeLog:
        """Runs an episode from its start, for some control timesteps at most, and logs it."""
        timestep = env.reset()
        with Recorder(env) as recorder:
            for _ in range(steps):
                if timestep.last():
                    break
                timestep = env.step(policy(timestep))
        return recorder.log()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes an .npz file."""
        np.savez_compressed(path, **dataclasses.asdict(self))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> EpisodeLog:
        """Reads what `save` has written."""
        with np.load(path) as file:
            arrays = {field.name: file[field.name] for field in dataclasses.fields(cls)}
        return cls(**{name: array if array.ndim else float(array) for name, array in arrays.items()})


@contextlib.contextmanager
def each_physics_step(physics: control.Physics, look: Callable[[], None]) -> Iterator[None]:
    """Calls a function after every physics step of an environment's physics, within a `with` block."""
    step = physics.step

    def watched(nstep: int = 1) -> None:
        touches = []
        for _ in range(nstep):
            step(1)
            touches += physics.touches
            look()
        physics.touches = touches

    physics.step = watched
    try:
        yield
    finally:
        del physics.step  # the class's own shows again


class Recorder:
    """Looks on while an environment with a robot is stepped, within a `with` block of one episode."""

    def __init__(self, env: control.Environment):
        self._physics = env.physics
        self._control_timestep = env.control_timestep()
        self._model, self._data = model, _ = env.physics.model.ptr, env.physics.data.ptr
        self._base = [model.joint(f"robot/base_{axis}").dofadr[0] for axis in ("x", "y", "yaw")]
        geoms = [model.geom(i) for i in range(model.ngeom)]
        self._parts = [geom.id for geom in geoms if geom.name.startswith("robot/") and geom.contype[0]]
        self._child = model.geom("toddler/body").id
        self._hull = model.geom("robot/base_hull").id
        self._rows: dict[str, list] = {
            field.name: [] for field in dataclasses.fields(EpisodeLog) if field.type == "np.ndarray"
        }

    def __enter__(self) -> Recorder:
        self._watch = each_physics_step(self._physics, self._look)
        self._watch.__enter__()
        return self

    def __exit__(self, *error) -> None:
        self._watch.__exit__(*error)

    def log(self) -> EpisodeLog:
        """What has been recorded so far."""
        arrays = {name: np.array(rows) for name, rows in self._rows.items()}
        physics_timestep = float(self._model.opt.timestep)
        arrays["commands"] = arrays["commands"][:: round(self._control_timestep / physics_timestep)]
        return EpisodeLog(self._control_timestep, physics_timestep, **arrays)

    def _look(self) -> None:
        rows, data = self._rows, self._data
        rows["commands"].append(data.ctrl.copy())
        rows["base_velocity"].append(data.qvel[self._base])
        speeds = [touch.speed for touch in self._physics.touches if touch.kind == "robot"]
        rows["contact_speed"].append(max(speeds, default=-np.inf))
        distance, speed, approach = np.full(len(self._parts), np.inf), *np.zeros((2, len(self._parts)))
        across = data.geom_xpos[self._child, :2] - data.geom_xpos[self._hull, :2]
        if np.hypot(*across) < _FAR + _REACH:
            for i, part in enumerate(self._parts):
                distance[i], speed[i], approach[i] = self._measure(part)
        rows["distance"].append(distance)
        rows["speed"].append(speed)
        rows["approach"].append(approach)

    def _measure(self, part: int) -> tuple[float, float, float]:
        """Distance of a geom to the child, and speed and approach of its nearest point."""
        model, data = self._model, self._data
        ends, velocity = np.empty(6), np.empty(6)  # of the shortest line between them; rotation, translation
        point = np.empty(3)
        distance = mujoco.mj_geomDistance(model, data, part, self._child, _FAR, ends)
        if distance >= _FAR:
            return np.inf, 0.0, 0.0
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_GEOM, part, velocity, 0)
        mujoco.mju_cross(point, velocity[:3], ends[:3] - data.geom_xpos[part])
        point += velocity[3:]
        # Where the two overlap, the line goes from the robot's far side to the child's: backwards.
        line = (ends[3:] - ends[:3]) * (1.0 if distance > 0 else -1.0)
        length = mujoco.mju_norm3(line)
        return distance, mujoco.mju_norm3(point), float(point @ line / length) if length > 1e-9 else 0.0


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


def check_limits(log: EpisodeLog) -> list[Check]:
    """Compares an episode with the robot's limits as published, not with the lower ones that it plans for.

    Velocity, acceleration and jerk of the arm are finite differences of the commanded joint positions at the control
    timestep; before the first command it was at rest there.
    """
    step = log.control_timestep
    joints = np.concatenate([log.commands[:1, _ARM]] * 3 + [log.commands[:, _ARM]])  # (n + 3, 7)
    fingers = np.concatenate([log.commands[:1, _GRIPPER], log.commands[:, _GRIPPER]])
    arm = [np.diff(joints, order, axis=0)[3 - order :] / step**order for order in (1, 2, 3)]  # (n, 7) each
    speed = np.hypot(*log.base_velocity[:, :2].T)[:, None]
    gripper = np.full(2, limits.GRIPPER_VELOCITY)
    return [
        _worst("arm velocity, commanded", "rad/s", arm[0], limits.ARM_VELOCITY, step, ARM_JOINTS),
        _worst("arm acceleration, commanded", "rad/s^2", arm[1], limits.ARM_ACCELERATION, step, ARM_JOINTS),
        _worst("arm jerk, commanded", "rad/s^3", arm[2], limits.ARM_JERK, step, ARM_JOINTS),
        _worst("base speed, measured", "m/s", speed, np.array([limits.MAX_BASE_SPEED]), log.physics_timestep),
        _worst("finger speed, commanded", "m/s", np.diff(fingers, axis=0) / step, gripper, step, ("left", "right")),
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


def _worst(
    name: str, unit: str, values: np.ndarray, bounds: np.ndarray, timestep: float, names: tuple[str, ...] = ("",)
) -> Check:
    """The check of values (steps, things) with bounds (things,)."""
    size = np.abs(values)
    row, column = np.unravel_index(np.argmax(size / bounds), size.shape)
    return Check(name, unit, float(size[row, column]), float(bounds[column]), float(row * timestep), names[column])

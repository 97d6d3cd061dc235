"""What the robot did in an episode, logged at every physics step by a `Recorder` that looks on.

Nothing of this is in the hot path. The log has what the servos were told and the simulation measured, not what the
skills meant to do; `audit` judges by it.
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from caregiver_mj.recording.dynamics import Dynamics

if TYPE_CHECKING:  # dm_control must not be imported before caregiver_mj.house.rendering
    import dm_env
    from dm_control.rl import control

_FAR = 1.0  # metres from the child beyond which distances are not measured
_REACH = 1.2  # metres from the base's centre within which all of the robot is


@dataclasses.dataclass(frozen=True)
class EpisodeLog:
    """What the robot did in an episode: n control timesteps of m physics steps together.

    Attributes:
        control_timestep: Seconds.
        physics_timestep: Seconds.
        commands: What the actuators were told, in the order of the robot's model, (n, actuators).
        base_velocity: Velocity of the base in the world, m/s and rad/s, (m, 3).
        arm_position: Joint positions, rad, (m, joints).
        arm_velocity: Joint velocities, rad/s, (m, joints).
        arm_torque: What moved each joint and held it up, N m, (m, joints), see `Dynamics`.
        finger_velocity: Of each finger, m/s, (m, 2).
        pads: How many of the fingers' pads touch the wax of a candle, (m,).
        pressure_centre: Where on the floor the wheels' forces together act, in the base's frame, metres, (m, 2).
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
    arm_position: np.ndarray
    arm_velocity: np.ndarray
    arm_torque: np.ndarray
    finger_velocity: np.ndarray
    pads: np.ndarray
    pressure_centre: np.ndarray
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
        values: dict[str, Any] = {name: array if array.ndim else float(array) for name, array in arrays.items()}
        return cls(**values)


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
        self._dynamics = Dynamics(model, env.physics.data.ptr, env.task.embodiment.names)
        geoms = [model.geom(i) for i in range(model.ngeom)]
        self._parts = [geom.id for geom in geoms if geom.name.startswith("robot/") and geom.contype[0]]
        self._pads = {geom.id for geom in geoms if geom.name.endswith("_pad")}
        self._wax = {geom.id for geom in geoms if geom.name.endswith("/wax")}
        self._child = model.geom("toddler/body").id
        self._hull = model.geom("robot/base_hull").id
        self._rows: dict[str, list[Any]] = {
            field.name: [] for field in dataclasses.fields(EpisodeLog) if field.type == "np.ndarray"
        }

    def __enter__(self) -> Recorder:
        self._watch = each_physics_step(self._physics, self._look)
        self._watch.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
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
        for name, values in self._dynamics.measure().items():
            rows[name].append(values)
        touching = {frozenset(pair) for pair in data.contact.geom.tolist()}
        rows["pads"].append(sum(any({pad, wax} in touching for wax in self._wax) for pad in self._pads))
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

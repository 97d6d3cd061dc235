"""The house's simulation, with named readouts and the children's contacts at every physics step."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from typing import Any

import mujoco
import numpy as np
from dm_env import specs

from caregiver_mj.children.walk import ToddlerWalk, Vector
from caregiver_mj.errors import CaregiverError, RenderingError
from caregiver_mj.house.figure import Figure
from caregiver_mj.house.fittings import FLOOR, OPAQUE
from caregiver_mj.house.rendering import OffscreenRendering, engine, wrapper
from caregiver_mj.house.robot_body import RampState, RobotBody, joint_views
from caregiver_mj.house.scene import build_house, child_joints, child_prefix
from caregiver_mj.house.touch import TouchReader
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import HazardKind, Where, kinds_at
from caregiver_mj.recording.ledger import Touch
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.view import loose

EYE = "eye"  # the robot's camera
_SPRUNG = 0.002  # m; greatest travel of the bolt of a latched gate
_HIDES = np.array([group in (OPAQUE, 3) for group in range(mujoco.mjNGROUP)], np.uint8)  # opaque groups of geoms
_SMALL = 256  # pixels; size below which shadows take 3/4 of the time without a graphics card
_DENSE = 150  # degrees of freedom up to which dense Jacobians are faster; house `paper` has 43
# Of a pickled simulation: data, robot, state of its ramp, numbers of awake objects, states of the figures.
_Pickled = tuple[wrapper.MjData, Embodiment | None, RampState | None, dict[str, int], list[dict[str, float]]]
_AWAKE = ("ntree_awake", "nbody_awake", "nparent_awake", "nv_awake")


class Physics(OffscreenRendering, engine.Physics):
    """The house's simulation."""

    embodiment: Embodiment | None = None  #: the robot in the house, or None
    touches: list[Touch]  #: all contacts of the children during the last `step`
    live: dict[str, np.ndarray]  #: views of the state, by key of observations, in their order; copy what you keep
    figures: list[Figure]  #: visible bodies of the children; none without visuals
    carried: tuple[HazardKind, ...]  #: kind of each candle

    def __init__(self, data: wrapper.MjData, embodiment: Embodiment | None = None):
        self.embodiment = embodiment
        super().__init__(data)

    @classmethod
    def from_plan(
        cls,
        plan: FloorPlan,
        robot: bool | str | Embodiment = True,
        table_positions: np.ndarray | None = None,
        children: int = 1,
        visuals: bool = True,
        table_heights: np.ndarray | None = None,
    ) -> Physics:
        """Build the house of a floor plan; the arguments are those of `build_house`."""
        embodiment = None if robot is False else find_embodiment(None if robot is True else robot)
        spec = build_house(plan, embodiment or False, table_positions, children, visuals, table_heights)
        TouchReader.add_sensors(spec, children)
        return cls(wrapper.MjData(wrapper.MjModel(compile_house(spec))), embodiment)

    # dm_control copies and pickles only a simulation's data, without robot, ramp and the children's figures.

    def copy(self, share_model: bool = False) -> Physics:
        copied = super().copy(share_model)
        copied._embody(self.embodiment, self._ramp_state())
        if share_model:  # the original poses the figures, part of the model
            copied.figures = []
        copied._pose_figures(self._figure_states())
        return copied

    # MuJoCo's pickles lose the numbers of awake trees and bodies, without which the next step is a fatal error.

    def __getstate__(self) -> _Pickled:
        awake = {name: getattr(self._raw[1], name) for name in _AWAKE}
        return super().__getstate__(), self.embodiment, self._ramp_state(), awake, self._figure_states()

    def __setstate__(self, state: _Pickled) -> None:
        data, embodiment, ramp, awake, figures = state
        super().__setstate__(data)
        self._embody(embodiment, ramp)
        self._pose_figures(figures)
        for name, count in awake.items():
            setattr(self._raw[1], name, count)

    def __del__(self) -> None:
        # dm_control's named views have reference cycles. Breaking them here avoids garbage collection in a later
        # episode, which takes 50 ms for ten simulations.
        for view in getattr(self, "_named", ()):
            for name in [*view._asdict(), "_asdict"]:
                delattr(type(view), name)

    def _reload_from_data(self, data: wrapper.MjData) -> None:
        super()._reload_from_data(data)
        model, raw = self.model.ptr, self.data.ptr
        self._raw, self._timestep = (model, raw), float(model.opt.timestep)
        joints = {model.joint(i).name for i in range(model.njnt)}
        children = next(k for k in itertools.count() if child_joints(k)[0] not in joints)
        names = itertools.chain.from_iterable(map(child_joints, range(children)))
        positions, velocities = joint_views(model, raw, tuple(names))
        self._toddler_positions, self._toddler_velocities = positions.reshape(-1, 3), velocities.reshape(-1, 3)
        first = model.joint(child_joints(0)[0]).dofadr[0]
        forces = raw.qfrc_applied[first : first + 3 * children].reshape(-1, 3)
        self._toddlers = list(zip(self._toddler_positions, self._toddler_velocities, forces, strict=True))
        self.touch_reader = TouchReader(model, raw, children)
        self.carried, self._candles = _free_things(model, raw, Where.ON_TABLE)
        _, self._things = _free_things(model, raw, Where.FLOOR)
        first = len(self._candles)  # free joints of things follow those of candles
        self._thing_bodies = model.jnt_bodyid[first : first + len(self._things)].tolist()
        dofs = model.jnt_dofadr[first : first + len(self._things)].tolist()
        self._thing_velocities = [raw.qvel[dof : dof + 6] for dof in dofs]
        self._loose = loose([layout.thing(kind) for kind in self.carried])
        in_order = (model.joint(i).name for i in range(model.njnt))
        gates = [name.removesuffix("hinge") for name in in_order if name.endswith("/hinge")]
        self._gates = np.empty((0, 2))
        if gates:
            hinges_and_bolts = [gate + joint for gate in gates for joint in ("hinge", "latch")]
            self._gates = joint_views(model, raw, hinges_and_bolts)[0].reshape(-1, 2)
        self._panels = [model.geom(f"{gate}panel").id for gate in gates]
        self._embody(self.embodiment)
        self.figures = [Figure(model, child_prefix(k)) for k in range(children)] if self._has_visuals() else []
        self.touches = []

    def _figure_states(self) -> list[dict[str, float]]:
        return [figure.state for figure in self.figures]

    def _pose_figures(self, states: list[dict[str, float]]) -> None:
        for figure, state in zip(self.figures, states, strict=False):
            figure.state = state

    def _ramp_state(self) -> RampState | None:
        return None if self._robot is None else self._robot.ramp.state

    def _embody(self, embodiment: Embodiment | None, ramp: RampState | None = None) -> None:
        """Make the robot's views, with the state of its ramp if known."""
        self.embodiment = embodiment
        robot = None if embodiment is None else RobotBody(embodiment, *self._raw)
        self._robot: RobotBody = robot  # type: ignore[assignment]  # readouts of the robot require one
        self.touch_reader.robot = robot
        self.live = self._views(robot)
        if robot is not None and ramp is not None:
            robot.ramp.state = ramp
        self._action_shape = (0 if embodiment is None else embodiment.layout.size,)

    def _views(self, robot: RobotBody | None) -> dict[str, np.ndarray]:
        children: tuple[int, ...] = (0,) if len(self._toddlers) == 1 else ()  # a single child has no dimension
        views = {
            "toddler_position": self._toddler_positions[children],
            "toddler_velocity": self._toddler_velocities[children],
            "candle_position": self._candles[:, :3],
            "candle_orientation": self._candles[:, 3:],
            "battery_position": self._things[:, :3],
            "gate_position": self._gates[:, 0],
        }
        if robot is not None:
            views["base_position"], views["base_velocity"] = robot.base
            views["arm_position"], views["arm_velocity"] = robot.arm
            views["finger_position"] = robot.fingers[0]
        return {key: view for key, view in views.items() if len(view)}

    @property
    def has_robot(self) -> bool:
        """Whether there is a robot in the house."""
        return self._robot is not None

    # -- Rendering -------------------------------------------------------------------------------

    def camera_names(self) -> tuple[str, ...]:
        """Return the names of the cameras, as `render` takes them."""
        return tuple(self._raw[0].camera(i).name for i in range(self._raw[0].ncam))

    def check_cameras(self, names: Iterable[str]) -> None:
        """Raise CaregiverError for unknown cameras."""
        there = self.camera_names()
        for name in names:
            if name not in there:
                raise CaregiverError(f"no camera '{name}': there are {', '.join(sorted(there))}")

    def frames(self, overview: bool) -> dict[str, np.ndarray]:
        """Return images of the robot's `eye`, with walls up to the ceiling, and optionally of the `overview`.

        They have no shadows, which take two thirds of the time: by name, uint8 (240, 320, 3).
        """
        names = [EYE, "overview"] if overview else [EYE]
        self.check_cameras(names)
        return {name: self.render(camera_id=name, render_flag_overrides={"shadow": False}) for name in names}

    def render(
        self,
        height: int = 240,
        width: int = 320,
        camera_id: int | str = -1,
        overlays: Sequence[Any] = (),
        depth: bool = False,
        segmentation: bool = False,
        **options: Any,
    ) -> np.ndarray:
        """Render a picture like dm_control, but small ones, and those of the robot's `eye`, without shadows.

        For the `eye`, walls go up to the ceiling. `render_flag_overrides={"shadow": True}` draws shadows.

        `depth` returns distances, m, (height, width); `segmentation` returns numbers and types of objects, (height,
        width, 2). The options are those of `dm_control.mujoco.Physics.render`.
        """
        is_eye = camera_id == EYE or camera_id == mujoco.mj_name2id(self._raw[0], mujoco.mjtObj.mjOBJ_CAMERA, EYE) >= 0
        if is_eye:
            options.setdefault("scene_callback", raise_walls)
        if (is_eye or max(height, width) < _SMALL) and not (depth or segmentation):  # which have no flags
            options.setdefault("render_flag_overrides", {"shadow": False})
        return super().render(height, width, camera_id, overlays, depth, segmentation, **options)

    def camera(self, name: str, width: int, height: int) -> engine.Camera:
        """Return a camera for repeated rendering; without a name, a movable one. Walls are those of `render`."""
        if not name:
            return engine.MovableCamera(self, height, width)
        raised = raise_walls if name == EYE else None
        return engine.Camera(self, height=height, width=width, camera_id=name, scene_callback=raised)

    def _make_rendering_contexts(self) -> None:
        if not self._has_visuals():
            raise RenderingError(
                "cannot render: the house was made with visuals=False, and must be made with visuals=True; in "
                "`evaluate` and `record` a policy must have needs_pictures = True"
            )
        super()._make_rendering_contexts()

    def _has_visuals(self) -> bool:
        return mujoco.mj_name2id(self._raw[0], mujoco.mjtObj.mjOBJ_GEOM, FLOOR) >= 0

    # -- Readouts --------------------------------------------------------------------------------

    def base_position(self) -> np.ndarray:
        """Return the pose x, y (m) and yaw (rad) of the base, (3,)."""
        return self._robot.base[0].copy()

    def base_velocity(self) -> np.ndarray:
        """Return the velocity of the base in the world's axes, (3,), m/s and rad/s."""
        return self._robot.base[1].copy()

    def arm_position(self) -> np.ndarray:
        """Return the joint positions (joints,), rad."""
        return self._robot.arm[0].copy()

    def arm_velocity(self) -> np.ndarray:
        """Return the joint velocities (joints,), rad/s."""
        return self._robot.arm[1].copy()

    def finger_position(self) -> np.ndarray:
        """Return the distance of each finger from the middle, (2,), m."""
        return self._robot.fingers[0].copy()

    def pinch_position(self) -> np.ndarray:
        """Return the middle between the fingertips, (3,), m."""
        return self._robot.pinch.copy()

    def eye_position(self) -> np.ndarray:
        """Return the position of the robot's eye, (3,), m."""
        return self._raw[1].site("robot/eye").xpos.copy()

    def first_hits(self, eye: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the first geoms hit by rays from an eye (3,) through points (n, 3), or -1, and distances, (n,), m."""
        geoms, free, rays = np.full(len(points), -1, np.int32), np.full(len(points), -1.0), points - eye
        if len(points):
            rays /= np.linalg.norm(rays, axis=1, keepdims=True)
            mujoco.mj_multiRay(
                *self._raw, eye, rays.ravel(), _HIDES, True, -1, geoms, free, None, len(points), mujoco.mjMAXVAL
            )
        return geoms, np.where(geoms < 0, np.inf, free)

    def is_gripping(self) -> bool:
        """Return whether the fingers are at most as far apart as round the thickest thing on a table."""
        left, right = self._robot.fingers[0].tolist()
        return left + right < 2 * self._loose

    def toddler_positions(self) -> np.ndarray:
        """Return the pose x, y (m) and yaw (rad) of every child, (children, 3)."""
        return self._toddler_positions.copy()

    def toddler_velocities(self) -> np.ndarray:
        """Return the velocity of every child, (children, 3), m/s and rad/s."""
        return self._toddler_velocities.copy()

    def toddler_position(self, child: int = 0) -> np.ndarray:
        """Return the pose of one child, (3,)."""
        return self._toddler_positions[child].copy()

    def candle_poses(self) -> np.ndarray:
        """Return the position of each candle's foot (m) and its orientation (quaternion), (candles, 7)."""
        return self._candles.copy()

    def candle_upright(self) -> np.ndarray:
        """Return the cosine of each candle's tilt, (candles,)."""
        _, x, y, _ = self.candle_poses()[:, 3:].T
        return 1.0 - 2.0 * (x * x + y * y)

    def thing_positions(self) -> np.ndarray:
        """Return the foot of each small thing that initially lay on the floor, (things, 3), m."""
        return self._things[:, :3].copy()

    def robot_touches_thing(self, index: int) -> bool:
        """Return whether the robot touches a small thing."""
        model, data = self._raw
        pairs = data.contact.geom[(model.geom_bodyid[data.contact.geom] == self._thing_bodies[index]).any(axis=1)]
        return any(model.geom(int(geom)).name.startswith("robot/") for geom in pairs.flat)

    def gate_positions(self) -> np.ndarray:
        """Return the opening angle of each gate, (gates,), rad."""
        return self._gates[:, 0].copy()

    def panel_positions(self) -> np.ndarray:
        """Return the middle of each gate's panel, (gates, 3), m."""
        return self._raw[1].geom_xpos[self._panels]

    def gates_latched(self) -> list[bool]:
        """Return whether each gate is closed with its bolt behind the keeper."""
        return [hinge < layout.GATE_SHUT and bolt < _SPRUNG for hinge, bolt in self._gates.tolist()]

    def action_spec(self) -> specs.BoundedArray:
        """Return the specification of actions, see `RobotBody.action_spec`; it is empty without a robot."""
        return self._robot.action_spec() if self.has_robot else specs.BoundedArray((0,), float, [], [], name="")

    # -- Writing ---------------------------------------------------------------------------------

    def set_action(self, action: np.ndarray, seconds: float = 0.0) -> None:
        """Set the commands of the robot's actuators until the next action; (0,) without a robot.

        They reach their targets in `seconds` (`TargetRamp`), until the next action; by default at once.

        Raises:
            CaregiverError: The action has another shape, or a value that is not finite.
        """
        try:
            action = np.asarray(action, float)
        except (TypeError, ValueError):
            raise CaregiverError(f"an action must be an array of numbers, got {action!r}") from None
        if action.shape != self._action_shape:
            raise CaregiverError(f"an action must have shape {self._action_shape}, got {action.shape}")
        if not math.isfinite(sum(action.tolist())) and not np.isfinite(action).all():  # huge ones add up to infinity
            index = int(np.flatnonzero(~np.isfinite(action))[0])
            name = self.action_spec().name.split("\t")[index]
            raise CaregiverError(f"action[{index}] ({name}) must be finite, got {action[index]}")
        if self._robot is not None:
            self._robot.set_action(action, max(1, round(seconds / self._timestep)))

    def set_toddler(
        self,
        walk: ToddlerWalk,
        child: int = 0,
        lean: Vector = (0.0, 0.0),
        sway: Vector = (0.0, 0.0),
        force: Vector = (0.0, 0.0),
    ) -> None:
        """Move a child to its walk; a compliant body leans (m) and sways (m/s), with a force (N) until the next."""
        position, velocity, pull = self._toddlers[child]
        (x, y), (vx, vy) = walk.position, walk.velocity
        position[0], position[1], position[2] = x + lean[0], y + lean[1], walk.yaw
        velocity[0], velocity[1], velocity[2] = vx + sway[0], vy + sway[1], walk.yaw_rate
        pull[0], pull[1] = force

    def soften_toddlers(self, time_constant: float, damping_ratio: float) -> None:
        """Set the softness of all contacts of children, see MuJoCo's `solref`."""
        for geom in self.touch_reader.bodies:
            self.model.geom_solref[geom] = time_constant, damping_ratio
            self.model.geom_priority[geom] = 1  # overrides the other geom's softness

    def set_robot(self, base: np.ndarray, arm: np.ndarray | None = None) -> None:
        """Place the robot with an open hand: base pose (3,) and arm joints (joints,), tucked by default."""
        self._robot.place(base, arm)

    def set_candle(self, index: int, position: np.ndarray, yaw: float) -> None:
        """Place a candle upright, at the start of an episode."""
        self._candles[index] = [*position, math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)]

    def set_thing(self, index: int, place: Sequence[float], yaw: float = 0.0) -> None:
        """Place a small thing at rest, at the start of an episode or with the child that has taken it."""
        self._things[index] = [*place, math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)]
        self._thing_velocities[index][:] = 0.0

    def set_gates(self, angle: float = layout.GATE_OPEN) -> None:
        """Set the opening angle of all gates, rad, at the start of an episode."""
        self._gates[:, 0] = angle

    # -- Stepping --------------------------------------------------------------------------------

    def step(self, nstep: int = 1) -> None:
        """Advance the simulation, and store the children's contacts of every physics step in `touches`."""
        (model, data), reader, robot = self._raw, self.touch_reader, self._robot
        self.touches = []
        warnings = self._warnings.tolist()
        for _ in range(nstep):
            if robot is not None:
                robot.ramp.advance()
            mujoco.mj_step(model, data)
            if reader.is_any():
                self.touches += reader.read()
        # dm_control's check takes 7 % of the closed loop's time, so it runs only after a warning.
        if self._warnings.tolist() != warnings:
            with self.check_invalid_state():
                self._warnings_before[:] = warnings


def raise_walls(physics: engine.Physics, scene: wrapper.MjvScene) -> None:
    """Raise a scene's walls to the ceiling."""
    paint, cap = (physics.model.name2id(name, "material") for name in ("paint", "cap"))
    for geom in scene.geoms:
        if geom.matid == paint:
            geom.pos[2] = geom.size[2] = layout.CEILING / 2
        elif geom.matid == cap:  # caps
            geom.pos[2] = layout.CEILING


def compile_house(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile the scene of a house, and set options that depend on its size or that MJCF lacks."""
    model = spec.compile()
    for number in map(model.numeric, range(model.nnumeric)):
        thing, _, field = number.name.rpartition("/")
        if field == "dof_length":  # length scale of rotations in MuJoCo's sleep criterion, from the thing's model
            first = model.joint(f"{thing}/joint").dofadr[0] + 3
            model.dof_length[first : first + 3] = number.data
    if model.nv > _DENSE:
        model.opt.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    return model


def _free_things(model: mujoco.MjModel, data: mujoco.MjData, where: Where) -> tuple[tuple[HazardKind, ...], np.ndarray]:
    """Return the kinds of the free things in one place of the plan, and their poses, a view of qpos, (n, 7)."""
    names = [model.joint(i).name for i in range(model.njnt)]
    counts = [(kind, sum(name.startswith(f"{kind}_") for name in names)) for kind in kinds_at(where)]
    kinds = tuple(kind for kind, count in counts for _ in range(count))
    first = next((model.joint(f"{kind}_0/joint").qposadr[0] for kind, count in counts if count), 0)
    return kinds, data.qpos[first : first + 7 * len(kinds)].reshape(-1, 7)  # in this order, see `build_house`

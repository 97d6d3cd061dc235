"""The arm: forward and inverse kinematics on a model of the robot alone.

Poses are in the base's frame (x ahead, z up, origin on the floor). On its way to a table the hand keeps one
orientation, pitched down so that the wrist clears the table's top; an upright candle stays upright in it.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
import threading
from collections.abc import Sequence
from typing import Any

import mink
import mujoco
import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.layout import Thing
from caregiver_mj.robot import geometry
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.geometry import Vector, hand_rotation
from caregiver_mj.robot.robot_model import add_tray, read_spec
from caregiver_mj.robot.view import LOOSE, View

_TOLERANCE = 1e-5  # m, rad
_ITERATIONS = 40
_DIGITS = 9  # decimals of joint positions, rad
_STEP = 0.5  # rad; greatest motion of a joint in an iteration
_CLEAR = 0.02  # m; gap between parts of the robot
_NEIGHBOURS = 2  # joints between parts that always meet at them
_HOLD_COST = 0.5  # cost of a held joint, relative to the hand's
ATTEMPTS = 3  # most attempts at a grasp
_GIVES = 0.01  # m; deviation of the fingers' total opening below the thickness of a held thing


class Arm:
    """Kinematics of a robot's arm, on its own model, apart from the simulation.

    A lock serialises threads, which share that model.

    Attributes:
        embodiment: The robot.
        ranges: Lowest and highest joint positions, (joints,) each, rad.
    """

    def __init__(self, embodiment: Embodiment):
        self.embodiment = embodiment
        self._lock = threading.Lock()
        spec = read_spec(embodiment.model)
        for geom in spec.geoms:
            if geom.mass == 0:  # moving bodies have masses of their own; shapes are not needed here
                spec.delete(geom)
        self._model = spec.compile()
        self._configuration = mink.Configuration(self._model)
        self._data = mujoco.MjData(self._model)
        self._pinch = self._data.site_xpos[self._model.site("pinch").id]
        joints = embodiment.names.arm
        self._arm = np.array([self._model.joint(name).qposadr[0] for name in joints])
        self._joints = self._data.qpos[self._arm[0] : self._arm[0] + len(joints)]
        self._task = mink.FrameTask("pinch", "site", position_cost=1.0, orientation_cost=1.0, lm_damping=1e-6)
        cost = np.zeros(self._model.nv)
        if embodiment.bends.held is not None:
            cost[self._arm[embodiment.bends.held]] = _HOLD_COST
        self._posture = mink.PostureTask(self._model, cost=cost)
        still = np.full(self._model.nv, 1e4)
        still[self._arm] = 1e-3
        self._damping = mink.DampingTask(self._model, cost=still)  # holds base, wheels and fingers still
        self._limits = [mink.ConfigurationLimit(self._model)]
        self.ranges = tuple(np.array([self._model.joint(name).range for name in joints]).T)

    def __deepcopy__(self, memo: dict[int, Any]) -> Arm:
        """Return itself: calls leave no state, and a lock serialises threads."""
        return self

    def solve(self, x: float, z: float, guess: np.ndarray | None = None) -> np.ndarray:
        """Return joint positions, rad, (joints,), with the hand in the base's middle plane, as at a standing candle.

        The pinch point is x metres ahead of the base's centre and z above the floor. The guess, (joints,), is near the
        tucked arm's by default.

        Raises:
            CaregiverError: The arm cannot reach that point.
        """
        guess = self.embodiment.bends.tucked if guess is None else guess
        return self.solve_pose(np.array([x, 0.0, z]), hand_rotation(0.0, self.embodiment.postures.hand_pitch), guess)

    def solve_pose(self, position: np.ndarray, rotation: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Return joint positions, rad, (joints,), for any pose of the hand, searched from a guess, (joints,).

        The position is that of the pinch point, (3,), m; the rotation is (3, 3), see `hand_rotation`.

        Raises:
            CaregiverError: The arm cannot reach that pose, or not from that guess.
        """
        q = np.zeros(self._model.nq)
        q[self._arm] = guess
        tasks = [self._task, self._posture, self._damping]
        with self._lock:
            self._configuration.update(q)
            self._posture.set_target(q)
            self._task.set_target(mink.SE3.from_rotation_and_translation(mink.SO3.from_matrix(rotation), position))
            for _ in range(_ITERATIONS):
                if np.abs(self._task.compute_error(self._configuration)).max() < _TOLERANCE:
                    # Rounded: the last digits depend on BLAS's kernels for the processor.
                    return self._configuration.q[self._arm].round(_DIGITS)
                try:
                    velocity = mink.solve_ik(self._configuration, tasks, 1.0, "daqp", limits=self._limits)
                except mink.MinkError:
                    break
                step = min(1.0, _STEP / np.abs(velocity).max())
                self._configuration.integrate_inplace(velocity, step)
        raise CaregiverError(f"the arm cannot reach {position[0]:.3f} m ahead at a height of {position[2]:.3f} m")

    def solve_nearest(self, position: np.ndarray, rotation: np.ndarray, guesses: Sequence[np.ndarray]) -> np.ndarray:
        """Return `solve_pose` from the first successful guess, or raise CaregiverError if there is none."""
        for guess in guesses[:-1]:
            with contextlib.suppress(CaregiverError):
                return self.solve_pose(position, rotation, guess)
        return self.solve_pose(position, rotation, guesses[-1])

    def pinch(self, q: np.ndarray) -> np.ndarray:
        """Return the pinch point, (3,), m, for joint positions, rad, (joints,): forward kinematics."""
        with self._lock:
            self._joints[:] = q
            mujoco.mj_kinematics(self._model, self._data)
            return self._pinch.copy()

    @functools.cached_property
    def tucked(self) -> np.ndarray:
        """Joint positions of the tucked arm, rad, (joints,)."""
        joints = self.solve(*self.embodiment.postures.carry)
        joints.flags.writeable = False
        return joints

    def clears_itself(self, joints: np.ndarray, tray: bool = False) -> bool:
        """Return whether the robot's parts, except neighbours and optionally with its tray, clear each other."""
        model, data, apart = self._own_shapes[tray]
        with self._lock:
            data.qpos[self._arm] = joints
            mujoco.mj_kinematics(model, data)
            mujoco.mj_collision(model, data)
            near = data.contact.dist < _CLEAR  # margins of geoms add up
            return not apart[tuple(data.contact.geom[near].T)].any()

    @functools.cached_property
    def _own_shapes(self) -> tuple[tuple[mujoco.MjModel, mujoco.MjData, np.ndarray], ...]:
        """Models for self-collision, and pairs of geoms that are no neighbours: without and with tray."""
        bare, trayed = read_spec(self.embodiment.model), read_spec(self.embodiment.model)
        add_tray(trayed)
        return self._shapes(bare), self._shapes(trayed)

    def _shapes(self, spec: mujoco.MjSpec) -> tuple[mujoco.MjModel, mujoco.MjData, np.ndarray]:
        for geom in spec.geoms:
            geom.contype = geom.conaffinity = int(geom.contype > 0)  # without bumpers, which are for furniture
            geom.margin = _CLEAR
        model = spec.compile()
        hand = model.body("hand").id
        bodies = [hand if model.body_parentid[body] == hand else int(body) for body in model.geom_bodyid]
        depths = np.array([_depth(model, body) for body in bodies])
        return model, mujoco.MjData(model), np.abs(depths[:, None] - depths) > _NEIGHBOURS

    def may_reach(self, point: np.ndarray, rotation: np.ndarray) -> bool:
        """Return whether a pose of the hand, as for `solve_pose`, is near enough to try."""
        shoulder, longest, hand = self._lengths
        return math.dist(point - hand * rotation[:, 2], shoulder) < longest

    @functools.cached_property
    def _lengths(self) -> tuple[np.ndarray, float, float]:
        """Position of the shoulder (3,), greatest distance of the wrist from it, and the hand's length, m."""
        data = mujoco.MjData(self._model)
        mujoco.mj_kinematics(self._model, data)
        places = [data.body(name).xpos.copy() for name in self.embodiment.names.chain]
        longest = sum(math.dist(a, b) for a, b in itertools.pairwise(places))
        return places[0], longest, math.dist(places[-1], data.site("pinch").xpos)


def _depth(model: mujoco.MjModel, body: int) -> int:
    return 0 if body == 0 else 1 + _depth(model, int(model.body_parentid[body]))


@functools.cache
def arm_of(embodiment: Embodiment) -> Arm:
    """Return the arm of a robot, cached: it is costly to make, and stateless."""
    return Arm(embodiment)


@functools.lru_cache(maxsize=1)  # several callers a timestep
def hand_position(view: View, robot: Embodiment) -> np.ndarray:
    """Return the pinch point of a robot in the house, (3,)."""
    x, y, z = arm_of(robot).pinch(view.arm).tolist()
    return np.array([*geometry.to_world(view.base, (x, y)), z])


def hand_offset(view: View, robot: Embodiment) -> Vector:
    """Return its offset from the base's centre in the house's axes, (x, y)."""
    x, y, _ = hand_position(view, robot).tolist()
    return x - view.base[0], y - view.base[1]


def has_in_hand(view: View, robot: Embodiment, candle: int, thing: Thing) -> bool:
    """Return whether the fingers have closed on a candle, or another such thing."""
    return not hand_is_empty(view, thing) and is_at_hand(view, robot, candle, thing)


def is_at_hand(view: View, robot: Embodiment, candle: int, thing: Thing) -> bool:
    """Return whether a candle, or another such thing, is where the hand would hold it."""
    return math.dist(view.candles[candle].tolist(), hand_position(view, robot).tolist()) < thing.height


def is_round(thing: Thing, fingers: float) -> bool:
    """Return whether the fingers' total opening shows that they have closed on a thing."""
    return 2 * thing.radius - _GIVES <= fingers < 2 * (thing.radius + LOOSE)


def hand_is_empty(view: View, thing: Thing) -> bool:
    """Return whether the fingers have closed on nothing: they are closer than round a thing."""
    return view.fingers < 2 * thing.radius - _GIVES

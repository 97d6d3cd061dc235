"""The house as the robot knows it, to check poses for contacts before taking them."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Sequence
from typing import Any

import mujoco
import numpy as np

from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import Where
from caregiver_mj.robot.embodiment import Embodiment

_ELSEWHERE = 1e3  # metres; the child is left out, for it will be somewhere else
_RESTING = 0.004  # metres that a candle may be in what it lies on
TABLE_MARGIN = 0.03  # metres that a table may be off its place on the map, to either side
_MARGIN = 0.005  # metres that the robot shall stay away from everything


class PlanningScene:
    """Collision checks against walls, furniture, floor and candles, with MuJoCo's own geometry of them.

    It is made of a house with robot, toddler and candles, named as in the simulation, which becomes the scene's own.
    Nothing moves in it: poses are set and contacts looked at, for one thread after the other. It is costly to make (as
    costly as the house itself), so make it when it is first needed.
    """

    def __init__(self, spec: mujoco.MjSpec, plan: FloorPlan, robot: Embodiment):
        spec.option.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)  # a body asleep has no contacts
        for geom in spec.geoms:  # before it is compiled: boxes about bodies, which rule contacts out, are made then
            if geom.name.startswith("robot/"):
                geom.margin = _MARGIN
            elif geom.name.startswith("table_") and geom.name.endswith("/top"):
                geom.size[:2] += TABLE_MARGIN
        self._lock = threading.Lock()
        self._model = model = spec.compile()
        self._data = mujoco.MjData(model)
        names = [model.geom(i).name for i in range(model.ngeom)]
        self._robot = np.array([name.startswith("robot/") for name in names])
        self._pads = np.array([name.endswith("_pad") for name in names])
        things = [hazard.element for hazard in plan.hazards.at(Where.ON_TABLE)]
        # Which geoms are of each, and how far to open the hand for it; the last ones are for NOTHING.
        self._things = [np.array([name.startswith(f"{one}/") for name in names]) for one in things]
        self._things.append(np.zeros(len(names), bool))
        self._open = [*map(robot.grasp.opened, layout.things(plan)), robot.grasp.open]
        joints = (robot.names.base, robot.names.arm, robot.names.fingers)
        rows = ([model.joint(f"robot/{name}").qposadr[0] for name in part] for part in joints)
        self._base, self._arm, self._fingers = rows
        candles = [model.joint(f"{one}/joint").qposadr[0] for one in things]
        self._candles = np.array(candles, int)[:, None] + np.arange(7)
        self._hand = self._data.body("robot/hand")
        self._data.qpos[model.joint("toddler/x").qposadr[0]] = _ELSEWHERE

    def __deepcopy__(self, memo: dict[int, Any]) -> PlanningScene:
        """Return itself: calls leave no state, and a lock serialises threads."""
        return self

    def is_free(
        self, base: Sequence[float], arm: Iterable[np.ndarray], candles: np.ndarray, between: int, held: bool = False
    ) -> bool:
        """Return whether the robot touches nothing, its base at (x, y, yaw) and its arm at one posture after the other.

        Postures are joint positions (joints,), in radians. The hand is open. The candles have poses (candles, 7),
        metres and quaternions. That of the index `between`, or NOTHING, may be between the fingers. If it is held, the
        hand has got it at the first of the arm's poses and takes it along; it must then touch nothing either, once it
        has been lifted.
        """
        qpos = self._data.qpos
        carried: tuple[np.ndarray, np.ndarray] | None = None  # the candle in the hand's frame
        with self._lock:
            qpos[self._base], qpos[self._candles], qpos[self._fingers] = base, candles, self._open[between]
            for joints in arm:
                qpos[self._arm] = joints
                mujoco.mj_kinematics(self._model, self._data)
                if held and carried is None:
                    carried = self._in_hand(between)
                elif carried is not None:
                    self._carry(between, *carried)
                if self._touches(self._things[between], held):
                    return False
        return True

    def _in_hand(self, candle: int) -> tuple[np.ndarray, np.ndarray]:
        """Pose of a candle, position (3,) and quaternion (4,), in the hand's frame."""
        back, turn, place, orientation = np.empty(3), np.empty(4), np.empty(3), np.empty(4)
        pose = self._data.qpos[self._candles[candle]]
        mujoco.mju_negPose(back, turn, self._hand.xpos, self._hand.xquat)
        mujoco.mju_mulPose(place, orientation, back, turn, pose[:3], pose[3:])
        return place, orientation

    def _carry(self, candle: int, place: np.ndarray, orientation: np.ndarray) -> None:
        """Move a candle, whose pose in the hand's frame is given, to where the hand is now."""
        position, quaternion = np.empty(3), np.empty(4)
        mujoco.mju_mulPose(position, quaternion, self._hand.xpos, self._hand.xquat, place, orientation)
        self._data.qpos[self._candles[candle]] = [*position, *quaternion]
        mujoco.mj_kinematics(self._model, self._data)

    def _touches(self, thing: np.ndarray, held: bool) -> bool:
        """Whether there is a contact of the robot, or of what it holds, that should not be: which geoms (n,)."""
        mujoco.mj_collision(self._model, self._data)
        one, two = self._data.contact.geom.T
        mine = self._robot | (held & thing)
        gripping = (self._pads[one] & thing[two]) | (self._pads[two] & thing[one])
        # What holds a candle up before it is lifted is no obstacle.
        resting = held & (thing[one] | thing[two]) & (self._data.contact.dist > -_RESTING)
        return bool(((mine[one] != mine[two]) & ~gripping & ~resting).any())

"""The house as the robot knows it, for collision checks of poses."""

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

_ELSEWHERE = 1e3  # m; place of the child out of the way, as it will have moved
_RESTING = 0.004  # m; penetration of a resting candle
TABLE_MARGIN = 0.03  # m; error of a table's place on the map
_MARGIN = 0.005  # m; gap between the robot and everything


class PlanningScene:
    """Collision checks against walls, furniture, floor and candles, by MuJoCo.

    It takes over a specification of the house with robot, toddler and candles, named as in the simulation. Nothing
    moves in it: it sets poses and reads contacts, one thread at a time. Making it is as costly as making the house, so
    make it on first use.
    """

    def __init__(self, spec: mujoco.MjSpec, plan: FloorPlan, robot: Embodiment):
        spec.option.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)  # sleeping bodies have no contacts
        for geom in spec.geoms:  # before compiling, which makes the bounding boxes
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
        # Geoms of each thing, and the opening of the hand for it; the last are for NOTHING.
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
        """Return whether the robot touches nothing with its base at (x, y, yaw) and its arm at each of some postures.

        Postures are joint positions, rad, (joints,); the hand is open. Candles have poses (candles, 7), m and
        quaternions. Candle `between`, or NOTHING, may be between the fingers. If `held`, the hand takes it along from
        the first posture, and it must touch nothing either once lifted.
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
        """Return the pose of a candle, position (3,) and quaternion (4,), in the hand's frame."""
        back, turn, place, orientation = np.empty(3), np.empty(4), np.empty(3), np.empty(4)
        pose = self._data.qpos[self._candles[candle]]
        mujoco.mju_negPose(back, turn, self._hand.xpos, self._hand.xquat)
        mujoco.mju_mulPose(place, orientation, back, turn, pose[:3], pose[3:])
        return place, orientation

    def _carry(self, candle: int, place: np.ndarray, orientation: np.ndarray) -> None:
        """Move a candle along with the hand, by its pose in the hand's frame."""
        position, quaternion = np.empty(3), np.empty(4)
        mujoco.mju_mulPose(position, quaternion, self._hand.xpos, self._hand.xquat, place, orientation)
        self._data.qpos[self._candles[candle]] = [*position, *quaternion]
        mujoco.mj_kinematics(self._model, self._data)

    def _touches(self, thing: np.ndarray, held: bool) -> bool:
        """Return whether the robot, or the thing that it holds, whose geoms are bool (n,), has a forbidden contact."""
        mujoco.mj_collision(self._model, self._data)
        one, two = self._data.contact.geom.T
        mine = self._robot | (held & thing)
        gripping = (self._pads[one] & thing[two]) | (self._pads[two] & thing[one])
        # The support of a candle is no obstacle before it is lifted.
        resting = held & (thing[one] | thing[two]) & (self._data.contact.dist > -_RESTING)
        return bool(((mine[one] != mine[two]) & ~gripping & ~resting).any())

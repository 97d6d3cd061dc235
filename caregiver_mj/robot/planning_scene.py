"""The house as the robot knows it, to ask what it would touch in a pose before it takes it."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco
import numpy as np

from caregiver_mj.floor_plan import FloorPlan
from caregiver_mj.house import build_house
from caregiver_mj.robot.kinematics import ARM_JOINTS
from caregiver_mj.robot.motion import OPEN

_ELSEWHERE = 1e3  # metres; the child is left out, for it will be somewhere else
_MARGIN = 0.005  # metres that the robot shall stay away from everything


class PlanningScene:
    """Collision checks against walls, furniture, floor and candles, with MuJoCo's own geometry of them.

    Nothing moves in it: poses are set and contacts looked at. It is costly to make (as costly as the house itself), so
    it is made when it is first needed.
    """

    def __init__(self, plan: FloorPlan):
        spec = build_house(plan)
        spec.option.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)  # a body asleep has no contacts
        self._model = model = spec.compile()
        self._data = mujoco.MjData(model)
        names = [model.geom(i).name for i in range(model.ngeom)]
        self._robot = np.array([name.startswith("robot/") for name in names])
        model.geom_margin[self._robot] = _MARGIN
        self._pads = np.array([name.endswith("_pad") for name in names])
        self._wax = [names.index(f"candle_{i}/wax") for i in range(len(plan.candle_tables))]
        self._base = [model.joint(f"robot/base_{axis}").qposadr[0] for axis in ("x", "y", "yaw")]
        self._arm = [model.joint(f"robot/{name}").qposadr[0] for name in ARM_JOINTS]
        fingers = [model.joint(f"robot/finger_{side}").qposadr[0] for side in ("left", "right")]
        candles = [model.joint(f"candle_{i}/joint").qposadr[0] for i in range(len(plan.candle_tables))]
        self._candles = np.array(candles, int)[:, None] + np.arange(7)
        self._data.qpos[model.joint("toddler/x").qposadr[0]] = _ELSEWHERE
        self._data.qpos[fingers] = OPEN

    def is_free(
        self, base: tuple[float, float, float], arm: Iterable[np.ndarray], candles: np.ndarray, between: int
    ) -> bool:
        """Whether the robot touches nothing.

        Args:
            base: Pose (x, y, yaw) of its base, metres and radians.
            arm: Joint positions (7,) one after the other, radians; the hand is open.
            candles: Pose of each candle, (candles, 7), metres and quaternions.
            between: Index of the candle that may be between the fingers.
        """
        qpos = self._data.qpos
        qpos[self._base], qpos[self._candles] = base, candles
        return not any(self._touches(joints, self._wax[between]) for joints in arm)

    def _touches(self, joints: np.ndarray, wax: int) -> bool:
        model, data = self._model, self._data
        data.qpos[self._arm] = joints
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        one, two = data.contact.geom.T
        mine = self._robot[one] != self._robot[two]
        gripping = (self._pads[one] & (two == wax)) | (self._pads[two] & (one == wax))
        return bool((mine & ~gripping).any())

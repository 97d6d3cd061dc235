"""Place: put the candle in the hand down on a table."""

from __future__ import annotations

import math

import numpy as np

from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.robot import geometry
from caregiver_mj.robot.driver import PATIENCE
from caregiver_mj.robot.geometry import Vector
from caregiver_mj.robot.kinematics import arm_of, hand_is_empty, hand_position, is_at_hand
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.skills.at_table import BESIDE_TABLE, AtTable
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import LOOSE, View

# m; slip of a candle outwards in the hand, which grows with the rate of turns, from which on the base turns gently, and
# from which on it turns at most at the third, rad/s, lest the candle be lost.
_SLIPPED, _NEARLY_OUT, _SLOWLY = 0.008, 0.016, 0.4
# Cosine of a candle's tilt in the hand beyond which the fingers may hold less of it than its foot shows: turn slowly.
_UPRIGHT = math.cos(math.radians(5.0))
# m; height of release above the table, so that a settling hand does not set the candle down; its increase as a share of
# a wider thing's excess radius, because its edge arrives first.
_PLACE_GAP, _EDGE = 0.002, 0.12
# m; remaining way of a descending hand within which a lag above the second, m, shows that the candle has landed. Its
# usual lag is half of that.
_LANDS_WITHIN, _LANDED = 0.02, 0.0016
_SPOTS = (0.0, 0.06, -0.06, 0.12, -0.12, 0.18, -0.18)  # m aside of a table's centre, in order of preference
_LOOK_INTERVAL = 0.3  # s between looks at the table


class Place(AtTable):
    """Puts the candle in the hand down on a table, at or near its centre; keeps it in the hand after a failure."""

    def __init__(self, navigator: Navigator, candle: int, table: int):
        super().__init__(navigator, candle, table, loaded=True)
        self._hand = (0.0, 0.0)
        self._spot: Vector | None = None
        self._spot_seen_from: Cell | None = None
        self._look_at, self._full_until = 0.0, math.inf
        self._commanded = math.inf  # m; previous commanded height of the hand

    def _approach(self, view: View, robot: RobotMotion) -> Status:
        # Fingers closer than its width may still hold it by its edge.
        is_unsure = hand_is_empty(view, self.thing) or robot.reached < 1e-6
        if is_unsure and not is_at_hand(view, self.embodiment, self.candle, self.thing):
            return Status.OVERTAKEN  # lost on the way
        if view.now >= self._look_at or self.stand != self._spot_seen_from:
            self._spot, self._look_at = self._free_spot(view), view.now + _LOOK_INTERVAL
        if self._spot is None:  # no room on this table, perhaps temporarily
            self._full_until = min(self._full_until, view.now + PATIENCE)
            robot.reach(0.0)
            return Status.FAILED if view.now >= self._full_until else self.status
        self._full_until = math.inf
        if robot.reached < 1e-6:
            self._hand, height = self._measure(view)
            is_tilted = view.candle_upright(self.candle) < _UPRIGHT
            if is_tilted or self._hand[0] > _SLIPPED:
                robot.turn_gently(_SLOWLY if is_tilted or self._hand[0] > _NEARLY_OUT else math.inf)
            gap = _PLACE_GAP + _EDGE * (self.thing.width - layout.CANDLE_RADIUS)
            robot.plan_reach(view.table_height(self.table) + gap + height)
            self._is_aimed = True
        goal, cell, yaw = self._stand_at_table(view, self._spot, self._hand)
        arrival = self._drive(view, robot, goal, cell, yaw)
        if arrival.failed:
            robot.reach(0.0)
            return Status.FAILED
        on_last = self._prepare_hand(view, robot, goal, yaw)
        has_come = view.now >= robot.reach_arrival - self.embodiment.grasp.release_time
        has_landed = on_last and robot.may_be_off and self._has_landed(view, robot)
        if on_last and arrival is Status.DONE and (has_come or has_landed):
            if not has_come:
                robot.stop_reaching()
            robot.grip(self.embodiment.grasp.opened(self.thing))
            self._stage = self._release
        return Status.COMMITTED if on_last else Status.RUNNING

    def _has_landed(self, view: View, robot: RobotMotion) -> bool:
        """Return whether the candle meets the table early, so that the hand must stop."""
        arm, path = arm_of(self.embodiment), robot.reach_path
        commanded, self._commanded = self._commanded, float(arm.pinch(path.joints(robot.reached))[2])
        is_near = self._commanded - float(arm.pinch(path.joints(path.goal))[2]) < _LANDS_WITHIN
        return is_near and float(arm.pinch(view.arm)[2]) - commanded > _LANDED

    def _release(self, view: View, robot: RobotMotion) -> Status:
        if view.fingers > 2 * (self.thing.radius + LOOSE):
            robot.reach(0.0)
            self._stage = self._retreat
        elif self.driver.patience.is_over(view.now):  # something keeps the fingers from opening
            robot.grip(self.embodiment.grasp.squeezed(self.thing))
            robot.reach(0.0)
            return Status.FAILED
        return Status.COMMITTED

    def _retreat(self, view: View, robot: RobotMotion) -> Status:
        if robot.reached > self._out(self.embodiment.approach.drive, view):
            return Status.COMMITTED
        return Status.DONE if view.stands_on_table(self.candle, self.table) else Status.OVERTAKEN

    def _free_spot(self, view: View) -> Vector | None:
        """Return the place nearest to the table's centre with room for candle and hand, or None."""
        if self.stand is None:
            self.stand = self._choose_stand(view)
        self._spot_seen_from = self.stand
        middle = self._navigator.plan.position(self._navigator.plan.tables[self.table])
        x, y = self._ahead(self.stand)
        aside = np.array([-y, x])
        width, candle = self.embodiment.clearances.hand_width, layout.CANDLE_RADIUS
        taken = []  # intervals, m aside of the centre
        for i in np.flatnonzero(np.abs(view.candles[:, :2] - middle).max(axis=1) < BESIDE_TABLE):
            thing = self._things[i]
            ends = view.candles[i] + np.outer([0.0, thing.height], view.candle_axis(int(i)))
            if i != self.candle and ends[0, 2] > layout.TABLE_HEIGHT / 2:
                low, high = sorted(((ends[:, :2] - middle) * aside).sum(axis=1).tolist())
                taken.append((low - (thing.width - candle), high + (thing.width - candle)))
        for offset in _SPOTS:
            if all(offset <= low - width or offset >= high + width for low, high in taken):
                return tuple((middle + offset * aside).tolist())
        return None

    def _measure(self, view: View) -> tuple[Vector, float]:
        """Measure the candle's place in the hand, because it may have slipped.

        Returns:
            Position of its foot relative to the pinch point, in the base's frame, rounded to 1 mm so that noise moves
            no goals; and the foot's depth below the pinch point, m.
        """
        x, y, z = hand_position(view, self.embodiment).tolist()
        foot = view.candles[self.candle].tolist()
        ahead, aside = geometry.to_local((x, y, view.base[2]), (foot[0], foot[1]))
        return (round(ahead, 3), round(aside, 3)), z - foot[2]

"""Pick: take a standing candle off its table."""

from __future__ import annotations

import math

from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.robot import geometry
from caregiver_mj.robot.kinematics import ATTEMPTS, hand_is_empty
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.planning_scene import TABLE_MARGIN
from caregiver_mj.robot.skills.at_table import BESIDE_TABLE, AtTable
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View

_LIFTED = 0.01  # m; rise of a candle that comes up with the hand
_RISES = 0.12  # s; time within which it must rise
_IN_FRONT = 0.3  # m; range before a candle in which the hand moves down and up
_AJAR = 0.002  # m; deviation of each open finger


class Pick(AtTable):
    """Takes a standing candle off its table, and tucks the arm."""

    def __init__(self, navigator: Navigator, candle: int, table: int):
        super().__init__(navigator, candle, table)
        self._middle = navigator.plan.position(navigator.plan.tables[table]).tolist()  # table's centre
        self._until = 0.0
        self._misses = 0

    def has_way(self, view: View) -> bool:
        """Return whether the hand can reach the candle from any side without knocking another one over."""
        return not all(self._is_barred_by_candle(view, stand) for stand in self._stands(view))

    def _may_stand(self, view: View, cell: Cell) -> bool:
        """Also require that the candle is near enough to this side for the base to clear the table."""
        if not super()._may_stand(view, cell):
            return False
        (ahead_x, ahead_y), (x, y, _) = self._ahead(cell), view.candles[self.candle].tolist()
        behind_middle = (x - self._middle[0]) * ahead_x + (y - self._middle[1]) * ahead_y
        to_candle = self.embodiment.postures.reach - self.embodiment.grasp.depth - self.embodiment.footprint
        return to_candle - behind_middle - layout.TABLE_HALF_SIZE > TABLE_MARGIN

    def _is_barred_by_candle(self, view: View, stand: Cell) -> bool:
        ahead, candle = self._ahead(stand), view.candles[self.candle].tolist()
        for other, (x, y, z) in enumerate(view.candles.tolist()):
            before, aside = geometry.rotate(-math.atan2(ahead[1], ahead[0]), (candle[0] - x, candle[1] - y))
            near = 0.0 < before < _IN_FRONT and abs(aside) < self.embodiment.clearances.hand_width
            if other != self.candle and near and z > layout.TABLE_HEIGHT / 2:
                return True
        return False

    def _approach(self, view: View, robot: RobotMotion) -> Status:
        x, y, z = view.candles[self.candle].tolist()
        if not view.stands_on_table(self.candle, self.table) or math.dist((x, y), self._middle) > BESIDE_TABLE:
            return Status.OVERTAKEN  # it has fallen or gone
        if not any(self._may_stand(view, cell) for cell in self._beside):
            return Status.OVERTAKEN  # it has been moved
        goal, cell, yaw = self._stand_at_table(view, (x, y), hand=(-self.embodiment.grasp.depth, 0.0))
        arrival = self._drive(view, robot, goal, cell, yaw)
        if arrival.failed:
            return arrival
        if robot.reached < 1e-6:
            robot.plan_reach(z + self.thing.grip)
            self._is_aimed = True
        robot.grip(self.embodiment.grasp.opened(self.thing))
        on_last = self._prepare_hand(view, robot, goal, yaw)
        if on_last and arrival is Status.DONE and robot.reached == 1.0:
            self._until = robot.reach_arrival
            self._stage = self._reach_out
        return Status.RUNNING

    def _reach_out(self, view: View, robot: RobotMotion) -> Status:
        if view.now < self._until:
            return Status.RUNNING
        robot.grip(self.embodiment.grasp.squeezed(self.thing))
        self._until = view.now + robot.grip_time
        self._stage = self._grasp
        return Status.COMMITTED

    def _grasp(self, view: View, robot: RobotMotion) -> Status:
        if view.now >= self._until:
            robot.reach(0.0)
            self._until = view.now + _RISES
            self._stage = self._lift
        return Status.COMMITTED

    def _lift(self, view: View, robot: RobotMotion) -> Status:
        approach = self.embodiment.approach
        up = robot.reached <= approach.drive_loaded and view.now - view.age >= self._until
        stays = up and view.candles[self.candle, 2] < view.table_height(self.table) + _LIFTED
        if hand_is_empty(view, self.thing) or stays:
            self._misses += 1
            robot.grip(self.embodiment.grasp.opened(self.thing))
            robot.reach(self._out(approach.above, view))
            self._stage = self._open_again
            return Status.FAILED if self._misses == ATTEMPTS else Status.RUNNING
        return Status.DONE if up else Status.COMMITTED

    def _open_again(self, view: View, robot: RobotMotion) -> Status:
        wide = 2 * (self.embodiment.grasp.opened(self.thing) - _AJAR)
        if robot.reached == self._out(self.embodiment.approach.above, view) and view.fingers > wide:
            self._stage = self._approach
        elif self.driver.patience.is_over(view.now):  # something keeps the fingers from opening
            return Status.FAILED
        return Status.RUNNING

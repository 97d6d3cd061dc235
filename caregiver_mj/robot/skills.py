"""What the robot can do: block, stand aside, pick, place.

Each skill is a small state machine over references. Its `step` is called once a control timestep; it looks at a `View`
of the world, sets goals of the `RobotMotion` and returns whether it is done. Skills know tables, candles and cells, but
nothing of danger.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from caregiver_mj import layout
from caregiver_mj.floor_plan import Cell
from caregiver_mj.robot import kinematics, motion
from caregiver_mj.robot.driving import FORESIGHT, MAY_DRIVE, Skill, View, child_cells
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.trajectories import Vector

CANDLE_RADIUS = 0.022  # metres
GRASP_HEIGHT = 0.10  # metres above a candle's foot at which it is gripped

# While the base still drives up to a table, the hand may come out as far as this, once it points the right way:
_ABOVE = 0.62  # of the reach: all of the hand is then higher than a candle; and when the base is nearly in line
_HOVER = 0.72  # of the reach: only the fingertips are not
_ABOVE_DISTANCE, _ABOVE_YAW = 0.60, 0.35  # metres and radians to go
_HOVER_ACROSS, _HOVER_DISTANCE, _HOVER_YAW = 0.04, 0.30, 0.12  # metres, metres, radians to go
# The last of the way down begins this little before the base has arrived, so that it is there before the fingers are
# beside the candle; if the child slows it down, only at the very end.
_LAST_TIME, _LAST_DISTANCE, _LAST_YAW = 0.28, 0.14, 0.08  # seconds, metres, radians to go
_LAST_DISTANCE_SLOWED = 0.01  # metres
# How far out the hand may be when the base sets off with a candle that is clear of the table. With an empty hand it is
# less, clear of a candle that it has let go.
_MAY_DRIVE_LOADED = 0.82

# Metres that the candle shall be nearer than the middle of the fingers: with 12 mm more it is held, with 12 mm less it
# may be lost on the way. So what is perceived wrongly can be off as far either way.
_GRASP_DEPTH = 0.003
_GRIP_TIME = 0.12  # seconds from closing to a firm grip
_PLACE_GAP = 0.001  # metres above the table at which a candle is let go
# The fingers begin to give way this little before the hand is down: they squeeze less and less, and let go 0.1 s later.
# Much earlier (0.06 s), and the candle is not yet pressed upright: it rocks for a third of a second.
_RELEASE_TIME = 0.03  # seconds
_RELEASE_GAP = CANDLE_RADIUS + 0.002  # metres of each finger off the middle, when the hand may withdraw


class Block(Skill):
    """Stands in a stairwell. Done when the base is there; goes on standing as long as it is stepped."""

    def __init__(self, navigator: Navigator, stairwell: int):
        super().__init__(navigator)
        self.stairwell = stairwell
        self._cell = navigator.plan.stairwells[stairwell]
        self._goal = tuple(navigator.plan.position(self._cell).tolist())

    def step(self, view: View, robot: RobotMotion) -> bool:
        robot.reach(0.0)
        there = self._drive(view, robot, self._goal, self._cell, robot.yaw)
        return there or (math.dist(self._goal, view.base[:2]) < 0.03 and not robot.moving)


class StandAside(Skill):
    """Keeps out of the child's way, for as long as there is nothing else to do."""

    def __init__(self, navigator: Navigator):
        super().__init__(navigator)
        self._cell: Cell | None = None

    def step(self, view: View, robot: RobotMotion) -> bool:
        robot.reach(0.0)
        navigator = self._navigator
        if self._cell is None or view.now >= self._replan_at:
            here = navigator.nearest_cell(view.base[:2])
            child = navigator.plan.cell_at(np.array(view.child))
            self._cell = navigator.refuge(here, child, child_cells(view, navigator)) or here
        goal = tuple(navigator.plan.position(self._cell).tolist())
        self._drive(view, robot, goal, self._cell, robot.yaw)
        return False


class _AtTable(Skill):
    """What picking and placing share: to stand before a table, and to bring the hand out on the way there."""

    def _stand_at_table(
        self, view: View, table: int, spot: Vector, hand: Vector = (0.0, 0.0)
    ) -> tuple[Vector, Cell, float]:
        """Where to stand so that the hand reaches a spot over a table.

        Args:
            view: What is seen.
            table: Index of the table.
            spot: Where the candle is, or shall be.
            hand: Where the candle is relative to the pinch point, in the base's frame.

        Returns:
            Position and cell to stand in, and the heading.
        """
        plan = self._navigator.plan
        table_cell = plan.tables[table]
        if self._stand is None or (view.now >= self._replan_at and self._stand in child_cells(view, self._navigator)):
            self._stand = self._choose_stand(view, table_cell)
        cell = self._stand
        ahead = (float(table_cell[1] - cell[1]), float(cell[0] - table_cell[0]))  # unit vector in x, y
        reach = kinematics.REACH + hand[0]
        goal = (
            spot[0] - reach * ahead[0] + hand[1] * ahead[1],
            spot[1] - reach * ahead[1] - hand[1] * ahead[0],
        )
        return goal, cell, math.atan2(ahead[1], ahead[0])

    def _choose_stand(self, view: View, table_cell: Cell) -> Cell:
        """The free cell beside a table that is quickest to reach, if possible without meeting the child."""
        navigator = self._navigator
        plan = navigator.plan
        cells = plan.free_neighbours(table_cell)
        # Better not where the child could shut the robot in.
        cells = [cell for cell in cells if not plan.traps[plan.cell_index[cell]]] or cells
        start = navigator.nearest_cell(view.base[:2])
        near = math.dist(view.child, view.base[:2]) < FORESIGHT
        around = child_cells(view, navigator) if near else ()

        def cost(cell: Cell) -> float:
            route = navigator.route(start, cell, around)
            if route is None:
                return 1e3 + len(navigator.route(start, cell) or [])
            return math.dist(plan.position(cell), view.base[:2]) + len(route)

        return min(cells, key=cost)

    def _prepare_hand(self, view: View, robot: RobotMotion, goal: Vector, yaw: float) -> bool:
        """Brings the hand out while the base still drives up; returns whether it is on the last of its way."""
        if not robot.turns_to(yaw):  # it cannot before the hand is in
            robot.reach(0.0)
            return False
        dx, dy = goal[0] - view.base[0], goal[1] - view.base[1]
        c, s = math.cos(yaw), math.sin(yaw)
        along, across, turn = c * dx + s * dy, c * dy - s * dx, abs(math.remainder(yaw - view.base[2], math.tau))
        off = math.hypot(dx, dy)
        last_distance = _LAST_DISTANCE if robot.is_unhindered else _LAST_DISTANCE_SLOWED
        if robot.time_left < _LAST_TIME and off < last_distance and turn < _LAST_YAW:
            robot.reach(1.0)
            return True
        if abs(across) < _HOVER_ACROSS and -0.02 < along < _HOVER_DISTANCE and turn < _HOVER_YAW:
            robot.reach(_HOVER)
        elif off < _ABOVE_DISTANCE and turn < _ABOVE_YAW and self._hand_is_clear(view, yaw, goal):
            robot.reach(_ABOVE)
        elif robot.hand_out > 0.0:
            robot.reach(0.0)
        return False

    def _hand_is_clear(self, view: View, yaw: float, goal: Vector) -> bool:
        """Whether the outstretched hand meets no wall on the rest of the base's way."""
        out = kinematics.REACH
        ahead = (out * math.cos(view.base[2]), out * math.sin(view.base[2]))
        final = (goal[0] + out * math.cos(yaw), goal[1] + out * math.sin(yaw))
        return self._navigator.hand_clear((view.base[0] + ahead[0], view.base[1] + ahead[1]), final)


class Pick(_AtTable):
    """Takes a candle off the table on which it stands, and tucks the arm."""

    def __init__(self, navigator: Navigator, candle: int, table: int):
        super().__init__(navigator)
        self.candle, self.table = candle, table
        self.failed = False
        self._stage: Callable[[View, RobotMotion], bool] = self._approach
        self._until = 0.0

    def step(self, view: View, robot: RobotMotion) -> bool:
        return self._stage(view, robot)

    def _approach(self, view: View, robot: RobotMotion) -> bool:
        x, y, z = view.candles[self.candle].tolist()
        goal, cell, yaw = self._stand_at_table(view, self.table, (x, y), hand=(-_GRASP_DEPTH, 0.0))
        there = self._drive(view, robot, goal, cell, yaw)
        if robot.reached < 1e-6:
            robot.plan_reach(z + GRASP_HEIGHT)
        robot.grip(motion.OPEN)
        if self._prepare_hand(view, robot, goal, yaw) and there and robot.reached == 1.0:
            self._until = robot.reach_arrival
            self._stage = self._reach_out
        return False

    def _reach_out(self, view: View, robot: RobotMotion) -> bool:
        if view.now >= self._until:
            self.interruptible = False
            robot.grip(motion.CLOSED)
            self._until = view.now + _GRIP_TIME
            self._stage = self._grasp
        return False

    def _grasp(self, view: View, robot: RobotMotion) -> bool:
        if view.now >= self._until:
            robot.reach(0.0)
            self._stage = self._lift
        return False

    def _lift(self, view: View, robot: RobotMotion) -> bool:
        if robot.reached > _MAY_DRIVE_LOADED:
            return False
        self.failed = _hand_is_empty(view)
        self.interruptible = True
        return True


class Place(_AtTable):
    """Puts the candle in the hand down on a table."""

    interruptible = False
    _may_drive = _MAY_DRIVE_LOADED

    def __init__(self, navigator: Navigator, candle: int, table: int):
        super().__init__(navigator)
        self.candle, self.table = candle, table
        self.failed = False
        self._stage: Callable[[View, RobotMotion], bool] = self._approach
        self._hand = (0.0, 0.0)

    def step(self, view: View, robot: RobotMotion) -> bool:
        return self._stage(view, robot)

    def _approach(self, view: View, robot: RobotMotion) -> bool:
        if _hand_is_empty(view):  # lost on the way
            self.failed = self.interruptible = True
            return True
        spot = tuple(self._navigator.plan.position(self._navigator.plan.tables[self.table]).tolist())
        if robot.reached < 1e-6:
            self._hand, height = self._measure(view)
            robot.plan_reach(layout.TABLE_HEIGHT + _PLACE_GAP + height)
        goal, cell, yaw = self._stand_at_table(view, self.table, spot, self._hand)
        there = self._drive(view, robot, goal, cell, yaw)
        on_last = self._prepare_hand(view, robot, goal, yaw)
        if on_last and there and view.now >= robot.reach_arrival - _RELEASE_TIME:
            robot.grip(motion.OPEN)
            self._stage = self._release
        return False

    def _measure(self, view: View) -> tuple[Vector, float]:
        """The candle's place in the hand, measured again: it may have slipped since the grasp.

        Returns:
            Position of its foot relative to the pinch point (base frame, rounded to 1 mm so that noise moves no
            goals), and how far that is below the pinch point.
        """
        pinch = kinematics.shared_arm().pinch(view.arm)
        x, y, z = view.candles[self.candle].tolist()
        dx, dy, yaw = x - view.base[0], y - view.base[1], view.base[2]
        c, s = math.cos(yaw), math.sin(yaw)
        return (round(c * dx + s * dy - pinch[0], 3), round(c * dy - s * dx - pinch[1], 3)), float(pinch[2] - z)

    def _release(self, view: View, robot: RobotMotion) -> bool:
        if view.fingers > 2 * _RELEASE_GAP:
            robot.reach(0.0)
            self._stage = self._retreat
        return False

    def _retreat(self, view: View, robot: RobotMotion) -> bool:
        self.interruptible = robot.reached <= MAY_DRIVE
        return self.interruptible


def _hand_is_empty(view: View) -> bool:
    """Whether the closed fingers hold nothing: they meet in the middle, which they cannot round a candle."""
    return view.fingers < 2 * CANDLE_RADIUS - 0.01

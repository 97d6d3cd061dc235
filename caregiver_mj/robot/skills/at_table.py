"""Shared by picking and placing: stand at a table, and extend the hand on the way there."""

from __future__ import annotations

import abc
import itertools
import math
from collections.abc import Callable

from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.routes import yielding
from caregiver_mj.robot import geometry
from caregiver_mj.robot.driver import ARRIVED, ARRIVED_YAW, LOOK_AHEAD
from caregiver_mj.robot.geometry import Vector
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.reach import as_high
from caregiver_mj.robot.separation import COMING_GAP, GENTLE_GAP, child_cells, gap, is_child_at_line, near_children
from caregiver_mj.robot.skills.skill import Skill
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import CHILD_RADIUS, View

BESIDE_TABLE = 0.45  # m; distance from a table's nominal centre beyond which nothing is on it

_HOVER_BEYOND = 0.02  # m; overshoot of the base with which the hand may still hover
_AT_ONCE_GAP = 0.3  # m; gap below which a base that lets a child pass leaves at full speed, else slower
_PAST_CANDLE = 100.0  # cells; detour worth taking to not reach over another candle
_CHILD_SOON = 0.5  # s; time within which a walking child may be in the hand's way
_ON_PATH = 0.008  # m; deviation from its path up to which a base arrives as planned while the hand comes down
_LATE = 0.03  # s; age of observations up to which the hand may come down before the base rests
_AS_USUAL = 0.01  # m; excess of a table's height that makes no difference
_CHILD_COMES = 0.4  # m; approach of a child during the base's final turn
_LAST_DISTANCE_SLOWED = 0.01  # m; distance from the goal at which a slowed or stopped base counts as arrived
# s, m/s; total time short of the goal below that speed, with no child close, after which something off the map holds
# the base up
_HELD_UP, _STANDS = 1.5, 0.01
_NOT_QUITE = 0.5  # s; wait of the lowered hand for a base that has not quite arrived


class AtTable(Skill):
    """Takes a candle from a table, or puts one on it, in stages; the first is the approach.

    Attributes:
        candle: Index of the candle.
        table: Index of the table.
        thing: Dimensions of the candle.
        stand: Cell beside the table to stand in; None before it is chosen.
    """

    def __init__(self, navigator: Navigator, candle: int, table: int, loaded: bool = False):
        super().__init__(navigator, loaded)
        self.candle, self.table = candle, table
        self._things = layout.things(navigator.plan)
        self.thing = self._things[candle]
        approach = self.embodiment.approach
        hovers_at = math.hypot(approach.hover_distance, approach.hover_across)
        self._comes_out_at = max(approach.last_distance, hovers_at, approach.above_distance)  # m from the goal
        self._beside = navigator.plan.free_neighbours(navigator.plan.tables[table])
        self.stand: Cell | None = None
        self._stage: Callable[[View, RobotMotion], Status] = self._approach
        self._moved_at = 0.0
        self._held_up_for, self._held_up_at = 0.0, set[Cell]()  # s at the present stand; stands given up
        self._was = 0.0, (0.0, 0.0)  # time and place of the base at the last look
        self._is_aimed = False  # whether this skill has planned the hand's path
        self._came_down_at = math.inf
        self._is_short = False  # whether the hand is down and the base remains short of its goal

    def _act(self, view: View, robot: RobotMotion) -> Status:
        return self._stage(view, robot)

    def _drive(self, view: View, robot: RobotMotion, goal: Vector, cell: Cell, yaw: float) -> Status:
        """Drive on, and make room for a coming child only as far as it follows.

        The way past a toddler is often open during one of its moves only.

        Returns:
            As of `Driver.drive`, or OUT_OF_REACH if something holds the base up on every side of the table.
        """
        status = self.driver.drive(view, robot, goal, cell, yaw)
        if self._is_held_up(view, robot, goal):
            self._held_up_at.add(cell)
            self.stand, self._held_up_for = None, 0.0
            self.driver.patience.begin_anew()
            if not self._stands(view):
                return Status.OUT_OF_REACH
        if self.driver.stands_aside(view.now):
            haste = (COMING_GAP - gap(view, self.embodiment)) / (COMING_GAP - _AT_ONCE_GAP)
            robot.drives = min(robot.drives, max(0.0, haste))
        return status

    def _is_held_up(self, view: View, robot: RobotMotion, goal: Vector) -> bool:
        """Return whether something other than a child has kept the base from the last of its way for long."""
        (before, place), here = self._was, view.base[:2]
        self._was, seconds = (view.now, here), view.now - before
        is_there = math.dist(goal, robot.base_reference()[0]) < 1e-3 and not robot.moving
        is_short = math.dist(goal, here) > ARRIVED and math.dist(place, here) < _STANDS * seconds
        if is_there and is_short and gap(view, self.embodiment) > GENTLE_GAP:
            self._held_up_for += seconds
        return self._held_up_for > _HELD_UP

    def _may_stand(self, view: View, cell: Cell) -> bool:
        """Return whether a cell beside the table is still a possible stand."""
        return cell not in self._held_up_at

    def _stands(self, view: View) -> list[Cell]:
        return [cell for cell in self._beside if self._may_stand(view, cell)]

    @abc.abstractmethod
    def _approach(self, view: View, robot: RobotMotion) -> Status:
        """Drive up and bring the hand out, as the first stage."""

    def _stand_at_table(self, view: View, spot: Vector, hand: Vector) -> tuple[Vector, Cell, float]:
        """Return the stand, as position, cell and heading, from which the hand reaches a spot over the table.

        The candle is, or will be, at the spot; `hand` is its offset from the pinch point in the base's frame.
        """
        is_barred = self.stand and self.driver.looks_again(view.now) and self._is_barred(view, self.stand)
        if self.stand is None or is_barred or not self._may_stand(view, self.stand):
            self.stand = self._choose_stand(view)
        x, y = self._ahead(self.stand)
        reach = self.embodiment.postures.reach + hand[0]
        goal = (spot[0] - reach * x + hand[1] * y, spot[1] - reach * y - hand[1] * x)
        return goal, self.stand, math.atan2(y, x)

    def _ahead(self, stand: Cell) -> Vector:
        """Return the unit vector (x, y) from a stand to the table."""
        table = self._navigator.plan.tables[self.table]
        return float(table[1] - stand[1]), float(stand[0] - table[0])

    def _is_barred(self, view: View, cell: Cell) -> bool:
        """Return whether near children bar every route to a cell."""
        near = near_children(view, view.base[:2])
        if not near:
            return False
        navigator = self._navigator
        start = navigator.nearest_cell(view.base[:2])
        return navigator.route(start, cell, child_cells(near, navigator.plan)) is None

    def _choose_stand(self, view: View) -> Cell:
        """Return the stand that is quickest to reach, if possible without meeting a child."""
        navigator, plan = self._navigator, self._navigator.plan
        cells = self._stands(view)
        # Prefer cells in which a child cannot trap the robot.
        cells = [cell for cell in cells if not yielding(plan).traps[plan.cell_index[cell]]] or cells
        start = navigator.nearest_cell(view.base[:2])
        around = child_cells(near_children(view, view.base[:2]), plan)

        def cost(cell: Cell) -> float:
            route = navigator.route(start, cell, around)
            if route is None:
                return 1e3 + len(navigator.route(start, cell) or [])
            detour = _PAST_CANDLE if self._is_barred_by_candle(view, cell) else 0.0
            return math.dist(plan.position(cell), view.base[:2]) + len(route) + detour

        return min(cells, key=cost)

    def _is_barred_by_candle(self, view: View, stand: Cell) -> bool:
        """Return whether another candle is in the way of a hand that comes from a stand."""
        return False

    def _prepare_hand(self, view: View, robot: RobotMotion, goal: Vector, yaw: float) -> bool:
        """Bring the hand out while the base drives up; return whether it is on the last of its way."""
        approach = self.embodiment.approach
        # A base that steps aside, or stops for another path, may pass a wall with the hand out.
        driver = self.driver
        if not self._is_aimed or not robot.turns_to(yaw) or driver.stands_aside(view.now) or driver.stops_first:
            robot.reach(0.0)
            return False
        off = math.dist(goal, view.base[:2])
        self._note_arrival(view, robot, off)
        if off > self._comes_out_at and robot.hand_out == 0.0:
            return False  # still far away
        along, across = geometry.to_local((*view.base[:2], yaw), goal)
        turn = abs(math.remainder(yaw - view.base[2], math.tau))
        is_late = view.age > _LATE
        is_on_its_path = math.dist(view.base[:2], robot.base_reference()[0]) < _ON_PATH
        at_last = self._rests(view) if is_late else robot.time_left < approach.last_time and is_on_its_path
        at_last &= not robot.stops
        last_distance = approach.last_distance if robot.moving and robot.rate > 0.99 else _LAST_DISTANCE_SLOWED
        if self._is_short:
            last_distance = ARRIVED  # with the hand up the base drives again
        # A coming child would stop the turn, and the hand would come down beside the candle.
        is_alone = view.child_distance(view.base[:2]) > self.embodiment.clearances.child_turning + _CHILD_COMES
        if at_last and off < last_distance and turn < (approach.last_yaw if is_alone else ARRIVED_YAW):
            robot.reach(1.0)
            return True
        if self._child_in_between(view, yaw, along, across):
            robot.reach(0.0)
            return False
        in_line = abs(across) < approach.hover_across and turn < approach.hover_yaw
        near = -_HOVER_BEYOND < along < approach.hover_distance
        # A waiting base must be able to leave, which it does with the hand in.
        if (robot.moving or (is_late and not self._rests(view))) and in_line and near:
            robot.reach(self._out(approach.hover, view))
        elif (
            off < approach.above_distance and turn < approach.above_yaw and self._hand_is_clear(view, robot, yaw, goal)
        ):
            robot.reach(self._out(approach.above, view))
        elif robot.hand_out > 0.0:
            robot.reach(0.0)
        return False

    def _note_arrival(self, view: View, robot: RobotMotion, off: float) -> None:
        """Record when the base last moved, and whether the hand is down with the base short of its goal."""
        if robot.moving:
            self._moved_at, self._is_short = view.now, False
        if robot.reached < 1.0:
            self._came_down_at = view.now
        self._is_short |= off >= ARRIVED and view.now - self._came_down_at > _NOT_QUITE

    def _child_in_between(self, view: View, yaw: float, along: float, across: float) -> bool:
        """Return whether a child is, or will soon be, where the hand comes out between base and table.

        The hand is as low as the child there, and the base minds only its own gap. A base that comes from the side has
        the floor beside the table before it, as far as the hand reaches.
        """
        far, hand = self.embodiment.postures.reach + along, self.embodiment.clearances.hand
        if abs(across) + hand < layout.TABLE_HALF_SIZE:
            far -= layout.TABLE_HALF_SIZE
            if far - self.embodiment.footprint < 2 * CHILD_RADIUS:
                return False  # no child fits in between
        here, there = view.base[:2], geometry.to_world((*view.base[:2], yaw), (far, 0.0))
        return is_child_at_line(view, here, there, hand + CHILD_RADIUS, _CHILD_SOON)

    def _rests(self, view: View) -> bool:
        """Return whether the base has rested for so long that it is seen at its present place."""
        return view.now - self._moved_at > view.age

    def _out(self, share: float, view: View) -> float:
        """Return the hand's extension over this table that is as high as `share` over a standard table."""
        height = view.table_height(self.table)
        if height < layout.TABLE_HEIGHT + _AS_USUAL:
            return share
        arm, grip = arm_of(self.embodiment), self.thing.grip
        return as_high(arm, round(1e3 * (layout.TABLE_HEIGHT + grip)), round(1e3 * (height + grip)), share)

    def _hand_is_clear(self, view: View, robot: RobotMotion, yaw: float, goal: Vector) -> bool:
        """Return whether the extended hand meets no wall on the rest of the base's way.

        A base that was on its way elsewhere first stops, perhaps beyond the goal, and comes back.
        """
        out = (self.embodiment.postures.reach, 0.0)
        places = [(*place, yaw) for place in (*robot.points_ahead(LOOK_AHEAD), goal)]
        hands = [geometry.to_world(place, out) for place in (view.base, *places)]
        return all(itertools.starmap(self._navigator.clearance.hand_clear, itertools.pairwise(hands)))

"""Shared by picking and placing: stand before a table, and extend the hand on the way there."""

from __future__ import annotations

import abc
import itertools
import math
from collections.abc import Callable

from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.routes import yielding
from caregiver_mj.robot import geometry
from caregiver_mj.robot.driver import ARRIVED, ARRIVED_YAW
from caregiver_mj.robot.geometry import Vector
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.reach import as_high
from caregiver_mj.robot.separation import GENTLE_GAP, child_cells, gap, is_child_at_line, near_children
from caregiver_mj.robot.skills.skill import Skill
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import CHILD_RADIUS, View

BESIDE_TABLE = 0.45  # metres from a table's middle beyond which nothing is on it, wherever exactly it stands

_HAND_AHEAD = 1.5  # seconds of the base's way that are looked at for walls
_HOVER_BEYOND = 0.02  # metres by which the base may have gone too far for the hand to hover
# Metres to a child, that it lets pass, from which on the base is far enough off, and below which it makes haste.
_ASIDE_GAP, _AT_ONCE_GAP = 0.9, 0.3
_PAST_CANDLE = 100.0  # cells of detour that it is worth not to reach over another candle
_CHILD_SOON = 0.5  # seconds in which a child that walks on may be in the hand's way
_ON_PATH = 0.008  # metres off its path up to which a base is where it is planned to be when the hand has come down
_LATE = 0.03  # seconds old up to which what is seen is good enough for the last of the way before the base rests
_AS_USUAL = 0.01  # metres that a table may be higher than usual without a difference
_CHILD_COMES = 0.4  # metres that a child comes nearer while the base turns for the last time
_LAST_DISTANCE_SLOWED = 0.01  # metres to go at which a base that is slowed down, or has stopped short, has arrived
# What is not on the map holds the base up if it has stood short of its goal for so many seconds in all, slower than so
# many m/s, with no child at it.
_HELD_UP, _STANDS = 1.5, 0.01
_NOT_QUITE = 0.5  # seconds for which the hand, come down, waits for the base that has not quite arrived


class AtTable(Skill):
    """Takes a candle from, or puts it on, a table, in stages of which the first is to come up to it.

    Attributes:
        candle: Index of the candle.
        table: Index of the table.
        thing: How large the candle is.
        stand: The cell beside the table in which to stand; None before it is chosen.
    """

    def __init__(self, navigator: Navigator, candle: int, table: int, loaded: bool = False):
        super().__init__(navigator, loaded)
        self.candle, self.table = candle, table
        self._things = layout.things(navigator.plan)
        self.thing = self._things[candle]
        approach = self.embodiment.approach
        hovers_at = math.hypot(approach.hover_distance, approach.hover_across)
        self._comes_out_at = max(approach.last_distance, hovers_at, approach.above_distance)  # metres to go
        self._beside = navigator.plan.free_neighbours(navigator.plan.tables[table])
        self.stand: Cell | None = None
        self._stage: Callable[[View, RobotMotion], Status] = self._approach
        self._moved_at = 0.0
        self._held_up_for, self._held_up_at = 0.0, set[Cell]()  # in the present stand, and stands given up for that
        self._was = 0.0, (0.0, 0.0)  # when it was looked at last, and where the base was then
        self._is_aimed = False  # whether the hand has got its path from this skill
        self._came_down_at = math.inf
        self._is_short = False  # whether it came down where the base had not quite arrived, and stays so

    def _act(self, view: View, robot: RobotMotion) -> Status:
        return self._stage(view, robot)

    def _drive(self, view: View, robot: RobotMotion, goal: Vector, cell: Cell, yaw: float) -> Status:
        """Drive on; it gets no farther out of a child's way than that comes after it.

        The way past a toddler is often open for the time of one of its steps only.

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
            haste = (_ASIDE_GAP - gap(view, self.embodiment)) / (_ASIDE_GAP - _AT_ONCE_GAP)
            robot.drives = min(robot.drives, max(0.0, haste))
        return status

    def _is_held_up(self, view: View, robot: RobotMotion, goal: Vector) -> bool:
        """Whether something that is no child has kept the base, for a while in all, from the last of its way."""
        (before, place), here = self._was, view.base[:2]
        self._was, seconds = (view.now, here), view.now - before
        is_there = math.dist(goal, robot.base_reference()[0]) < 1e-3 and not robot.moving
        is_short = math.dist(goal, here) > ARRIVED and math.dist(place, here) < _STANDS * seconds
        if is_there and is_short and gap(view, self.embodiment) > GENTLE_GAP:
            self._held_up_for += seconds
        return self._held_up_for > _HELD_UP

    def _may_stand(self, view: View, cell: Cell) -> bool:
        """Whether the base may yet stand before the table in a cell beside it."""
        return cell not in self._held_up_at

    def _stands(self, view: View) -> list[Cell]:
        """Return these cells."""
        return [cell for cell in self._beside if self._may_stand(view, cell)]

    @abc.abstractmethod
    def _approach(self, view: View, robot: RobotMotion) -> Status:
        """The first stage: drives up, and brings the hand out."""

    def _stand_at_table(self, view: View, spot: Vector, hand: Vector) -> tuple[Vector, Cell, float]:
        """Return where to stand, position, cell and heading, so that the hand reaches a spot over the table.

        A candle is, or shall be, at the spot; `hand` is where it is relative to the pinch point, in the base's frame.
        """
        is_barred = self.stand and self.driver.looks_again(view.now) and self._is_barred(view, self.stand)
        if self.stand is None or is_barred or not self._may_stand(view, self.stand):
            self.stand = self._choose_stand(view)
        x, y = self._ahead(self.stand)
        reach = self.embodiment.postures.reach + hand[0]
        goal = (spot[0] - reach * x + hand[1] * y, spot[1] - reach * y - hand[1] * x)
        return goal, self.stand, math.atan2(y, x)

    def _ahead(self, stand: Cell) -> Vector:
        """Unit vector (x, y) from a stand to the table."""
        table = self._navigator.plan.tables[self.table]
        return float(table[1] - stand[1]), float(stand[0] - table[0])

    def _is_barred(self, view: View, cell: Cell) -> bool:
        """Whether children that are near stand in every way to a cell."""
        near = near_children(view, view.base[:2])
        if not near:
            return False
        navigator = self._navigator
        start = navigator.nearest_cell(view.base[:2])
        return navigator.route(start, cell, child_cells(near, navigator.plan)) is None

    def _choose_stand(self, view: View) -> Cell:
        """The free cell beside the table that is quickest to reach, if possible without meeting a child."""
        navigator, plan = self._navigator, self._navigator.plan
        cells = self._stands(view)
        # Better not where a child could shut the robot in.
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
        """Whether another candle is in the way of the hand that comes from a stand."""
        return False

    def _prepare_hand(self, view: View, robot: RobotMotion, goal: Vector, yaw: float) -> bool:
        """Brings the hand out while the base still drives up; returns whether it is on the last of its way."""
        approach = self.embodiment.approach
        # Neither can it before the hand is in. A base that steps aside may pass a wall where the hand is out.
        driver = self.driver
        if not self._is_aimed or not robot.turns_to(yaw) or driver.stands_aside(view.now) or driver.stops_first:
            robot.reach(0.0)
            return False
        off = math.dist(goal, view.base[:2])
        self._note_arrival(view, robot, off)
        if off > self._comes_out_at and robot.hand_out == 0.0:
            return False  # it has a long way to go yet
        along, across = geometry.to_local((*view.base[:2], yaw), goal)
        turn = abs(math.remainder(yaw - view.base[2], math.tau))
        is_late = view.age > _LATE
        is_on_its_path = math.dist(view.base[:2], robot.base_reference()[0]) < _ON_PATH
        at_last = self._rests(view) if is_late else robot.time_left < approach.last_time and is_on_its_path
        at_last &= not robot.stops
        last_distance = approach.last_distance if robot.moving and robot.rate > 0.99 else _LAST_DISTANCE_SLOWED
        if self._is_short:
            last_distance = ARRIVED  # the base drives again when the hand is up
        # A child that comes stops the turn, and the hand would come down beside the candle.
        is_alone = view.child_distance(view.base[:2]) > self.embodiment.clearances.child_turning + _CHILD_COMES
        if at_last and off < last_distance and turn < (approach.last_yaw if is_alone else ARRIVED_YAW):
            robot.reach(1.0)
            return True
        if self._child_in_between(view, yaw, along, across):
            robot.reach(0.0)
            return False
        in_line = abs(across) < approach.hover_across and turn < approach.hover_yaw
        near = -_HOVER_BEYOND < along < approach.hover_distance
        # A base that waits must be able to leave again, and it leaves with the hand in.
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
        """Take in when the base moved last, and whether the hand has come down where it has not quite arrived."""
        if robot.moving:
            self._moved_at, self._is_short = view.now, False
        if robot.reached < 1.0:
            self._came_down_at = view.now
        self._is_short |= off >= ARRIVED and view.now - self._came_down_at > _NOT_QUITE

    def _child_in_between(self, view: View, yaw: float, along: float, across: float) -> bool:
        """Whether a child is, or will shortly be, where the hand comes out between the base and the table.

        The hand is no higher there than the child, and the base minds only the distance to itself. A base that comes
        from the side has the floor beside the table before it, as far as the hand reaches.
        """
        far, hand = self.embodiment.postures.reach + along, self.embodiment.clearances.hand
        if abs(across) + hand < layout.TABLE_HALF_SIZE:
            far -= layout.TABLE_HALF_SIZE
            if far - self.embodiment.footprint < 2 * CHILD_RADIUS:
                return False  # no child fits in between any more
        here, there = view.base[:2], geometry.to_world((*view.base[:2], yaw), (far, 0.0))
        return is_child_at_line(view, here, there, hand + CHILD_RADIUS, _CHILD_SOON)

    def _rests(self, view: View) -> bool:
        """Whether the base has been at rest for so long that it is seen where it is."""
        return view.now - self._moved_at > view.age

    def _out(self, share: float, view: View) -> float:
        """How far out the hand may be over this table, that may be out by a share over one of the usual height."""
        height = view.table_height(self.table)
        if height < layout.TABLE_HEIGHT + _AS_USUAL:
            return share
        arm, grip = arm_of(self.embodiment), self.thing.grip
        return as_high(arm, round(1e3 * (layout.TABLE_HEIGHT + grip)), round(1e3 * (height + grip)), share)

    def _hand_is_clear(self, view: View, robot: RobotMotion, yaw: float, goal: Vector) -> bool:
        """Return whether the outstretched hand meets no wall on the rest of the base's way.

        That may lead beyond the goal first: a base that was on its way elsewhere has to stop before it comes back.
        """
        out = (self.embodiment.postures.reach, 0.0)
        places = [(*place, yaw) for place in (*robot.points_ahead(_HAND_AHEAD), goal)]
        hands = [geometry.to_world(place, out) for place in (view.base, *places)]
        return all(itertools.starmap(self._navigator.clearance.hand_clear, itertools.pairwise(hands)))

"""Pick a standing candle off its table, and place the candle in the hand on one.

For both the base stands at the table, and the hand comes out on the way there.
"""

from __future__ import annotations

import abc
import itertools
import math
from collections.abc import Callable

import numpy as np

from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.routes import yielding
from caregiver_mj.robot import geometry
from caregiver_mj.robot.driver import ARRIVED, ARRIVED_YAW, LOOK_AHEAD, PATIENCE
from caregiver_mj.robot.geometry import Vector
from caregiver_mj.robot.kinematics import ATTEMPTS, arm_of, hand_is_empty, hand_position, is_at_hand
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.reach import as_high
from caregiver_mj.robot.separation import COMING_GAP, GENTLE_GAP, child_cells, gap, is_child_at_line, near_children
from caregiver_mj.robot.skills.skill import Skill
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import CHILD_RADIUS, LOOSE, View

_BESIDE_TABLE = 0.45  # m; distance from a table's nominal centre beyond which nothing is on it

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
        return to_candle - behind_middle - layout.TABLE_HALF_SIZE > layout.TABLE_MARGIN

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
        if not view.stands_on_table(self.candle, self.table) or math.dist((x, y), self._middle) > _BESIDE_TABLE:
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
        for i in np.flatnonzero(np.abs(view.candles[:, :2] - middle).max(axis=1) < _BESIDE_TABLE):
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

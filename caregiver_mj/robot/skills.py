"""What the robot can do: block, stand aside, pick, retrieve, place.

Each skill is a small state machine over references. Its `step` is called once a control timestep; it looks at a `View`
of the world, sets goals of the `RobotMotion` and returns whether it is done. Skills know tables, candles and cells, but
nothing of danger.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.yielding import yielding
from caregiver_mj.robot import kinematics, motion, se2
from caregiver_mj.robot.driving import MAY_DRIVE, Skill
from caregiver_mj.robot.hand import GRASP_HEIGHT, hand_is_empty, hand_position, has_in_hand
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.retrieval import RetrievalPlanner, Stance
from caregiver_mj.robot.se2 import Vector
from caregiver_mj.robot.separation import child_cells, near_children
from caregiver_mj.robot.view import CANDLE_HEIGHT, CANDLE_RADIUS, View

_BESIDE_TABLE = 0.45  # metres from a table's middle beyond which nothing is on it, wherever exactly it stands

# While the base still drives up to a table, the hand may come out as far as this, once it points the right way:
_ABOVE = 0.62  # of the reach: all of the hand is then higher than a candle; and when the base is nearly in line
_HOVER = 0.72  # of the reach: only the fingertips are not
_ABOVE_DISTANCE, _ABOVE_YAW = 0.60, 0.35  # metres and radians to go
_HOVER_ACROSS, _HOVER_DISTANCE, _HOVER_YAW = 0.04, 0.30, 0.12  # metres, metres, radians to go
# The last of the way down begins this little before the base has arrived, so that it is there before the fingers are
# beside the candle; if the child slows it down, or it has stopped short, only at the very end.
_LAST_TIME, _LAST_DISTANCE, _LAST_YAW = 0.28, 0.14, 0.08  # seconds, metres, radians to go
_LAST_DISTANCE_SLOWED = 0.01  # metres
# How far out the hand may be when the base sets off with a candle that is clear of the table. With an empty hand it is
# less, clear of a candle that it has let go.
_MAY_DRIVE_LOADED = 0.82

# Metres that the candle shall be nearer than the middle of the fingers: with 12 mm more it is held, with 12 mm less it
# may be lost on the way. So what is perceived wrongly can be off as far either way.
_GRASP_DEPTH = 0.003
_GRIP_TIME = 0.12  # seconds from closing to a firm grip
_SLIPPED = 0.008  # metres outwards in the hand from which on a candle has slipped, as it does when the base turns
_PLACE_GAP = 0.001  # metres above the table at which a candle is let go
# The fingers begin to give way this little before the hand is down: they squeeze less and less, and let go 0.1 s later.
# Much earlier, and the candle is not yet pressed upright: it rocks for a third of a second.
_RELEASE_TIME = 0.05  # seconds
_RELEASE_GAP = CANDLE_RADIUS + 0.002  # metres of each finger off the middle, when the hand may withdraw
_WIDE = 0.034  # metres of each finger off the middle from which on it is open
_LIFTED = 0.01  # metres that a candle must have come up with the hand
_ATTEMPTS = 3  # at a grasp
# Where a candle is put down if the middle of the table is taken: metres to the side of it, in the order of preference.
# A hand is that wide, with what it may be off.
_SPOTS, _HAND_WIDTH = (0.0, 0.06, -0.06, 0.12, -0.12, 0.18, -0.18), 0.13
_LOOK_INTERVAL = 0.3  # seconds between looks at the table
_FULL_TIME = 1.7  # seconds that it waits at a table without room: one novice timestep

# Picking up what has fallen.
_FIRM_GRIP_TIME = 0.3  # seconds from closing to a grip that has found hold, or nothing
_STILL_TIME, _SHIFT = 0.3, 0.003  # seconds for which it must have lain still, and metres by which it may seem to move
_CHOICE_INTERVAL = 1.0  # seconds between choices of a place
_CHILD_AWAY = 1.2  # metres from the child to the candle, for the hand to go there
_CHILD_NEAR = 0.6  # metres below which the hand stops where it is


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
        if there or (math.dist(self._goal, view.base[:2]) < 0.03 and not robot.moving):
            self._deadline = math.inf  # it stays, even if it is pushed
            return True
        return self.failed


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
            plan = navigator.plan
            children = [plan.cell_at(child.position) for child in view.children]
            self._cell = navigator.refuge(here, children, child_cells(view.children, plan)) or here
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
        if self._stand is None or (view.now >= self._replan_at and self._is_barred(view, self._stand)):
            self._stand = self._choose_stand(view, table_cell)
        cell = self._stand
        ahead = (float(table_cell[1] - cell[1]), float(cell[0] - table_cell[0]))  # unit vector in x, y
        reach = kinematics.REACH + hand[0]
        goal = (
            spot[0] - reach * ahead[0] + hand[1] * ahead[1],
            spot[1] - reach * ahead[1] - hand[1] * ahead[0],
        )
        return goal, cell, math.atan2(ahead[1], ahead[0])

    def _is_barred(self, view: View, cell: Cell) -> bool:
        """Whether children that are near stand in every way to a cell."""
        near = near_children(view, view.base[:2])
        if not near:
            return False
        navigator = self._navigator
        start = navigator.nearest_cell(view.base[:2])
        return navigator.route(start, cell, child_cells(near, navigator.plan)) is None

    def _choose_stand(self, view: View, table_cell: Cell) -> Cell:
        """The free cell beside a table that is quickest to reach, if possible without meeting a child."""
        navigator = self._navigator
        plan = navigator.plan
        cells = plan.free_neighbours(table_cell)
        # Better not where a child could shut the robot in.
        cells = [cell for cell in cells if not yielding(plan).traps[plan.cell_index[cell]]] or cells
        start = navigator.nearest_cell(view.base[:2])
        around = child_cells(near_children(view, view.base[:2]), plan)

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
        along, across = se2.to_local((*view.base[:2], yaw), goal)
        off, turn = math.dist(goal, view.base[:2]), abs(math.remainder(yaw - view.base[2], math.tau))
        last_distance = _LAST_DISTANCE if robot.moving and robot.is_unhindered else _LAST_DISTANCE_SLOWED
        if robot.time_left < _LAST_TIME and off < last_distance and turn < _LAST_YAW:
            robot.reach(1.0)
            return True
        # A base that waits must be able to leave again, and it leaves with the hand in.
        if robot.moving and abs(across) < _HOVER_ACROSS and -0.02 < along < _HOVER_DISTANCE and turn < _HOVER_YAW:
            robot.reach(_HOVER)
        elif off < _ABOVE_DISTANCE and turn < _ABOVE_YAW and self._hand_is_clear(view, yaw, goal):
            robot.reach(_ABOVE)
        elif robot.hand_out > 0.0:
            robot.reach(0.0)
        return False

    def _hand_is_clear(self, view: View, yaw: float, goal: Vector) -> bool:
        """Whether the outstretched hand meets no wall on the rest of the base's way."""
        out = (kinematics.REACH, 0.0)
        return self._navigator.clearance.hand_clear(se2.to_world(view.base, out), se2.to_world((*goal, yaw), out))


class Pick(_AtTable):
    """Takes a candle off the table on which it stands, and tucks the arm."""

    def __init__(self, navigator: Navigator, candle: int, table: int):
        super().__init__(navigator)
        self.candle, self.table = candle, table
        self._stage: Callable[[View, RobotMotion], bool] = self._approach
        self._until = 0.0
        self._misses = 0

    def step(self, view: View, robot: RobotMotion) -> bool:
        return self._stage(view, robot)

    def _approach(self, view: View, robot: RobotMotion) -> bool:
        x, y, z = view.candles[self.candle].tolist()
        table = self._navigator.plan.position(self._navigator.plan.tables[self.table])
        if not view.stands_on_table(self.candle) or math.dist((x, y), table) > _BESIDE_TABLE:
            self.overtaken = True  # it has fallen, or somebody else has taken it away
            return True
        goal, cell, yaw = self._stand_at_table(view, self.table, (x, y), hand=(-_GRASP_DEPTH, 0.0))
        there = self._drive(view, robot, goal, cell, yaw)
        if self.failed:
            return True
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
        up = robot.reached <= _MAY_DRIVE_LOADED
        if hand_is_empty(view) or (up and view.candles[self.candle, 2] < layout.TABLE_HEIGHT + _LIFTED):
            self._misses += 1
            self.failed = self._misses == _ATTEMPTS
            self.interruptible = True
            robot.grip(motion.OPEN)
            robot.reach(_ABOVE)
            self._stage = self._open_again
            return self.failed
        self.interruptible = up
        return up

    def _open_again(self, view: View, robot: RobotMotion) -> bool:
        if robot.reached == _ABOVE and view.fingers > 2 * _WIDE:
            self._stage = self._approach
        return False


class Retrieve(Skill):
    """Picks a candle up from where it lies, on a table or on the floor, and tucks it upright.

    Where it lies such that the arm cannot do that at once, it is taken out to the open floor first, and picked up
    there. There is no hurry in it but the child's: the base stands still while the arm is out, the hand stops while
    the child is near, and what fails is tried again.

    Attributes:
        candle: Index of the candle.
        out_of_reach: Whether it has failed because there is no way to get at the candle.
    """

    out_of_reach = False

    def __init__(self, navigator: Navigator, planner: RetrievalPlanner, candle: int):
        super().__init__(navigator)
        self.candle = candle
        self._planner = planner
        self._stance: Stance | None = None
        self._pitch_down: float | None = None  # radians, of the hand when it lays down what it holds
        self._steps: list[tuple[float, float | None]] = []  # of the hand: pose on its path to go to, gripper there
        self._until = self._choose_at = 0.0
        self._failures = 0
        self._seen, self._seen_since = np.full(3, np.inf), 0.0
        self._waits = False

    def step(self, view: View, robot: RobotMotion) -> bool:
        still = self._lies_still(view)
        holds = robot.closes and has_in_hand(view, self.candle)
        if not self._steps:
            return self._approach(view, robot, still, holds)
        if view.now < self._until or not self._reach(view, robot, self._steps[0][0]):
            return False
        _, grip = self._steps.pop(0)
        if grip is not None:
            robot.grip(grip)
            self._until = view.now + _FIRM_GRIP_TIME
        elif not (still or robot.closes):
            del self._steps[: -round(robot.reached)]  # it has been moved: come back without it
        return not self._steps and self._end(robot, holds)

    def _approach(self, view: View, robot: RobotMotion, still: bool, holds: bool) -> bool:
        """Drives to where the candle can be picked up (or put down), and begins to reach there."""
        robot.reach(0.0)
        self.interruptible = not holds
        if not holds:
            robot.grip(motion.OPEN)
        if self._stance is None or not (still or holds):
            self._stance = self._choose_stance(view, holds) if still or holds else None
            return self.failed
        x, y, yaw = self._stance.base
        there = self._drive(view, robot, (x, y), self._navigator.nearest_cell((x, y)), yaw)
        if self.failed and holds:  # it must be laid down, if not there
            self.failed, self._stance = False, None
        elif there and robot.reached == 0.0 and self._child_distance(view) > _CHILD_AWAY:
            self.interruptible = False
            robot.reach_along(self._stance.path)
            self._steps = _there_and_back(self._stance.path.goal, motion.OPEN if holds else motion.CLOSED)
        return self.failed

    def _choose_stance(self, view: View, holds: bool) -> Stance | None:
        """Looks for a place to pick the candle up, or to lay it down; not all the time, for it takes long."""
        if view.now < self._choose_at:
            return None
        self._choose_at = view.now + _CHOICE_INTERVAL
        self._nearest = self._deadline = math.inf  # the way there is another one
        if holds:
            return self._planner.to_lay_down(view, self.candle, self._pitch_down)
        stance = self._planner.to_pick_up(view, self.candle)
        self.failed = self.out_of_reach = stance is None
        return stance

    def _end(self, robot: RobotMotion, holds: bool) -> bool:
        """Decides what to do when the arm is back; returns whether the skill is done."""
        self._pitch_down = self._stance.pitch_down
        done = holds and self._pitch_down is None
        self._failures += not (holds or done)  # or it has been laid down once more
        self.failed = self._failures == _ATTEMPTS
        self._stance, self.interruptible = None, done or not holds
        return done or self.failed

    def _reach(self, view: View, robot: RobotMotion, pose: float) -> bool:
        """Moves the hand on, unless the child is near it; returns whether it is there."""
        waits = self._child_distance(view) < _CHILD_NEAR
        if waits and not self._waits:
            robot.stop_reaching()
        elif not waits:
            robot.reach(pose)
        self._waits = waits
        return robot.reached == pose

    def _child_distance(self, view: View) -> float:
        """Metres between the nearest child's middle and the candle, or the hand if that is nearer."""
        return min(view.child_distance(place[:2]) for place in (view.candles[self.candle], hand_position(view)))

    def _lies_still(self, view: View) -> bool:
        """Whether the candle has been in its place for a moment."""
        place = view.candles[self.candle]
        if np.abs(place - self._seen).max() > _SHIFT:
            self._seen, self._seen_since = place.copy(), view.now
        return view.now - self._seen_since >= _STILL_TIME


def _there_and_back(goal: int, grip: float) -> list[tuple[float, float | None]]:
    """What the hand does to pick up or put down: the poses on its path, and what the gripper does there."""
    way = [(float(pose), None) for pose in range(1, goal)]
    return [*way, (float(goal), grip), *way[::-1], (0.0, None)]


class Place(_AtTable):
    """Puts the candle in the hand down on a table: in the middle, or beside what stands there."""

    _may_drive = _MAY_DRIVE_LOADED

    def __init__(self, navigator: Navigator, candle: int, table: int):
        super().__init__(navigator)
        self.candle, self.table = candle, table
        self._stage: Callable[[View, RobotMotion], bool] = self._approach
        self._hand = (0.0, 0.0)
        self._spot: Vector | None = None
        self._spot_seen_from: Cell | None = None
        self._look_at, self._full_until = 0.0, math.inf

    def step(self, view: View, robot: RobotMotion) -> bool:
        return self._stage(view, robot)

    def _approach(self, view: View, robot: RobotMotion) -> bool:
        if hand_is_empty(view) or (robot.reached < 1e-6 and not has_in_hand(view, self.candle)):
            self.overtaken = True  # it was lost on the way
            return True
        if view.now >= self._look_at or self._stand != self._spot_seen_from:
            self._spot, self._look_at = self._free_spot(view), view.now + _LOOK_INTERVAL
        if self._spot is None:  # there is no room on this table, perhaps not for long
            self._full_until = min(self._full_until, view.now + _FULL_TIME)
            self.failed = view.now >= self._full_until
            robot.reach(0.0)
            return self.failed
        self._full_until = math.inf
        if robot.reached < 1e-6:
            self._hand, height = self._measure(view)
            if self._hand[0] > _SLIPPED:
                robot.turn_gently()
            robot.plan_reach(layout.TABLE_HEIGHT + _PLACE_GAP + height)
        goal, cell, yaw = self._stand_at_table(view, self.table, self._spot, self._hand)
        there = self._drive(view, robot, goal, cell, yaw)
        if self.failed:  # with the candle still in the hand
            robot.reach(0.0)
            return True
        on_last = self._prepare_hand(view, robot, goal, yaw)
        self.interruptible = not on_last
        if on_last and there and view.now >= robot.reach_arrival - _RELEASE_TIME:
            robot.grip(motion.OPEN)
            self._stage = self._release
        return False

    def _free_spot(self, view: View) -> Vector | None:
        """A place on the table with room for the candle and the hand, as near to the middle as can be, or None."""
        plan = self._navigator.plan
        table_cell = plan.tables[self.table]
        if self._stand is None:
            self._stand = self._choose_stand(view, table_cell)
        self._spot_seen_from = self._stand
        middle = plan.position(table_cell)
        aside = np.array([table_cell[0] - self._stand[0], table_cell[1] - self._stand[1]], float)  # x, y
        taken = []  # from where to where, aside of the middle
        for i in np.flatnonzero(np.abs(view.candles[:, :2] - middle).max(axis=1) < _BESIDE_TABLE):
            ends = view.candles[i] + np.outer((0.0, CANDLE_HEIGHT), view.candle_axis(i))
            if i != self.candle and ends[0, 2] > layout.TABLE_HEIGHT / 2:
                taken.append(sorted(((ends[:, :2] - middle) @ aside).tolist()))
        for offset in _SPOTS:
            if all(offset <= low - _HAND_WIDTH or offset >= high + _HAND_WIDTH for low, high in taken):
                return tuple((middle + offset * aside).tolist())
        return None

    def _measure(self, view: View) -> tuple[Vector, float]:
        """The candle's place in the hand, measured again: it may have slipped since the grasp.

        Returns:
            Position of its foot relative to the pinch point (base frame, rounded to 1 mm so that noise moves no
            goals), and how far that is below the pinch point.
        """
        x, y, z = hand_position(view).tolist()
        foot = view.candles[self.candle].tolist()
        ahead, aside = se2.to_local((x, y, view.base[2]), (foot[0], foot[1]))
        return (round(ahead, 3), round(aside, 3)), z - foot[2]

    def _release(self, view: View, robot: RobotMotion) -> bool:
        if view.fingers > 2 * _RELEASE_GAP:
            robot.reach(0.0)
            self._stage = self._retreat
        return False

    def _retreat(self, view: View, robot: RobotMotion) -> bool:
        self.interruptible = robot.reached <= MAY_DRIVE
        self.overtaken = self.interruptible and not view.stands_on_table(self.candle)  # it has fallen
        return self.interruptible

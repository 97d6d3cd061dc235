"""Durations of a robot's actions in a house, computed from its limits, without a child or with one beside it.

The mean duration of a cell is that of routes between places of work, driven from rest to rest. Beside a child
`separation.allowed_rate` limits the speed.
"""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.percept import PAPER, Pace
from caregiver_mj.children.walk import BUMP_SPEED, FASTEST, WALKING_SPEED
from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import CANDLE
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.limits import Limits
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.reach import UP, pick_up_path, reach_path, tray_path
from caregiver_mj.robot.scalar_motion import ScalarMotion
from caregiver_mj.robot.separation import allowed_rate
from caregiver_mj.robot.skills.close import closing
from caregiver_mj.robot.skills.pick_up import AT_FLOOR, CARRYING
from caregiver_mj.robot.view import ChildView, View

_WAYS = 40  # routes in the mean
_STEP = 0.005  # s; resolution of durations
_POINTS, _SLOWEST = 10, 0.02  # points of a cell at which the speed is computed; its least share of full speed
_AHEAD, _ASIDE = 5, 3  # cells ahead and aside from which on a child no longer slows the robot down


def robot_pace(
    navigator: Navigator, novice_timestep: float, control_timestep: float, child_speed: float = WALKING_SPEED
) -> Pace:
    """Return the pace of a navigator's robot in its house; timesteps are in s, the child's speed is in m/s."""
    base = navigator.robot.limits.base
    lost = base.velocity / base.acceleration + base.acceleration / base.jerk  # s; cost of starting and stopping
    cells, seconds = 0, 0.0
    for start, goal in _ways(navigator.plan):
        here, there = (navigator.centres[cell] for cell in (start, goal))
        route, path = navigator.route(start, goal), navigator.path(here, there, goal)
        assert route is not None  # without children a route and a path always exist
        assert path is not None
        motion = RobotMotion(navigator.robot, control_timestep)
        motion.reset((*here, 0.0))
        motion.drive_along(path, navigator.clearance.has_room)
        cells, seconds = cells + len(route) - 1, seconds + motion.time_left - lost
    if not cells:
        return PAPER
    of_a_cell = max(seconds / cells, navigator.plan.cell_size / base.velocity)
    get, place = handling_times(navigator.robot)
    closes = closing_time(navigator.robot) if navigator.plan.mouths else of_a_cell
    picks_up = picking_up_time(navigator.robot) if navigator.plan.floor_cells else of_a_cell
    return Pace(
        cells=novice_timestep / of_a_cell,
        get=get / of_a_cell,
        place=place / of_a_cell,
        start=lost / of_a_cell,
        close=closes / of_a_cell,
        pick_up=picks_up / of_a_cell,
        beside=beside_a_child(
            navigator.robot, navigator.plan.cell_size, navigator.plan.cell_size / of_a_cell, child_speed
        ),
    )


def beside_a_child(
    robot: Embodiment, cell_size: float, speed: float, child_speed: float = WALKING_SPEED
) -> tuple[tuple[float, ...], ...]:
    """Return `Pace.beside`: times to drive to the next cell with a child near, over that without; m and m/s."""
    haste = child_speed / WALKING_SPEED
    return tuple(
        tuple(
            _way_past(robot, cell_size, speed, (cell_size * ahead, cell_size * aside), haste) for aside in range(_ASIDE)
        )
        for ahead in range(_AHEAD)
    )


def _way_past(robot: Embodiment, cell_size: float, speed: float, child: tuple[float, float], haste: float) -> float:
    stands, nothing = (ChildView(child, (0.0, 0.0)),), np.zeros((0, 4))
    rates = []
    for point in (np.arange(_POINTS) + 0.5) * cell_size / _POINTS:
        view = View(0.0, (point, 0.0, 0.0), 0.0, nothing, stands, nothing[:, :3], nothing)
        view.child_comes, view.child_runs = haste * BUMP_SPEED, haste * FASTEST
        rates.append(allowed_rate(view, robot, (speed, 0.0)))
    return float(np.mean(1.0 / np.maximum(_SLOWEST, rates)))


def _ways(plan: FloorPlan) -> list[tuple[Cell, Cell]]:
    """Return a sample of routes, as start and goal, between landings and cells beside tables."""
    places = list(dict.fromkeys([*plan.posts, *(c for table in plan.tables for c in plan.free_neighbours(table))]))
    ways = [(start, goal) for start in places for goal in places if start != goal]
    return [ways[i] for i in np.random.RandomState(0).permutation(len(ways))[:_WAYS]]


def handling_times(robot: Embodiment) -> tuple[float, float]:
    """Return the times that the base stands at a table, to get a candle and to place one, s."""
    grasp, approach = robot.grasp, robot.approach
    reach = reach_path(arm_of(robot), round(1e4 * (layout.TABLE_HEIGHT + CANDLE.grip))).limits(0, 1)
    down = _time(reach, approach.hover, 1.0, 1.0) - approach.last_time  # it begins while the base still drives
    opened = _time(robot.limits.gripper, grasp.closed, grasp.open, grasp.open)
    get = down + grasp.grip_time + _time(reach, 1.0, 0.0, approach.drive_loaded)
    return get, down - grasp.release_time + opened + _time(reach, 1.0, 0.0, approach.drive)


def closing_time(robot: Embodiment) -> float:
    """Return the time to close a gate with the base before it, s."""
    way = closing(arm_of(robot))
    return way.path.seconds([way.speed(line) for line in range(way.path.goal)])


def picking_up_time(robot: Embodiment) -> float:
    """Return the time to pick up a small thing with the base before it, s."""
    arm = arm_of(robot)
    ways = (pick_up_path(arm, reach, 0.0) for reach in robot.postures.lying_reaches)
    there, aside = next(way for way in ways if way), tray_path(arm)
    carried = sum(way.longest(arm, UP, way.goal) for way in (there, aside)) / CARRYING
    return there.seconds() + aside.seconds() + AT_FLOOR + carried


def _time(limits: Limits, start: float, end: float, until: float) -> float:
    """Return the time that a motion from rest towards `end` takes to reach `until`, s."""
    motion = ScalarMotion(limits, start)
    motion.move_to(end, 0.0)
    times = np.arange(0.0, motion.arrival + _STEP, _STEP)
    return float(next(t for t in times if abs(motion.at(t)[0] - start) >= abs(until - start) - 1e-9))

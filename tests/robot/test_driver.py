"""The base on its way among children: one that follows its references exactly, and children who do as they are told."""

import math

import numpy as np
import pytest
from robot_plans import centre
from views import ROBOT, TIMESTEP, at_rest, child, follow, view

from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot import governor
from caregiver_mj.robot.driver import Driver, Patience
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.skills.skill import Rest
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import ChildView

STRIKE_SPEED = 0.05  # m/s

TOUCHING = 0.27 + 0.12  # metres between the middles of base and child
WALKING_SPEED = 0.44  # m/s
OPEN = FloorPlan.parse("########\n#......#\n#S.....#\n#......#\n#B.....#\n########", "open")

#: Two ways lead to the stairwell, the northern one being the shorter.
TWO_WAYS = FloorPlan.parse("##########\n#........#\n#S.##B#..#\n#........#\n##########", "two_ways")
#: Two rooms with a toy bin each, and between them a corridor as wide as one cell.
CORRIDOR = FloorPlan.parse("############\n#..######..#\n#.........B#\n#B.######..#\n############", "corridor")


class Drive:
    """A base that drives from one cell to another, or turns there to a heading, among children."""

    def __init__(self, plan: FloorPlan, start: Cell, goal: Cell, *children: ChildView, yaw: float | None = None):
        self._plan, self._goal, self._yaw = plan, goal, yaw
        self.driver, self.robot = Driver(Navigator(plan, ROBOT)), at_rest((*centre(plan, start), 0.0))
        self.children = list(children)

    @property
    def base(self) -> tuple[float, float, float]:
        return (*self.robot.base_reference()[0], self.robot.yaw)

    def step(self) -> Status:
        seen, yaw = view(*self.children, base=self.base, now=self.robot.now), self._yaw or self.robot.yaw
        status = self.driver.drive(seen, self.robot, centre(self._plan, self._goal), self._goal, yaw)
        follow(seen, self.robot)
        self.children = [
            one._replace(position=tuple(x + TIMESTEP * v for x, v in zip(one.position, one.velocity, strict=True)))
            for one in self.children
        ]
        return status

    def run(self, seconds: float) -> Status:
        """Goes on for so long, or until it is there or gives up."""
        for _ in range(round(seconds / TIMESTEP)):
            status = self.step()
            if status is not Status.RUNNING:
                return status
        return Status.RUNNING

    def gap(self) -> float:
        return min(math.dist(one.position, self.base[:2]) for one in self.children) - TOUCHING


def stands_in(plan: FloorPlan, cell: Cell) -> ChildView:
    return child(*centre(plan, cell))


def walks_from(plan: FloorPlan, cell: Cell, east: float) -> ChildView:
    return child(*centre(plan, cell), east * WALKING_SPEED, 0.0)


def test_the_governor_slows_the_base_down_though_its_skill_wants_full_speed():
    drive = Drive(OPEN, (3, 1), (3, 6))
    drive.run(0.9)
    robot, before = drive.robot, drive.robot.rate
    seen = view(child(drive.base[0] + TOUCHING + 0.3, drive.base[1]), base=drive.base, now=robot.now)
    for _ in range(5):
        follow(seen, robot)
    assert robot.rate < 0.95 * before


def test_a_base_that_the_next_skill_does_not_drive_stops():
    drive = Drive(OPEN, (3, 1), (3, 6))
    drive.run(0.9)
    robot, rest = drive.robot, Rest(Navigator(OPEN, ROBOT))
    assert robot.moving
    for _ in range(50):
        seen = view(child(drive.base[0] + 9.0, drive.base[1]), base=drive.base, now=robot.now)
        rest.step(seen, robot)
        governor.bound_base(seen, robot)
        robot.now += TIMESTEP
    assert not robot.moving


@pytest.mark.parametrize(("distance", "turns"), [(0.6, False), (0.75, True)])
def test_the_hand_is_not_swung_round_beside_a_child(distance, turns):
    x, y = centre(OPEN, (2, 4))
    drive = Drive(OPEN, (2, 4), (2, 4), child(x + 9.0, y), child(x + distance, y), yaw=1.0)
    for _ in range(100):
        drive.step()
    assert drive.robot.yaw == pytest.approx(1.0 if turns else 0.0)


def test_a_turn_stops_when_a_child_comes_and_goes_on_when_it_has_gone():
    drive, (x, y), headings = Drive(OPEN, (2, 4), (2, 4), yaw=2.0), centre(OPEN, (2, 4)), []
    for step in range(250):
        drive.children = [child(x + (0.55 if 15 <= step < 150 else 2.0), y)]
        drive.step()
        headings.append(drive.robot.yaw)
    turning = np.abs(np.diff(headings)) / TIMESTEP
    assert turning[13] > 1.0  # rad/s, when the child comes
    assert turning[55:149].max() < 1e-6  # it has stopped within 0.8 s
    assert 0.0 < headings[100] < 1.5
    assert headings[-1] == pytest.approx(2.0)


@pytest.mark.parametrize(("leaves", "ends"), [(True, Status.DONE), (False, Status.FAILED)])
def test_a_turn_that_gets_on_between_a_childs_visits_is_not_given_up(leaves, ends):
    """One that gave up had another place to turn to, and turned back and forth with a candle in its hand."""
    drive, (x, y) = Drive(OPEN, (2, 4), (2, 4), yaw=math.pi), centre(OPEN, (2, 4))
    status, step = Status.RUNNING, 0
    while status is Status.RUNNING and drive.robot.now < 60.0:
        away = 0.72 if leaves and step % 100 < 40 else 0.5  # for less than half of the time
        drive.children = [child(x + away, y)]
        status, step = drive.step(), step + 1
    assert status is ends
    assert drive.robot.now > 10.0


@pytest.mark.parametrize("order", [1, -1])
def test_children_in_both_of_two_ways_leave_none_until_one_goes(order):
    north, south = stands_in(TWO_WAYS, (1, 4)), stands_in(TWO_WAYS, (3, 4))
    alone = Drive(TWO_WAYS, (1, 7), (2, 1), north)
    assert alone.run(10.5) is Status.DONE
    drive = Drive(TWO_WAYS, (1, 7), (2, 1), *[north, south][::order])
    assert drive.run(9.5) is Status.RUNNING
    assert 1.0 < drive.gap() < 1.2  # it waits with a free cell between them
    drive.children = [north, stands_in(TWO_WAYS, (1, 8))]
    assert drive.run(10.5) is Status.DONE


def test_what_children_keep_closed_is_given_up():
    drive = Drive(TWO_WAYS, (1, 7), (2, 1), stands_in(TWO_WAYS, (1, 4)), stands_in(TWO_WAYS, (3, 4)))
    assert drive.run(30.0) is Status.FAILED
    assert 10.0 < drive.robot.now < 15.0


def test_a_base_gets_out_of_the_way_of_a_child_that_comes_and_goes_on_when_it_is_past():
    comes = walks_from(CORRIDOR, (2, 4), 1.0)
    drive = Drive(CORRIDOR, (2, 5), (2, 1), comes, child(50.0, 0.0))
    for _ in range(40):
        drive.step()
    assert drive.driver.aside_until > drive.robot.now
    assert drive.driver.goal == centre(CORRIDOR, (2, 1))  # where it shall stand all the same
    drive.run(4.0)
    assert drive.gap() > 0.0
    assert drive.base[0] > centre(CORRIDOR, (2, 5))[0]  # it has gone along before the child
    drive.children = [stands_in(CORRIDOR, (2, 9))]
    assert drive.run(10.0) is Status.DONE


def test_a_base_that_a_child_follows_into_a_corner_leads_it_out_of_its_way():
    plan = FloorPlan.parse("########\n#B.....#\n#####..#\n########", "corner")
    drive = Drive(plan, (1, 6), (1, 2), stands_in(plan, (1, 5)))
    (end, _), status, gaps = centre(plan, (1, 6)), Status.RUNNING, []
    while status is Status.RUNNING:
        (x, y), _ = drive.children[0]
        follows = plan.cell_at(drive.base[:2]) != (1, 6) and x < end  # into the corner that it has left
        drive.children = [child(x, y, WALKING_SPEED if follows else 0.0, 0.0)]
        status = drive.step()
        gaps.append(drive.gap())
    assert status is Status.DONE
    assert min(gaps) > 0.0


@pytest.mark.parametrize("way_left", [0.0, 0.5])
def test_a_base_stands_on_its_landing_before_a_child_that_comes(way_left):
    """That is what it goes there for, be it that it still has a little way to go when the child comes."""
    x, y = centre(OPEN, (2, 1))
    drive = Drive(OPEN, (2, 1), (2, 1), ChildView((x, y + 0.88), (0.0, -0.62)))
    drive.robot.reset((x, y - way_left, 0.0))
    left = [way_left]
    for _ in range(80):
        if drive.gap() < 0.02:
            drive.children = [drive.children[0]._replace(velocity=(0.0, 0.0))]
        drive.step()
        left.append(math.dist(drive.base[:2], (x, y)))
    assert (np.diff(left) <= 1e-6).all()  # it does not leave it, nor turn back on its way
    assert OPEN.cell_at(drive.base[:2]) == (2, 1)


def test_the_watchdog_ends_ten_seconds_after_the_last_step_nearer():
    patience = Patience()
    assert not patience.is_over(1e6)  # before there is a way
    patience.note(8, now=0.0)
    patience.note(7, now=6.0)
    for now in (9.0, 12.0, 15.0):
        patience.note(7, now)
        patience.note(9, now)
    assert not patience.is_over(16.0)
    assert patience.is_over(16.02)


def test_a_base_that_is_there_may_stay_but_not_be_driven_off_again_and_again_for_ever():
    patience = Patience()
    for now in range(0, 12, 2):
        patience.note(1, now)
        patience.note(0, now + 1.0)
    assert patience.is_over(11.02)
    assert not patience.is_over(11.02, 5.0)
    assert patience.is_over(16.02, 5.0)
    patience.last_for_ever()
    patience.note(1, now=20.0)
    assert not patience.is_over(1e6)


def test_a_base_between_two_children_drives_into_neither():
    drive = Drive(CORRIDOR, (2, 5), (2, 1), walks_from(CORRIDOR, (2, 2), 1.0), walks_from(CORRIDOR, (2, 8), -1.0))
    for _ in range(500):
        drive.step()
        (x, y), velocity, _ = drive.robot.base_reference()
        for i, one in enumerate(drive.children):
            dx, dy = one.position[0] - x, one.position[1] - y
            distance = math.hypot(dx, dy)
            if distance - TOUCHING < 0.08:
                assert (velocity[0] * dx + velocity[1] * dy) / distance < STRIKE_SPEED
            if distance - TOUCHING < 0.03:  # it stops where it would run into the base
                drive.children[i] = one._replace(velocity=(0.0, 0.0))
    assert drive.gap() > -0.01
    np.testing.assert_allclose(drive.robot.base_reference()[1], 0.0, atol=0.01)

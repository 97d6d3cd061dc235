"""Houses to measure the robot's skills in."""

from __future__ import annotations

import functools

from caregiver_mj.plans.floor_plan import FloorPlan

#: Four rooms round a cross of walls; as text, so that figures stay comparable with earlier ones.
_THIRD = """
##############
#.C...#......#
#.....#....T.#
#............#
#S..C.....C..#
#.....#......#
###..####..###
#.....#......#
#..B..#....C.#
#B...........#
#.......T..T.#
#.B.T.#......#
#.....#...S..#
##############
"""


@functools.cache
def three_houses() -> tuple[FloorPlan, ...]:
    """The houses of the package, and a third one."""
    return FloorPlan.load("paper"), FloorPlan.load("apartment"), FloorPlan.parse(_THIRD, "four rooms")

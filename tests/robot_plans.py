"""Floor plans on which the robot's room, routes and paths are tested, and ways of its arm."""

import itertools
import math

import numpy as np
from hypothesis import strategies as st
from random_plans import plan_texts

from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.kinematics import Arm
from caregiver_mj.robot.reach import ReachPath, retrieval_paths

#: Four rooms round a cross of walls, with a doorway each; the two stairwells lie beside the shortest ways.
HOUSE = FloorPlan.parse(
    "#########\n#B..#...#\n#.......#\n#...#..S#\n##.###.##\n#...#...#\n#.......#\n#S..#.CT#\n#########", "four_rooms"
)
#: A corridor: whoever stands in it leaves no way.
CORRIDOR = FloorPlan.parse("########\n#B....T#\n####.###\n####S###\n########", "corridor")


def centre(plan: FloorPlan, cell: Cell) -> tuple[float, float]:
    return tuple(plan.position(cell).tolist())


@st.composite
def journeys(draw, landings=True):
    """A plan, and two of the cells on which the robot can stand."""
    plan = FloorPlan.parse(draw(plan_texts(6, 14)), "random")
    cells = st.sampled_from(plan.caregiver_cells if landings else plan.free_cells)
    return plan, draw(cells), draw(cells)


def points_along(path: list[tuple[float, float]], apart: float = 0.01) -> np.ndarray:
    """Points (n, 2) on a polyline, so far apart, metres."""
    pieces = [np.linspace(a, b, int(math.dist(a, b) / apart) + 2) for a, b in itertools.pairwise(np.array(path, float))]
    return np.concatenate(pieces)


def distances_to_obstacles(plan: FloorPlan, points: np.ndarray) -> np.ndarray:
    """Distance of each point (n, 2) to the nearest wall, piece of furniture or stairs, (n,)."""
    rectangles = layout.Layout(plan).obstacles
    outside = np.abs(points[:, None] - rectangles[:, :2]) - rectangles[:, 2:]
    return np.hypot(*np.moveaxis(outside.clip(min=0), -1, 0)).min(axis=1)


def first_way(arm: Arm, point: np.ndarray, rotation: np.ndarray, lift: float = 0.0) -> ReachPath | None:
    """The arm's first way to a point by any of the guesses; None if there is none."""
    return next(filter(None, retrieval_paths(arm, point, rotation, lift)), None)

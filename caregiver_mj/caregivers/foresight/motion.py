"""How the caregiver moves: where it is after some steps on its way to each place, round a child that stands still."""

from __future__ import annotations

import functools
import math

import numpy as np

from caregiver_mj.caregivers.percept import PAPER, Pace
from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.routes import Routes

_ROUNDING = 1e-6  # of a step
_PATIENCE = 4  # timesteps after which a child is expected to have left the only way


@functools.lru_cache(maxsize=8)
def motion(plan: FloorPlan, pace: Pace = PAPER, lookouts: tuple[int, ...] = ()) -> Motion:
    """Return the motion through a house at a pace; made once."""
    return Motion(plan, pace, lookouts)


class Motion:
    """The caregiver's motion by the rules of `plans.routes`, the same that its world moves it by.

    The *places* are the posts (landings of stairwells, cells before gates), then the tables (any cell beside one will
    do), then the cells of what lies on the floor, then lookouts, then `aside`, out of the child's way, and `stay`. A
    *step* is the time in which the caregiver walks one cell.

    Attributes:
        pace: How long it takes.
        posts: Cells from which it keeps children from each opening.
        floor: Numbers of the places of what lies on the floor.
        lookouts: Numbers of lookouts.
        stands: The cells beside each table, (tables, cells beside one), filled up with the first of them.
        aside: Number of that place; that of `stay` is the next one.
        distance: Steps to every place, `UNREACHABLE` where the child bars the way, (aside + 1, C, R): by the child's
            cell and the caregiver's.
        after: Cell after a number of steps on the way to every place, (steps + 1, aside + 2, C, R).
        open_distance: Steps to every place before `aside` if there is no child, (aside, R).
        end: The cell in which the way to every place before `aside` ends if there is no child, (aside, R).
        nearest: Which of the cells beside each table is the nearest, a number among `stands`, (tables, R).
    """

    def __init__(self, plan: FloorPlan, pace: Pace = PAPER, lookouts: tuple[int, ...] = ()):
        graph, cells = plan.graph, len(plan.caregiver_cells)
        self.pace = pace
        self.posts = [plan.cell_index[cell] for cell in plan.posts]
        stands = graph.beside(plan.tables)
        goals = [[post] for post in self.posts] + stands + [[cell] for cell in plan.floor_cells]
        self.floor = range(len(self.posts) + len(stands), len(goals))
        goals += [[cell] for cell in lookouts]
        self.lookouts = range(self.floor.stop, len(goals))
        self.aside = len(goals)
        routes = Routes(plan, goals)
        self.open_distance = routes.open_distance.astype(int)
        distance, towards = zip(*(routes.around(child) for child in range(len(plan.free_cells))), strict=True)
        self.distance = np.stack(distance, axis=1)
        here = np.broadcast_to(np.arange(cells, dtype=np.int16), (1, len(plan.free_cells), cells))
        one = np.concatenate([np.stack(towards, axis=1), here])
        steps = [np.broadcast_to(here, one.shape)]
        for _ in range(math.ceil(pace.cells)):
            steps.append(np.take_along_axis(one, steps[-1].astype(int), axis=2))
        self.after = np.stack(steps)
        most = max(map(len, stands), default=1)
        self.stands = np.array([(stand + most * stand[:1])[:most] for stand in stands], int).reshape(-1, most)
        apart = graph.distances_from(range(cells))
        self.nearest = apart[self.stands].argmin(axis=1)
        self.end = np.array([np.array(goal)[apart[goal].argmin(axis=0)] for goal in goals]).reshape(-1, cells)

    @functools.cached_property
    def turns(self) -> list[tuple[int, float]]:
        """Steps that it makes in a timestep to come, and the share of the timesteps in which it makes so many.

        It is thought to set off in each. Were it thought to be on its way, it would rather set off later.
        """
        cells = max(self.pace.cells - self.pace.start, min(1.0, self.pace.cells))
        whole = math.floor(cells)
        rest = cells - whole
        return [(whole, 1.0 - rest), *([(whole + 1, rest)] if rest else [])]

    def fetch(
        self, table: np.ndarray | int, child: np.ndarray, cell: np.ndarray, left: np.ndarray | int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return what comes of going for the candle on a table until the child's next move, in `left` steps.

        Returns:
            Whether it has got the candle by then; the cell in which it then is or, if it has got it, in which it has
            been when it did; and the steps that are left after that: (n,) each, as all that is given.
        """
        place = len(self.posts) + np.asarray(table)
        distance = self.distance[place, child, cell].astype(int)
        rest = left - distance - self.pace.get
        got = rest > -_ROUNDING
        most = len(self.after) - 1
        walked = np.where(got, distance, np.rint(left - np.maximum(0.0, self.pace.get - 1.0)))
        at = self.after[np.clip(walked, 0, most).astype(int), place, child, cell].astype(int)
        return got, at, np.where(got, np.maximum(rest, 0.0), 0.0)

    def carry(self, stand: np.ndarray, table: np.ndarray, child: np.ndarray, left: np.ndarray) -> np.ndarray:
        """Return how many moves a child makes until a candle has been carried to a table, (n,), or of any shape.

        The caregiver took it in the cell `stand`, with the child in its own, and `left` steps before the child's move.
        """
        place = len(self.posts) + table
        distance = self.distance[place, child, stand].astype(float)
        wait = self.open_distance[place, stand] + _PATIENCE * self.pace.cells
        return self.timesteps(np.where(distance == UNREACHABLE, wait, distance) + self.handling, left)

    def timesteps(self, steps: np.ndarray | float, left: np.ndarray | float) -> np.ndarray:
        """Return how many moves a child makes in some steps of the caregiver, with so many left before the first."""
        return np.maximum(0, np.ceil((steps - left) / self.pace.cells - _ROUNDING)).astype(int)

    @functools.cached_property
    def longest(self) -> int:
        """The most moves of a child that carrying a candle can take."""
        far = self.open_distance[len(self.posts) : self.floor.start].max(initial=0)
        return int(self.timesteps(far + _PATIENCE * self.pace.cells + self.handling, 0.0))

    def picks_up(
        self, place: int, child: np.ndarray, cell: np.ndarray, left: np.ndarray | int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return what comes of going for what lies in a place of `floor` until the child's next move, in `left` steps.

        Returns:
            Whether it has begun to pick it up by then, and the cell in which it then is: (n,) each, as all cells.
        """
        begun = left - self.distance[place, child, cell] - min(1.0, self.pace.pick_up) > -_ROUNDING
        steps = np.clip(np.rint(left), 0, len(self.after) - 1).astype(int)
        return begun, self.after[steps, place, child, cell].astype(int)

    @property
    def handling(self) -> float:
        """Steps lost on the way with a candle in the hand, and on the way there before it."""
        return self.pace.place + 2 * self.pace.start

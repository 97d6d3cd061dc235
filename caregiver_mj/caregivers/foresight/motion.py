"""How the caregiver moves: where it is after some steps on its way to each place, round a child that stands still."""

from __future__ import annotations

import functools
import math

import numpy as np

from caregiver_mj.caregivers.percept import PAPER, Pace
from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.routes import RouteTables

_ROUNDING = 1e-6  # of a step
_LEAST = 0.05  # probability; smaller shares of a step count as none, for tables take twice as long with them
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
            cell and the caregiver's. A cell beside the child takes more than one.
        around: The cells north, east, south and west of every cell, -1 for want of one, (4, R).
        enters: Steps from there into each cell, infinite where it cannot be entered for a wall or the child, (C, 4, R).
        turn: Steps that it makes in a timestep to come. It is thought to set off in each: were it thought to be on its
            way, it would rather set off later.
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
        routes = RouteTables(plan, goals)
        self.open_distance = routes.open_distance.astype(int)
        moves, towards = zip(*(routes.around(child) for child in range(len(plan.free_cells))), strict=True)
        here = np.broadcast_to(np.arange(cells, dtype=np.int16), (1, len(plan.free_cells), cells))
        self._next = np.concatenate([np.stack(towards, axis=1), here])
        where = np.array(plan.caregiver_cells)
        child = where[: len(plan.free_cells), None]
        self._takes = pace.way(where[self._next] - where, child - where).astype(np.float32)
        self.around = graph.around.T
        come = where[self.around]
        barred = (self.around < 0) | (np.arange(cells) == np.arange(len(child))[:, None, None])
        enters = np.where(barred, np.inf, pace.way(where - come, child[:, None] - come))
        self.enters = enters.astype(np.float32)
        self.distance = self._steps(np.stack(moves, axis=1))
        self.turn = max(pace.cells - pace.start, min(1.0, pace.cells))
        most = max(map(len, stands), default=1)
        self.stands = np.array([(stand + most * stand[:1])[:most] for stand in stands], int).reshape(-1, most)
        apart = graph.distances_from(range(cells))
        self.nearest = apart[self.stands].argmin(axis=1)
        self.end = np.array([np.array(goal)[apart[goal].argmin(axis=0)] for goal in goals]).reshape(-1, cells)

    def _steps(self, moves: np.ndarray) -> np.ndarray:
        """Return how many steps so many moves to every place take while the child stands still, alike."""
        if not self.pace.beside:
            return moves
        steps = moves.astype(np.float32)
        for far in range(1, moves[moves < UNREACHABLE].max(initial=0) + 1):
            some = place, child, _ = np.nonzero(moves == far)
            steps[some] = self._takes[some] + steps[place, child, self._next[some]]
        return steps

    def walk(
        self, place: np.ndarray | int, child: np.ndarray, cell: np.ndarray, left: np.ndarray | float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return where it is on the way to a place after the steps that are left: (...) each, as all that is given.

        That is a cell, or the next one with the probability that is returned with it: the time spent on it over the
        time needed. Were one that is not reached in time never reached, it would never walk past a child.
        """
        place, child, here, left = np.broadcast_arrays(place, child, cell, np.asarray(left, float))
        for _ in range(math.ceil(self.pace.cells)):
            goes = self._takes[place, child, here] <= left + _ROUNDING
            left = left - goes * self._takes[place, child, here]
            here = np.where(goes, self._next[place, child, here], here)
        then = self._next[place, child, here]
        share = np.where(then == here, 0.0, left / self._takes[place, child, here])
        return here, then, np.where(share > _LEAST, share, 0.0).astype(np.float32)

    def waits(
        self, child: np.ndarray, cell: np.ndarray, left: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return each cell to which it can come by the child's next move, in `left` steps, from n states, (n,) each.

        Returns:
            The state, the cell, the one before that on the way, and the probability that it is in the former by then
            and not still in the latter: (m,) each.
        """
        time = np.full((len(cell), self.around.shape[1]), np.inf)
        np.put_along_axis(time, cell[:, None], 0.0, axis=1)
        before, enters, limit = np.repeat(cell[:, None], time.shape[1], axis=1), self.enters[child], left[:, None]
        for _ in range(math.ceil(self.pace.cells)):
            ways = np.where(time < limit, time, np.inf)[:, self.around] + enters  # (n, 4, R)
            found = ways.min(axis=1)
            come = self.around[ways.argmin(axis=1), np.arange(time.shape[1])]
            before, time = np.where(found < time, come, before), np.minimum(found, time)
        since = np.take_along_axis(time, before, axis=1)
        share = np.ones(time.shape)
        np.divide(limit - since, time - since, out=share, where=time > since)
        state, there = np.nonzero(share > _LEAST)
        return state, there, before[state, there], np.minimum(share[state, there], 1.0).astype(np.float32)

    def fetch(
        self, table: np.ndarray | int, child: np.ndarray, cell: np.ndarray, left: np.ndarray | float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return what comes of going for the candle on a table until the child's next move, in `left` steps.

        Returns:
            The probability that it has got the candle by then, the time left for that over the time needed; the cell in
            which it is by then or, if it has got it, in which it has been when it did; and the steps that are left
            after that if it is certain: (n,) each, as all that is given.
        """
        place = len(self.posts) + np.asarray(table)
        rest = left - self.distance[place, child, cell].astype(float)
        here, then, share = self.walk(place, child, cell, left)
        got = np.clip((rest + _ROUNDING) / self.pace.get, 0.0, 1.0)
        got = np.where(rest > _ROUNDING, got, 0.0)
        return got, np.where(share > 0.5, then, here), np.maximum(rest - self.pace.get, 0.0)

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

    def picks_up(self, place: int, child: np.ndarray, cell: np.ndarray, left: np.ndarray | float) -> np.ndarray:
        """Return what comes of going for what lies in a place of `floor` until the child's next move, in `left` steps.

        Returns:
            Whether it has begun to pick it up by then, (n,), as all that is given.
        """
        return left - self.distance[place, child, cell] - min(1.0, self.pace.pick_up) > -_ROUNDING

    @property
    def handling(self) -> float:
        """Steps lost on the way with a candle in the hand, and on the way there before it."""
        return self.pace.place + 2 * self.pace.start

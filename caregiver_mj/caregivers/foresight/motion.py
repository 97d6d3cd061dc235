"""The planner's motion model: the caregiver's position after some steps to a place, round a child that stands still."""

from __future__ import annotations

import functools
import math

import numpy as np

from caregiver_mj.caregivers.percept import PAPER, Pace
from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.routes import RouteTables

_ROUNDING = 1e-6  # steps; tolerance for sums of step times
_LEAST = 0.05  # probability; a smaller share of a step counts as none, which halves the time to compute tables
_PATIENCE = 4  # timesteps; assumed wait until a child that bars the only way has left it


@functools.lru_cache(maxsize=8)
def motion(plan: FloorPlan, pace: Pace = PAPER, lookouts: tuple[int, ...] = ()) -> Motion:
    """Return the motion model of a house at a pace, cached."""
    return Motion(plan, pace, lookouts)


class Motion:
    """The caregiver's motion along the routes of `plans.routes`, which its world follows, too.

    *Places* are numbered: posts (landings of stairwells, cells before gates), tables (any cell beside one), cells of
    things on the floor, lookouts, `aside` (out of the child's way) and `stay`. A *step* is the time to walk one cell.

    Attributes:
        pace: Durations of the caregiver's actions.
        posts: Cell from which the caregiver blocks each opening.
        floor: Place numbers of things on the floor.
        lookouts: Place numbers of lookouts.
        stands: Cells beside each table, (tables, most cells beside one), padded with the first.
        aside: Place number of `aside`; `stay` is the next one.
        distance: Steps to every place, by the cells of child and caregiver, `UNREACHABLE` where the child bars the way,
            (aside + 1, C, R). Entering a cell near the child takes longer (`Pace.beside`).
        around: Cells north, east, south and west of every cell, -1 for none, (4, R).
        enters: Steps to enter each cell from those, infinite where a wall or the child prevents it, (C, 4, R).
        turn: Steps walked in a future timestep. Each is charged `Pace.start`: otherwise a later departure would seem
            cheaper.
        open_distance: Steps to every place before `aside` without a child, (aside, R).
        end: Cell that the route to every place before `aside` ends in without a child, (aside, R).
        nearest: Index of the nearest of each table's `stands`, (tables, R).
    """

    def __init__(self, plan: FloorPlan, pace: Pace, lookouts: tuple[int, ...]):
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
        # For `waits`: cells within a timestep's moves of each cell, in order, and some more; the cell among them; and
        # where the cells `around` each are among them, else behind the last; (R, n), (R,) and (R, 4, n).
        near = apart <= math.ceil(pace.cells)
        count = near.sum(axis=1).max()
        self._near = (~near).argsort(axis=1, kind="stable")[:, :count]
        among = np.full((cells, cells), count)
        np.put_along_axis(among, self._near, np.arange(count)[None], axis=1)
        self._self = among.diagonal().copy()
        beside = self.around[:, self._near].swapaxes(0, 1)
        self._beside = np.where(beside < 0, count, among[np.arange(cells)[:, None, None], beside])

    def _steps(self, moves: np.ndarray) -> np.ndarray:
        """Return the steps that moves to every place take while the child stands still; both (places, C, R)."""
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
        """Return the caregiver's position after `left` steps towards a place; arguments and results are (...).

        Returns:
            The cell reached, the next cell, and the probability of having reached the latter: the share of its time
            that has passed. Without this share the caregiver would never pass a child, where a step outlasts a
            timestep.
        """
        _, children, cells = self._next.shape
        way = (np.asarray(place) * children + child) * cells  # in the flattened tables, which is faster
        way, here, left = np.broadcast_arrays(way, cell, np.asarray(left, float))
        takes, then = self._takes.take(way + here), self._next.take(way + here)
        for _ in range(math.ceil(self.pace.cells)):
            goes = takes <= left + _ROUNDING
            left = left - goes * takes
            here = np.where(goes, then, here)
            takes, then = self._takes.take(way + here), self._next.take(way + here)
        share = np.where(then == here, 0.0, left / takes)
        return here, then, np.where(share > _LEAST, share, 0.0).astype(np.float32)

    def waits(
        self, child: np.ndarray, cell: np.ndarray, left: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the cells that the caregiver can reach by the child's next move, in `left` steps; arguments are (n,).

        Returns:
            The state (0 to n - 1), the cell, its predecessor on the way, and the probability of being in the cell and
            not yet in the predecessor: (m,) each.
        """
        near, beside, limit = self._near[cell], self._beside[cell], left[:, None]
        states, count = near.shape
        enters = self.enters[child[:, None, None], np.arange(4)[:, None], near[:, None]]
        time = np.full((states, count + 1), np.inf)  # of those near; the last is none
        before = np.repeat(self._self[cell, None], count, axis=1)
        np.put_along_axis(time, before[:, :1], 0.0, axis=1)
        for _ in range(math.ceil(self.pace.cells)):
            reached = np.where(time < limit, time, np.inf)
            ways = np.take_along_axis(reached[:, None], beside, axis=2) + enters
            found, least = ways.min(axis=1), ways.argmin(axis=1)
            come = np.take_along_axis(beside, least[:, None], axis=1)[:, 0]
            before = np.where(found < time[:, :-1], come, before)
            time[:, :-1] = np.minimum(found, time[:, :-1])
        since, time = np.take_along_axis(time, before, axis=1), time[:, :-1]
        share = np.ones(time.shape)
        np.divide(limit - since, time - since, out=share, where=time > since)
        state, there = np.nonzero(share > _LEAST)
        share, before = np.minimum(share[state, there], 1.0), before[state, there]
        return state, near[state, there], near[state, before], share.astype(np.float32)

    def fetch(
        self, table: np.ndarray | int, child: np.ndarray, cell: np.ndarray, left: np.ndarray | float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the progress of fetching a table's candle by the child's next move, in `left` steps; all are (n,).

        Returns:
            The probability that the candle is in the hand (time left for taking it over time needed); the cell of the
            caregiver, or from which it took the candle; and the steps left after a certain take.
        """
        place = len(self.posts) + np.asarray(table)
        rest = left - self.distance[place, child, cell].astype(float)
        here, then, share = self.walk(place, child, cell, left)
        got = np.clip((rest + _ROUNDING) / self.pace.get, 0.0, 1.0)
        got = np.where(rest > _ROUNDING, got, 0.0)
        return got, np.where(share > 0.5, then, here), np.maximum(rest - self.pace.get, 0.0)

    def carry(self, stand: np.ndarray, table: np.ndarray, child: np.ndarray, left: np.ndarray) -> np.ndarray:
        """Return the number of the child's moves until a candle has been put down on a table; all are (...).

        The caregiver took it in cell `stand`, `left` steps before the next move of the child.
        """
        place = len(self.posts) + table
        distance = self.distance[place, child, stand].astype(float)
        wait = self.open_distance[place, stand] + _PATIENCE * self.pace.cells
        return self.timesteps(np.where(distance == UNREACHABLE, wait, distance) + self.handling, left)

    def timesteps(self, steps: np.ndarray | float, left: np.ndarray | float) -> np.ndarray:
        """Return the number of the child's moves in `steps` of the caregiver, with `left` steps before the first."""
        return np.maximum(0, np.ceil((steps - left) / self.pace.cells - _ROUNDING)).astype(int)

    @functools.cached_property
    def longest(self) -> int:
        """Upper bound of the child's moves while a candle is carried."""
        far = self.open_distance[len(self.posts) : self.floor.start].max(initial=0)
        return int(self.timesteps(far + _PATIENCE * self.pace.cells + self.handling, 0.0))

    def picks_up(self, place: int, child: np.ndarray, cell: np.ndarray, left: np.ndarray | float) -> np.ndarray:
        """Return whether the caregiver begins to pick up a thing by the child's next move, in `left` steps, (n,).

        The place is one of `floor`. At least one step of the pick-up, or all of a shorter one, must be done by then.
        """
        return left - self.distance[place, child, cell] - min(1.0, self.pace.pick_up) > -_ROUNDING

    @property
    def handling(self) -> float:
        """Steps to put a candle down, and lost by starting twice: towards the candle, and with it."""
        return self.pace.place + 2 * self.pace.start

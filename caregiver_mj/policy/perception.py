"""What is seen: from a task's observation to the robot's view, and to the caregiver's percept.

A few centimetres show where a toddler is heading, and the floor plan tells whether it will get there or bump into
something: so its cell and action are known as those that the grid would have after this move.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Container

import numpy as np

from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.children.walk import BUMP_SPEED, FASTEST, WALKING_SPEED
from caregiver_mj.danger.child_model import CHANGE, child_chain
from caregiver_mj.danger.tracker import Tracker
from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import ACTIONS, Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.plans.visibility import FULL, PLACES, Sight, visibility
from caregiver_mj.robot.geometry import Pose, Vector
from caregiver_mj.robot.view import NO_GATES, NO_THINGS, ChildView, View

_NOBODY: tuple[ChildView, ...] = ()
_CLEAR_DISTANCE = 0.05  # metres of a move after which it is clear where the toddler is heading, ...
_LATEST = 0.5  # ... or the share of a novice timestep after which it will not go anywhere any more
_SMALLEST_MOVE = 0.005  # metres; a toddler that has moved less has not tried to; ...
_SMALLEST_SEEN = 0.03  # ... the same where it is not seen exactly
_AS_USUAL, _SIGMAS = 0.02, 4.0  # metres that a candle on a table may seem off its usual height; and of its noise
_IN_ITS_CELL = 0.3  # share of a move, at its begin and at its end, that counts as in the cell
_WORTH_A_LOOK = 0.02  # probability of a child
_HEADINGS = np.array([math.atan2(-down, right) for down, right in ACTIONS])
_FELT = 0.4  # metres from a base's middle within which a child touches it
_NEAR, _LOOKS_AGAIN = 3.0, 0.1  # metres within which corners count, and seconds after which they are looked for anew
_REMEMBERED = 2.0  # seconds for which a child that is not seen any more counts as if it came at the robot
_NO_CANDLES, _NO_ORIENTATIONS = np.zeros((0, 3)), np.zeros((0, 4))


@dataclasses.dataclass
class _Sighting:
    """One child as it was last made out."""

    origin: Vector | None  # where its present move began, metres; None if that was not seen
    is_clear: bool  # whether it is clear where that leads
    cell: int  # the free cell in which it is, or will be after the move; NOTHING if that has not been seen
    previous: tuple[int, int]  # the cell in which it made its last move, and that move; NOTHING before any was seen


class Perception:
    """What one robot sees in one house.

    If not everything is seen exactly: it has been foretold from what was observed `age` seconds ago, candles with a
    white error of `candle_noise` metres, one sigma, and children may be `unsure` metres nearer than they seem. They
    walk `haste` times as fast as in the paper.

    Attributes:
        table_heights: How high the tables' tops are, (tables,), metres; None if as usual.
    """

    def __init__(
        self,
        plan: FloorPlan,
        is_exact: bool = True,
        age: float = 0.0,
        candle_noise: float = 0.0,
        unsure: float = 0.0,
        sight: Sight = FULL,
        frames: Callable[[], dict[str, np.ndarray]] | None = None,
        haste: float = 1.0,
    ):
        self._comes, self._runs = haste * BUMP_SPEED, haste * FASTEST  # m/s, of a child
        self._is_full, self._lurking = sight.is_full, Lurking(plan, sight.turns, self._comes)
        self._pictures = visibility(plan, sight).seen if sight.turns else None
        self._in_view = self._looked = np.ones(len(plan.free_cells), bool)  # now, and when the tracker was told last
        self._tracker: Tracker  # from `reset` on, where not everything is seen
        self._plan, self._age, self._unsure, self._frames = plan, age, unsure, frames
        strays = age * self._comes  # by which a child may be elsewhere than was foretold: it has stopped, or turned
        self._smallest_move = (_SMALLEST_MOVE if is_exact else _SMALLEST_SEEN) + strays
        self._clear_distance = _CLEAR_DISTANCE + strays
        self._as_usual = max(_AS_USUAL, _SIGMAS * candle_noise)
        self._next_cell = plan.graph.moves[0]
        self._tables = layout.Layout(plan).tables
        self._centres = {cell: tuple(plan.position(cell).tolist()) for cell in plan.caregiver_cells}
        self.table_heights: np.ndarray | None = None
        self._begun, self._all_clear, self._gone, self._clock = 0, False, 0.0, 0.0
        self._children: list[_Sighting] = []

    def reset(self, observation: dict[str, np.ndarray]) -> None:
        """Begin an episode with its first observation."""
        self._begun, self._all_clear, self._gone, self._clock = 0, False, 0.0, 0.0
        self._children = []
        self._glances_from = NOTHING  # the cell from which it has looked in each heading, at clocks that it remembers
        self._lurking.forget()
        self._last: dict[int, tuple[Vector, float]] = {}  # where each child was seen, and when
        self.table_heights = _table_heights(observation, self._tables, self._as_usual)
        children = np.atleast_2d(observation["toddler_position"])
        seen = observation.get("toddler_seen", np.ones(len(children)))
        for (x, y, _), is_seen in zip(children.tolist(), seen.tolist(), strict=True):
            cell = self.free_cell((x, y)) if is_seen else NOTHING
            self._children.append(_Sighting((x, y) if is_seen else None, False, cell, (cell, NOTHING)))
        if not self._is_full:
            self._tracker = Tracker(child_chain(self._plan), 1, len(children), CHANGE)
            self._in_view = observation["cell_seen"].min(axis=1) > 0.0
            self._see(np.flatnonzero(seen))

    def look(self, observation: dict[str, np.ndarray], now: float) -> View:
        """Return the robot's view, from an observation at a time in seconds since the episode's start."""
        poses, rates = observation["toddler_position"], observation["toddler_velocity"]
        if poses.ndim == 1:  # the same as below, and quicker
            (x, y, _), (vx, vy, _) = poses.tolist(), rates.tolist()
            children: tuple[ChildView, ...] = (ChildView((x, y), (vx, vy)),)
        else:
            pairs = zip(poses.tolist(), rates.tolist(), strict=True)
            children = tuple([ChildView((x, y), (vx, vy)) for (x, y, _), (vx, vy, _) in pairs])
        left, right = observation["finger_position"].tolist()
        numbers, lurking, hidden, gaze = None, _NOBODY, _NOBODY, None
        if "toddler_seen" in observation:
            numbers = tuple(np.flatnonzero(observation["toddler_seen"]).tolist())
            children = tuple(children[number] for number in numbers)
            visible = observation["cell_seen"] > 0.0
            self._in_view = visible.min(axis=1)
            base = tuple(observation["base_position"].tolist())
            gone = float(observation["clock"]) % 1.0
            lurking = self._lurking.at(base[:2], now, gone, self._tracker, numbers, visible)
            hidden = self._remembered(base[:2], dict(zip(numbers, children, strict=True)), now)
            gaze = self._gaze(base, children, numbers)
        return View(
            now=now,
            base=tuple(observation["base_position"].tolist()),
            fingers=left + right,
            arm=observation["arm_position"],
            children=children,
            candles=observation.get("candle_position", _NO_CANDLES),
            candle_orientations=observation.get("candle_orientation", _NO_ORIENTATIONS),
            gates=observation.get("gate_position", NO_GATES),
            things=observation.get("battery_position", NO_THINGS),
            table_heights=self.table_heights,
            age=self._age,
            unsure=self._unsure,
            numbers=numbers,
            lurking=lurking,
            hidden=hidden,
            gaze=gaze,
            child_comes=self._comes,
            child_runs=self._runs,
        )

    def _remembered(self, base: Vector, seen: dict[int, ChildView], now: float) -> tuple[ChildView, ...]:
        """Return how near children can be, at the worst, that were seen a moment ago: something may be in between."""
        self._last.update((number, (child.position, now)) for number, child in seen.items())
        found = []
        for number, ((x, y), then) in self._last.items():
            if number not in seen and now - then < _REMEMBERED:
                away = math.dist((x, y), base)
                nearer = min(self._comes * (now - then), max(0.0, away - _FELT)) / away if away else 0.0
                found.append(ChildView((x + nearer * (base[0] - x), y + nearer * (base[1] - y)), (0.0, 0.0)))
        return tuple(found)

    def _gaze(self, base: Pose, children: tuple[ChildView, ...], numbers: tuple[int, ...]) -> float | None:
        """Return where to look for the children that are not seen, or at the nearest one if all are."""
        if self._pictures is None:
            return None
        unseen = [number for number in range(len(self._children)) if number not in numbers]
        if not unseen:
            x, y = min((child.position for child in children), key=lambda place: math.dist(place, base[:2]))
            return math.atan2(y - base[1], x - base[0])
        cell = self._plan.cell_index[self._nearest(base[:2], self._plan.caregiver_cells)]
        if cell != self._glances_from:
            self._glances_from, self._glances = cell, np.full(len(_HEADINGS), -math.inf)
        presence = self._tracker.presence[0, unseen].sum(axis=0)
        chances = np.einsum("hc,c->h", self._pictures[cell, : len(_HEADINGS)], presence)
        # Where it has just looked the child is not, or behind something.
        chances *= np.minimum(1.0, (self._clock - self._glances) / len(_HEADINGS))
        if self._empty().any():
            self._glances[np.cos(_HEADINGS - base[2]).argmax()] = self._clock
        return float(_HEADINGS[chances.argmax()]) if chances.max() > _WORTH_A_LOOK else base[2]

    def watch(self, view: View, clock: float) -> tuple[bool, bool]:
        """Follow the children, at a time in novice timesteps.

        Returns:
            Whether it has just become clear what the present move of a child is; and whether that of the last one has,
            so that all of them are known.
        """
        move, self._clock = math.floor(clock + 1e-6), clock
        self._gone = max(0.0, clock - move)
        if self._is_full and self._all_clear and move == self._begun:
            return False, False  # nothing is to be made out before the next move
        numbers = range(len(view.children)) if view.numbers is None else view.numbers
        seen: dict[int, ChildView] = dict(zip(numbers, view.children, strict=True))
        if move != self._begun:
            self._begun, self._all_clear = move, False
            for number, sighting in enumerate(self._children):
                sighting.origin = seen[number].position if number in seen else None
                sighting.is_clear = False
        if self._all_clear and self._comes_into_sight(seen):
            return True, False
        if not (self._is_full or np.array_equal(self._in_view, self._looked)) and self._empty().any():
            self._see(seen, hidden_only=True)
        if self._all_clear:
            return False, False
        new, here = False, NOTHING if self._is_full else int(self._caregiver_cell(view)[0])
        for number, sighting in enumerate(self._children):
            if not sighting.is_clear and self._make_out(sighting, seen.get(number), here, clock - move >= _LATEST):
                new = True
        self._all_clear = all(sighting.is_clear for sighting in self._children)
        if new and self._all_clear and not self._is_full:
            previous, action, cell = np.array([[*one.previous, one.cell] for one in self._children]).T[:, None]
            self._tracker.move(previous, action, cell, self._empty(), self._caregiver_cell(view))
            self._looked = np.zeros_like(self._in_view)
        return new, new and self._all_clear

    def _comes_into_sight(self, seen: dict[int, ChildView]) -> bool:
        """Take in which children have come into sight, or gone out of it, since it was clear what they do."""
        in_sight = [number in seen for number in range(len(self._children))]
        if self._is_full or self._tracker.seen[0].tolist() == in_sight:
            return False
        for number, sighting in enumerate(self._children):
            if number in seen and sighting.cell == NOTHING:
                sighting.cell = self.free_cell(seen[number].position)
        self._see(seen)
        return True

    def _see(self, seen: Container[int], hidden_only: bool = False) -> None:
        """Have the tracker know where the children are that are seen, if that is news, and where none is."""
        hidden = np.array([[number not in seen for number in range(len(self._children))]])
        for sighting in itertools.compress(self._children, hidden[0]):
            sighting.cell = NOTHING
        cells = np.array([[sighting.cell for sighting in self._children]])
        self._tracker.look(cells, self._empty(), hidden if hidden_only else True)
        self._looked = self._in_view

    def _empty(self) -> np.ndarray:
        """Return in which cells a child would be seen now, if it was one that it is believed to be in, bool (1, cells).

        While it goes from one to the other it may be in neither: then in none.
        """
        left = 1.0 - self._gone if self._all_clear else self._gone
        return self._in_view[None] & (left <= _IN_ITS_CELL)

    def _make_out(self, sighting: _Sighting, child: ChildView | None, here: int, late: bool) -> bool:
        """Take in where a child is heading, if that is clear by now, and where the robot is."""
        if child is None or sighting.origin is None:
            if late:
                sighting.is_clear, sighting.previous = True, (NOTHING, NOTHING)
                sighting.cell = NOTHING if child is None else self.free_cell(child.position)
            return late
        dx, dy = child.position[0] - sighting.origin[0], child.position[1] - sighting.origin[1]
        distance = math.hypot(dx, dy)
        if distance < self._clear_distance and not late:
            return False
        sighting.is_clear = True
        cell, action = self.free_cell(sighting.origin), NOTHING
        sighting.cell = cell
        if distance > self._smallest_move:
            action = max(range(len(ACTIONS)), key=lambda a: dx * ACTIONS[a][1] - dy * ACTIONS[a][0])
            sighting.cell = int(self._next_cell[cell, action])
            if not self._is_full and sighting.cell == here:
                sighting.cell = cell  # it runs into the robot
        sighting.previous = (cell, action)
        return True

    def percept(self, view: View, holding: int, out_of_reach: np.ndarray, under_way: int = NOTHING) -> Percept:
        """Return the world as the caregiver knows it.

        The robot holds a candle of an index, or NOTHING, and is about a hazard of a number, or NOTHING. Hazards that
        are out of reach, (hazards,), are to be left alone.
        """
        tables, candle_cells = self._candle_places(view, holding)
        # Until the moves that are not made out yet, in novice timesteps: now, if they have just begun.
        time_left = 1.0 - self._gone if any(child.is_clear for child in self._children) else 0.0
        shut = np.append(np.zeros(len(self._plan.landings), bool), view.closed_gates) if len(view.gates) else None
        before, action = np.array([child.previous for child in self._children], int).reshape(-1, 2).T
        belief = None if self._is_full else self._tracker
        child_cell = np.array([[child.cell for child in self._children]]) if belief is None else belief.cell.copy()
        return Percept(
            child_cell=child_cell,
            previous_cell=np.where(before[None] == NOTHING, child_cell, before),
            previous_action=action[None],
            caregiver_cell=self._caregiver_cell(view),
            candle_table=tables[None],
            holding=np.array([holding]),
            candle_cell=candle_cells[None],
            out_of_reach=out_of_reach[None],
            shut=None if shut is None else shut[None],
            gone=view.things_gone[None] if len(view.things) else None,
            time_left=np.array([time_left]),
            clock=np.array([self._clock]),
            under_way=np.array([under_way]),
            hears=np.array([True]),
            belief=belief,
            frames=self._frames,
        )

    def _caregiver_cell(self, view: View) -> np.ndarray:
        return np.array([self._plan.cell_index[self._nearest(view.base[:2], self._plan.caregiver_cells)]])

    @property
    def in_view(self) -> np.ndarray | None:
        """Return which free cells are in view as a whole, bool (cells,); None if everything is seen."""
        return None if self._is_full else self._in_view

    def free_cell(self, position: Vector) -> int:
        """Return the index of the free cell at, or nearest to, a position."""
        return self._plan.cell_index[self._nearest(position, self._plan.free_cells)]

    def _nearest(self, position: Vector, cells: tuple[Cell, ...]) -> Cell:
        """The cell at a position if it is one of some, else the nearest one of these."""
        cell = self._plan.cell_at(np.array(position))
        index = self._plan.cell_index.get(cell)
        if index is not None and index < len(cells):
            return cell
        return min(cells, key=lambda c: math.dist(self._centres[c], position))

    def _candle_places(self, view: View, holding: int) -> tuple[np.ndarray, np.ndarray]:
        """On which table, or on which free cell's floor, each candle is; NOTHING for on none: (candles,) each."""
        if not len(view.candles):
            return np.zeros(0, int), np.zeros(0, int)
        offset = view.candles[:, None, :2] - self._tables[:, :2]  # (candles, tables, 2)
        over = (np.abs(offset) < layout.TABLE_HALF_SIZE).all(axis=2)
        on_table = over.any(axis=1) & (view.candles[:, 2] > layout.TABLE_HEIGHT / 2)
        tables = np.where(on_table, over.argmax(axis=1), NOTHING)
        cells = np.full(len(tables), NOTHING)
        for i in np.flatnonzero(~on_table):
            cells[i] = self.free_cell(tuple(view.candles[i, :2].tolist()))
        if holding != NOTHING:
            tables[holding] = cells[holding] = NOTHING
        return tables, cells


class Lurking:
    """Where a child that is not seen may come at the robot from.

    To one that sees all round it comes round a corner: between a cell in view and one in which it may be, but not at
    the base, where it is felt. To one that does not it may come from any unseen place of a cell in which it may be.
    """

    def __init__(self, plan: FloorPlan, turns: bool, comes: float):
        self._plan, self._turns, self._comes = plan, turns, comes  # m/s, of a child
        self.forget()
        centres = np.array([plan.position(cell) for cell in plan.free_cells])
        self._places = centres[:, None] + plan.cell_size * PLACES
        beside = plan.graph.moves[0]
        cell, move = np.nonzero(beside != np.arange(len(beside))[:, None])
        self._pairs = np.stack([cell, beside[cell, move]])  # of cells between which a child can walk, (2, n)

    def forget(self) -> None:
        """Begin an episode."""
        self._until, self._found = -math.inf, _NOBODY

    def at(
        self, base: Vector, now: float, gone: float, tracker: Tracker, seen: tuple[int, ...], visible: np.ndarray
    ) -> tuple[ChildView, ...]:
        """Return where it may be at the worst, near a robot, when so much of a novice timestep is gone.

        Those `seen` are children; `visible` are the `PLACES` of each cell in which one would be, bool (cells, 5).
        """
        if now < self._until:
            return self._found
        self._until, self._found = now + _LOOKS_AGAIN, ()
        unseen = [number for number in range(tracker.seen.shape[1]) if number not in seen]
        if unseen:
            presence = tracker.presence[0, unseen].max(axis=0)
            offsets = self._places - base + 1e-9  # (cells, 5, 2), in the base's own cell's middle it is somewhere, too
            away = np.linalg.norm(offsets, axis=2)
            near = away[:, 0] < _NEAR
            may_be = presence > 0.0  # it need not be one as is believed in, ...
            beside = np.zeros_like(may_be)  # ... nor be stopped by the robot, and is on its way: it may be a cell on
            beside[self._pairs[1, may_be[self._pairs[0]]]] = True
            may_be |= beside & (away[:, 0] > _FELT)
            if self._turns:
                # It is as far off its cell's middle as it walks in what is gone, or left, at most at the border. The
                # middle stands for half the way to the outer places, and these for the rest.
                off, out = min(gone * BUMP_SPEED / WALKING_SPEED, 1.0 - gone, 0.5), PLACES.max() * PLACES.any(axis=1)
                hides = ~visible & (may_be & near)[:, None] & (off >= out / 2)
                strays = np.where(out > 0.0, off, min(off, PLACES.max() / 2)) - out
                nearer = np.maximum(away - strays * self._plan.cell_size - _LOOKS_AGAIN * self._comes, _FELT)
                cells = np.flatnonzero(hides.any(axis=1))
                at = cells, np.where(hides, nearer, math.inf)[cells].argmin(axis=1)  # the nearest in each
                self._found = _standing(base + offsets[at] * (nearer[at] / away[at])[:, None])
            else:
                in_view, (hidden, open_) = visible.min(axis=1), self._pairs[:, near[self._pairs[0]]]
                middles = (self._places[hidden, 0] + self._places[open_, 0]) / 2
                comes = may_be[hidden] & ~in_view[hidden] & in_view[open_]
                self._found = _standing(middles[comes & (np.linalg.norm(middles - base, axis=1) > _FELT)])
        return self._found


def _standing(places: np.ndarray) -> tuple[ChildView, ...]:
    """Return children that stand in places, (n, 2)."""
    return tuple(ChildView((x, y), (0.0, 0.0)) for x, y in places.tolist())


def _table_heights(observation: dict[str, np.ndarray], tables: np.ndarray, as_usual: float) -> np.ndarray | None:
    """How high tables are, by the first observation of an episode.

    Where it does not say so, candles do that stand on them; other tables are taken to be as high as those, and all of
    them as high as usual unless that is clearly wrong, by more than `as_usual` metres. None if they are.
    """
    if "table_height" in observation:
        return observation["table_height"].copy()
    feet = observation.get("candle_position", _NO_CANDLES)
    feet = feet[feet[:, 2] > layout.TABLE_HEIGHT / 2]  # those on the floor say nothing of tables
    if not len(feet) or np.abs(feet[:, 2] - layout.TABLE_HEIGHT).max() < as_usual:
        return None
    nearest = np.linalg.norm(feet[:, None, :2] - tables[:, :2], axis=2).argmin(axis=1)
    heights = np.full(len(tables), np.median(feet[:, 2]))
    heights[nearest] = feet[:, 2]
    return heights

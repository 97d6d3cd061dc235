"""Perception: from a task's observation to the robot's view and the caregiver's percept.

The first centimetres of a child's move show its action, and the floor plan whether it ends in a bump. The percept
therefore has the cell and action that the grid would have after this move.
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
from caregiver_mj.policy.estimates import Senses
from caregiver_mj.robot.geometry import Pose, Vector
from caregiver_mj.robot.view import NO_GATES, NO_THINGS, ChildView, View

_NOBODY: tuple[ChildView, ...] = ()
_CLEAR_DISTANCE = 0.05  # m; length of a move that shows its direction
_LATEST = 0.5  # share of a novice timestep after which a child no longer sets out
_SMALLEST_MOVE = 0.005  # m; a child that has moved less then has stayed
_SMALLEST_SEEN = 0.03  # m; the same with inexact sensing
_AS_USUAL, _SIGMAS = 0.02, 4.0  # m, and standard deviations; height error of a candle on a standard table
_IN_ITS_CELL = 0.3  # share of a move, at both ends, during which the child counts as in the cell
_WORTH_A_LOOK = 0.02  # probability of an unseen child above which the robot looks there
_HEADINGS = np.array([math.atan2(-down, right) for down, right in ACTIONS])
_FELT = 0.4  # m; distance from the base's centre at which a child touches it
_NEAR, _LOOKS_AGAIN = 3.0, 0.1  # m, s; range and refresh interval of hidden approaches
_REMEMBERED = 2.0  # s; time after the last sighting during which a child counts as approaching
_NO_CANDLES, _NO_ORIENTATIONS = np.zeros((0, 3)), np.zeros((0, 4))


@dataclasses.dataclass
class _Sighting:
    """The known part of one child's present move."""

    origin: Vector | None  # start of the move, m; None if unseen
    is_clear: bool  # whether its direction is known
    cell: int  # its free cell after the move; NOTHING if unseen
    previous: tuple[int, int]  # cell of its last move, and that move; NOTHING before the first


class Perception:
    """Perception of one robot in one house.

    With inexact sensing, `senses` estimate the present from observations; None takes these as they are. Children walk
    `haste` times as fast as in the paper.

    Attributes:
        table_heights: Heights of the tables' tops, (tables,), m; None for the standard height.
    """

    def __init__(
        self,
        plan: FloorPlan,
        sight: Sight = FULL,
        senses: Senses | None = None,
        frames: Callable[[], dict[str, np.ndarray]] | None = None,
        haste: float = 1.0,
    ):
        self._comes, self._runs = haste * BUMP_SPEED, haste * FASTEST  # m/s; a child's usual and greatest speed
        self._is_full, self._lurking = sight.is_full, Lurking(plan, sight.turns, self._comes)
        self._pictures = visibility(plan, sight).seen if sight.turns else None
        self._in_view = self._looked = np.ones(len(plan.free_cells), bool)  # now, and at the tracker's last update
        self._tracker: Tracker  # from `reset` on, with partial sight
        self._plan, self._senses, self._frames = plan, senses, frames
        self._age, self._unsure, noise = (senses.age, senses.unsure, senses.candle_noise) if senses else (0.0, 0.0, 0.0)
        strays = self._age * self._comes  # m; error of a predicted position after a stop or turn
        self._smallest_move = (_SMALLEST_SEEN if senses else _SMALLEST_MOVE) + strays
        self._clear_distance = _CLEAR_DISTANCE + strays
        self._as_usual = max(_AS_USUAL, _SIGMAS * noise)
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
        if self._senses:
            self._senses.reset()
        self._glances_from = NOTHING  # cell of the last glances in each heading
        self._lurking.forget()
        self._last: dict[int, tuple[Vector, float]] = {}  # position and time of each child's last sighting
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
        """Return the robot's view of an observation, `now` seconds after the start of the episode."""
        if self._senses:
            observation = self._senses.now(observation)
        poses, rates = observation["toddler_position"], observation["toddler_velocity"]
        if poses.ndim == 1:  # a faster special case
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
        return View(  # positional: keywords take three times as long
            now,
            tuple(observation["base_position"].tolist()),
            left + right,
            observation["arm_position"],
            children,
            observation.get("candle_position", _NO_CANDLES),
            observation.get("candle_orientation", _NO_ORIENTATIONS),
            observation.get("gate_position", NO_GATES),
            observation.get("battery_position", NO_THINGS),
            self.table_heights,
            self._age,
            self._unsure,
            numbers,
            lurking,
            hidden,
            gaze,
            self._comes,
            self._runs,
        )

    def _remembered(self, base: Vector, seen: dict[int, ChildView], now: float) -> tuple[ChildView, ...]:
        """Return the nearest possible positions of recently seen children that may now be hidden."""
        self._last.update((number, (child.position, now)) for number, child in seen.items())
        found = []
        for number, ((x, y), then) in self._last.items():
            if number not in seen and now - then < _REMEMBERED:
                away = math.dist((x, y), base)
                nearer = min(self._comes * (now - then), max(0.0, away - _FELT)) / away if away else 0.0
                found.append(ChildView((x + nearer * (base[0] - x), y + nearer * (base[1] - y)), (0.0, 0.0)))
        return tuple(found)

    def _gaze(self, base: Pose, children: tuple[ChildView, ...], numbers: tuple[int, ...]) -> float | None:
        """Return the heading towards the likeliest unseen children, or towards the nearest child if all are seen."""
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
        # Recent glances found nobody: their headings count less.
        chances *= np.minimum(1.0, (self._clock - self._glances) / len(_HEADINGS))
        if self._empty().any():
            self._glances[np.cos(_HEADINGS - base[2]).argmax()] = self._clock
        return float(_HEADINGS[chances.argmax()]) if chances.max() > _WORTH_A_LOOK else base[2]

    def watch(self, view: View, clock: float) -> tuple[bool, bool]:
        """Observe the children's moves at a time in novice timesteps.

        Returns:
            Whether a child's present move has just become clear, and whether those of all children now are.
        """
        move, self._clock = math.floor(clock + 1e-6), clock
        self._gone = max(0.0, clock - move)
        if self._is_full and self._all_clear and move == self._begun:
            return False, False  # nothing more to observe until the next move
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
        new = False
        for number, sighting in enumerate(self._children):
            if not sighting.is_clear and self._make_out(sighting, seen.get(number), view.base, clock - move >= _LATEST):
                new = True
        self._all_clear = all(sighting.is_clear for sighting in self._children)
        if new and self._all_clear and not self._is_full:
            previous, action, cell = np.array([[*one.previous, one.cell] for one in self._children]).T[:, None]
            self._tracker.move(previous, action, cell, self._empty(), self._caregiver_cell(view))
            self._looked = np.zeros_like(self._in_view)
        return new, new and self._all_clear

    def _comes_into_sight(self, seen: dict[int, ChildView]) -> bool:
        """Return whether children have come into or gone out of sight after their moves became clear, and record it."""
        in_sight = [number in seen for number in range(len(self._children))]
        if self._is_full or self._tracker.seen[0].tolist() == in_sight:
            return False
        for number, sighting in enumerate(self._children):
            if number in seen and sighting.cell == NOTHING:
                sighting.cell = self.free_cell(seen[number].position)
        self._see(seen)
        return True

    def _see(self, seen: Container[int], hidden_only: bool = False) -> None:
        """Update the tracker by the children in sight and the empty cells in view."""
        hidden = np.array([[number not in seen for number in range(len(self._children))]])
        for sighting in itertools.compress(self._children, hidden[0]):
            sighting.cell = NOTHING
        cells = np.array([[sighting.cell for sighting in self._children]])
        self._tracker.look(cells, self._empty(), hidden if hidden_only else True)
        self._looked = self._in_view

    def _empty(self) -> np.ndarray:
        """Return the cells in view that would show a child, bool (1, cells); none amid a move, between cells."""
        left = 1.0 - self._gone if self._all_clear else self._gone
        return self._in_view[None] & (left <= _IN_ITS_CELL)

    def _make_out(self, sighting: _Sighting, child: ChildView | None, base: Pose, late: bool) -> bool:
        """Return whether a child's move has become clear, and record it and the cell that it ends in."""
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
            if not self._stops(base, cell, action):
                sighting.cell = int(self._next_cell[cell, action])
        sighting.previous = (cell, action)
        return True

    def _stops(self, base: Pose, cell: int, action: int) -> bool:
        """Return whether a child that moves from the centre of a cell touches the base before leaving the cell."""
        (down, right), (x, y) = ACTIONS[action], self._centres[self._plan.free_cells[cell]]
        ahead = (base[0] - x) * right - (base[1] - y) * down
        aside = (base[0] - x) * down + (base[1] - y) * right
        return abs(aside) < _FELT and 0.0 < ahead < self._plan.cell_size / 2 + math.sqrt(_FELT**2 - aside**2)

    def percept(self, view: View, holding: int, out_of_reach: np.ndarray, under_way: int = NOTHING) -> Percept:
        """Return the caregiver's percept.

        Args:
            view: The robot's view.
            holding: Index of the candle in the hand, or NOTHING.
            out_of_reach: Whether each hazard is in cooldown or needs nothing more, (hazards,).
            under_way: Number of the hazard under intervention, or NOTHING.
        """
        tables, candle_cells = self._candle_places(view, holding)
        # Novice timesteps until the next unknown moves, 0 if they have just begun.
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
        """Whether each free cell is entirely in view, bool (cells,); None with full sight."""
        return None if self._is_full else self._in_view

    def free_cell(self, position: Vector) -> int:
        """Return the index of the free cell at, or nearest to, a position."""
        return self._plan.cell_index[self._nearest(position, self._plan.free_cells)]

    def _nearest(self, position: Vector, cells: tuple[Cell, ...]) -> Cell:
        """Return the cell at a position if it is one of `cells`, else the nearest of them."""
        cell = self._plan.cell_at(np.array(position))
        index = self._plan.cell_index.get(cell)
        if index is not None and index < len(cells):
            return cell
        return min(cells, key=lambda c: math.dist(self._centres[c], position))

    def _candle_places(self, view: View, holding: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the table of each candle, and the free cell of each on the floor, else NOTHING, (candles,) each."""
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
    """Positions from which an unseen child may approach the robot.

    With a view in all directions, that is round a corner: from between a visible cell and an invisible one that may
    hold the child. At the base it would be felt. With a narrower view, it is any invisible place of such a cell.
    """

    def __init__(self, plan: FloorPlan, turns: bool, comes: float):
        self._plan, self._turns, self._comes = plan, turns, comes  # comes: m/s, a child's speed
        self.forget()
        centres = np.array([plan.position(cell) for cell in plan.free_cells])
        self._places = centres[:, None] + plan.cell_size * PLACES
        beside = plan.graph.moves[0]
        cell, move = np.nonzero(beside != np.arange(len(beside))[:, None])
        self._pairs = np.stack([cell, beside[cell, move]])  # neighbouring cells for a child, (2, n)

    def forget(self) -> None:
        """Begin an episode."""
        self._until, self._found = -math.inf, _NOBODY

    def at(
        self, base: Vector, now: float, gone: float, tracker: Tracker, seen: tuple[int, ...], visible: np.ndarray
    ) -> tuple[ChildView, ...]:
        """Return a child at each worst position near a robot.

        Args:
            base: The robot's position, m.
            now: Time, s.
            gone: Elapsed share of the novice timestep.
            tracker: The belief about the children.
            seen: Numbers of the children in sight.
            visible: Whether each of the `PLACES` of each cell is in view, bool (cells, 5).
        """
        if now < self._until:
            return self._found
        self._until, self._found = now + _LOOKS_AGAIN, ()
        unseen = [number for number in range(tracker.seen.shape[1]) if number not in seen]
        if unseen:
            presence = tracker.presence[0, unseen].max(axis=0)
            offsets = self._places - base + 1e-9  # (cells, 5, 2); never zero, so that they have a direction
            away = np.linalg.norm(offsets, axis=2)
            near = away[:, 0] < _NEAR
            may_be = presence > 0.0  # any, because the child model may be wrong
            beside = np.zeros_like(may_be)  # the child may be on its way to the next cell
            beside[self._pairs[1, may_be[self._pairs[0]]]] = True
            may_be |= beside & (away[:, 0] > _FELT)
            if self._turns:
                # A child is at most as far from the centre of its cell as it walks in the elapsed or remaining time, up
                # to the border. The centre represents half the way to the outer places, and these the rest.
                off, out = min(gone * BUMP_SPEED / WALKING_SPEED, 1.0 - gone, 0.5), PLACES.max() * PLACES.any(axis=1)
                hides = ~visible & (may_be & near)[:, None] & (off >= out / 2)
                strays = np.where(out > 0.0, off, min(off, PLACES.max() / 2)) - out
                nearer = np.maximum(away - strays * self._plan.cell_size - _LOOKS_AGAIN * self._comes, _FELT)
                cells = np.flatnonzero(hides.any(axis=1))
                at = cells, np.where(hides, nearer, math.inf)[cells].argmin(axis=1)  # nearest place in each cell
                self._found = _standing(base + offsets[at] * (nearer[at] / away[at])[:, None])
            else:
                in_view, (hidden, open_) = visible.min(axis=1), self._pairs[:, near[self._pairs[0]]]
                middles = (self._places[hidden, 0] + self._places[open_, 0]) / 2
                comes = may_be[hidden] & ~in_view[hidden] & in_view[open_]
                self._found = _standing(middles[comes & (np.linalg.norm(middles - base, axis=1) > _FELT)])
        return self._found


def _standing(places: np.ndarray) -> tuple[ChildView, ...]:
    """Return children standing at places, (n, 2)."""
    return tuple(ChildView((x, y), (0.0, 0.0)) for x, y in places.tolist())


def _table_heights(observation: dict[str, np.ndarray], tables: np.ndarray, as_usual: float) -> np.ndarray | None:
    """Return the tables' heights by the first observation of an episode, m; None for the standard height.

    If it has none, they are the heights of the candles on them, and the median of these for other tables. Heights
    within `as_usual` metres of the standard count as standard.
    """
    if "table_height" in observation:
        return observation["table_height"].copy()
    feet = observation.get("candle_position", _NO_CANDLES)
    feet = feet[feet[:, 2] > layout.TABLE_HEIGHT / 2]  # without those on the floor
    if not len(feet) or np.abs(feet[:, 2] - layout.TABLE_HEIGHT).max() < as_usual:
        return None
    nearest = np.linalg.norm(feet[:, None, :2] - tables[:, :2], axis=2).argmin(axis=1)
    heights = np.full(len(tables), np.median(feet[:, 2]))
    heights[nearest] = feet[:, 2]
    return heights

"""The limit: a caregiver that knows every move which the children will make."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver, Future, PrivilegedCaregiver, Truth
from caregiver_mj.caregivers.foresight.value_table import AllLayouts, costs
from caregiver_mj.caregivers.percept import PAPER, Percept, bare_tables
from caregiver_mj.errors import CaregiverError
from caregiver_mj.interventions.verb import Interventions
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Where
from caregiver_mj.plans.routes import RouteTables

LARGEST = 5_000  # stands of a house: as many fit into memory
_SPAN = 60  # moves for which a plan holds; then it is made anew
_CHUNK = 20_000_000  # numbers of plans that are made at once
_GOES_ON = 1e-3  # damage by which something else must be better than what it is about
ACTIONS = int(PAPER.cells)  # in a timestep
PRICE = 1.0  # of a move that the caregiver denies the child, after which all comes differently, in damage
EFFORT = 0.05  # of carrying a candle, in damage: so that it is not done for nothing
MOVES = 30  # of the child, after which the caregiver is thought to have arrived anyway
_LEFT_AFTER = 0  # actions left when a candle has been put down: what there is until the next move is lost


class ClairvoyantCaregiver(PrivilegedCaregiver, Caregiver):
    """Does what is best of all, knowing what comes; where its being in the way has changed that, it plans anew.

    Of several children it goes round the first only.

    Raises:
        CaregiverError: The house has something on its floor, or too many layouts of candles; or, later, the world
            cannot tell the future.
    """

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        if plan.floor_cells or plan.mouths:  # it knows neither to pick up nor to close
            what = plan.hazards.at(Where.FLOOR)[0] if plan.floor_cells else "a gate"
            raise CaregiverError(
                f"floor plan '{plan.name}' must have no gate, and nothing on its floor, for 'clairvoyant', got {what}"
            )
        layouts, stairwells = math.comb(len(plan.tables), len(plan.candle_tables)), len(plan.stairwells)
        # A post, or a table that bears a candle, in each layout: counted before any of them is made.
        if layouts * (max(1, stairwells) + len(plan.candle_tables)) > LARGEST:
            raise CaregiverError(
                f"floor plan '{plan.name}' must have at most {LARGEST:,} combinations of places for 'clairvoyant', got "
                f"more with {len(plan.tables)} tables, {len(plan.candle_tables)} candles and {stairwells} stairwells"
            )
        self._ways, self._programme = travel(plan), _programme(plan)
        self.reset(1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        self._begun = np.full(batch, NOTHING)
        self._now = -1  # number of the children's next move
        self._cells: np.ndarray | None = None  # of the children after every move
        self._since = np.full(batch, NOTHING)  # that for which the plan of each world was made

    def watch(self, percept: Percept) -> None:
        self._child = percept.child_cell
        self._now += 1

    def hear(self, truth: Truth) -> None:
        if truth.future is None:
            raise CaregiverError("'clairvoyant' needs future trajectories, which this world does not give")
        if self._cells is None:
            stale = np.ones(len(self._begun), bool)
        else:
            stale = (self._child != self._cells[self._now - 1]).any(axis=1) | (self._now - self._since >= _SPAN)
        if stale.any() and (self._cells is None or self._now < len(self._cells)):
            self._foresee(truth.future(), np.flatnonzero(stale))

    def choose(self, percept: Percept) -> np.ndarray:
        return self.decide(percept).hazard

    def decide(self, percept: Percept) -> Interventions:
        answer = Interventions.idle(len(percept.caregiver_cell))
        answer.verb[:] = self.idle_verb
        free = np.flatnonzero((percept.candle_table != NOTHING).all(axis=1) & (percept.holding == NOTHING))
        if free.size and len(self.plan.hazards):
            hazard, destination = self._best(percept, free)
            answer.verb[free] = np.append(self.plan.hazards.verb, self.idle_verb)[hazard]
            answer.hazard[free], answer.destination[free] = hazard, destination
            self._begun[free] = hazard
        return answer

    # -- What comes ------------------------------------------------------------------------------

    def _foresee(self, future: Future, worlds: np.ndarray) -> None:
        length, batch, children = future.cell.shape
        if self._cells is None:
            tables, keep = len(self.plan.tables), _SPAN + 2 * MOVES  # to get a candle, and to carry it
            self._cells = np.zeros((length, batch, children), int)
            self._falls, self._harm = np.zeros((length + 1, batch)), np.zeros((length + 1, tables, batch))
            carried = length + 1, tables, tables, batch
            self._carry, self._denied = np.zeros(carried, np.int8), np.zeros(carried, np.float32)
            self._value = np.zeros((keep, self._programme.stands, batch), np.float32)
        self._cells[self._now :, worlds] = future.cell[:, worlds]
        bumps = np.moveaxis(future.object[:, worlds], 1, 2)
        self._falls[self._now :, worlds], self._harm[self._now :, :, worlds] = self._programme.costs(bumps)
        before = np.concatenate([self._child[None, worlds, 0], future.cell[:, worlds, 0]])
        at_once = max(1, _CHUNK // (self._programme.stands * (length + 1)))
        for first in range(0, len(worlds), at_once):
            some = slice(first, first + at_once)
            which, carrying = worlds[some], self._programme.carrying(before[:, some])
            self._carry[self._now :, ..., which], self._denied[self._now :, ..., which] = carrying
            value = self._programme.to_come(before[:, some], bumps[:, :, some], carrying, len(self._value))
            self._value[: len(value), :, which] = value
            self._value[len(value) :, :, which] = 0.0
        self._since[worlds] = self._now

    # -- What to do about it ---------------------------------------------------------------------

    def _best(self, percept: Percept, worlds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The hazard, and the table to which it goes if it is a candle, (W,) each; see `Options`, which is alike."""
        if self._cells is None:
            raise CaregiverError("'clairvoyant' received no future trajectories")
        programme, plan, each = self._programme, self.plan, np.arange(len(worlds))
        tables, posts = percept.candle_table[worlds], programme.post_stand.shape[1]
        bare = np.nonzero(bare_tables(tables, len(plan.tables)))[1].reshape(len(worlds), -1)
        layout = programme.layouts.now(tables)
        ahead = np.concatenate([percept.child_cell[None, worlds, 0], self._cells[self._now :, worlds, 0]])
        here = percept.caregiver_cell[None, worlds]
        assert percept.time_left is not None  # a world that tells the future tells the time
        left = round(float(percept.time_left[0]) * ACTIONS)  # the same in all worlds
        moves, denied = (found[:, 0] for found in round_the_child(self._ways, ahead, here, left))
        to_post, to_get = moves[:posts], moves[posts:]
        last, now = len(self._falls) - 1, self._now
        falls = self._falls[:, worlds] - self._falls[now, worlds]

        def value(when: np.ndarray, stand: np.ndarray) -> np.ndarray:
            return falls[when, each] + self._value[when - self._since[worlds], stand, worlds]

        damage = value(np.minimum(now + to_post, last), programme.post_stand[layout].T) + denied[:posts]
        hazard = np.arange(posts) if plan.stairwells else np.full(posts, NOTHING)
        if bare.size and tables.size:
            source, target = tables.T[:, None], bare.T[None]  # (candles, 1, W), (1, bare tables, W)
            got = np.minimum(now + to_get[source, each], last)
            placed = np.minimum(got + self._carry[got, source, target, worlds], last)
            after = programme.layouts.after[layout, source, target]
            carried = value(placed, programme.table_stand[after, target]) + denied[posts:][source, each]
            carried += self._denied[got, source, target, worlds] + EFFORT
            carried += self._harm[placed, target, worlds] - self._harm[got, source, worlds]
            damage = np.concatenate([damage, carried.reshape(-1, len(worlds))])
            candles = plan.hazards.number(Where.ON_TABLE, np.arange(tables.shape[1]))
            hazard = np.concatenate([hazard, np.repeat(candles, bare.shape[1])])
        goes_on = (hazard[:, None] == self._begun[worlds]) & (hazard[:, None] != NOTHING)
        option = (damage - np.where(goes_on, _GOES_ON, 0.0)).argmin(axis=0)
        if not bare.size:
            return hazard[option], np.full(len(worlds), NOTHING)
        table = bare[each, (option - posts) % bare.shape[1]]
        return hazard[option], np.where(option >= posts, table, NOTHING)


class Hindsight:
    """What would be best if one knew what comes: a programme over time, for every place and layout of a house.

    As in `value_table`, damage by candles that stay where they are is left out, and bumps into bare tables, too; and
    the caregiver is at a post, from which it sets out after a move of the child, or beside a table where it has just
    put a candle down. What is left of a timestep when it arrives is lost.

    A *stand* is a layout with a post, or a layout with a table that bears a candle in it.

    Attributes:
        layouts: The layouts of the candles.
        stands: How many stands there are.
        post_stand: Those at posts, (layouts, posts).
        table_stand: Those beside tables, (layouts, tables), or NOTHING.
    """

    def __init__(self, plan: FloorPlan):
        self._plan, ways = plan, travel(plan)
        self.layouts = layouts = AllLayouts(len(plan.tables), len(plan.candle_tables))
        posts, count = len(ways.posts), len(layouts)
        self.post_stand = np.arange(count * posts).reshape(count, posts)
        self.table_stand = np.full((count, len(plan.tables)), NOTHING)
        self.table_stand[layouts.bears] = count * posts + np.arange(layouts.bears.sum())
        self.stands = count * posts + int(layouts.bears.sum())
        layout, table = np.nonzero(layouts.bears)
        at_posts = np.repeat(np.arange(count), posts), np.tile(ways.posts, count).astype(int), ACTIONS
        at_tables = layout, np.array(ways.central, int)[table], _LEFT_AFTER
        self._from_posts, self._from_tables = (_Ways(self, plan, *here) for here in (at_posts, at_tables))

    def costs(self, bumps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what comes, as damage, of what the children's moves bump into, (T, K, W), as `Future.object`.

        That is the damage of open stairwells before each move, (T + 1, W), and the more damage of a candle on each
        table than of the bare table from each move on, (T + 1, tables, W).
        """
        (fall, _, more), (length, _, worlds) = costs(self._plan), bumps.shape
        falls = fall * ((bumps >= 0) & (bumps < len(self._plan.stairwells))).sum(axis=1)
        table = len(self._plan.stairwells) + np.arange(len(self._plan.tables))
        harm = more * (bumps[:, None] == table[:, None, None]).sum(axis=2)
        nothing = np.zeros((1, len(table), worlds))
        before = np.concatenate([np.zeros((1, worlds)), np.cumsum(falls, axis=0)])
        after = np.concatenate([np.cumsum(harm[::-1], axis=0)[::-1].reshape(length, len(table), worlds), nothing])
        return before.astype(np.float32), after.astype(np.float32)

    def carrying(self, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return how long it takes to carry a candle from one table to another.

        The first child is in `cells` before each move and after the last one, (T + 1, W).

        Returns:
            Its moves meanwhile if the candle is got before each of them, and the price of those that are denied, both
            (T + 1, tables, tables, W).
        """
        ways = travel(self._plan)
        here = np.repeat(np.array(ways.central, int)[:, None], cells.shape[1], axis=1)
        posts = len(ways.posts)
        moves, denied = (part[:, posts:].swapaxes(1, 2) for part in _rounds(ways, cells, here, _LEFT_AFTER))
        return moves, denied

    def to_come(
        self, cells: np.ndarray, bumps: np.ndarray, carrying: tuple[np.ndarray, np.ndarray], span: int
    ) -> np.ndarray:
        """Return the least damage from each move on if the caregiver is in each stand then, (span, stands, W).

        The cells are as for `carrying`, which comes with what that has found; the bumps are as for `costs`.
        """
        known, (fall, _, _) = (*self.costs(bumps), *carrying), costs(self._plan)
        length, worlds = len(bumps), bumps.shape[2]
        posts, split = self.post_stand.shape[1], self.post_stand.size
        value = np.zeros((length + 1, self.stands, worlds), np.float32)
        from_posts, from_tables = (where.rounds(cells) for where in (self._from_posts, self._from_tables))
        for move in reversed(range(length)):
            stay, leave = value[move + 1, :split], self._from_posts.best(value, move + 1, known, from_posts)
            here = np.minimum(stay, leave).reshape(-1, posts, worlds)
            for post in range(posts):
                others = (bumps[move] >= 0) & (bumps[move] < len(self._plan.stairwells)) & (bumps[move] != post)
                here[:, post] += fall * others.sum(axis=0)
            value[move, :split] = here.reshape(split, worlds)
            value[move, split:] = self._from_tables.best(value, move, known, from_tables)
        return value[: min(span, length + 1)]


_programme = functools.lru_cache(maxsize=2)(Hindsight)


class _Ways:
    """Everything to which one can set out from stands, by layout and cell of each, (stands,), and actions left."""

    def __init__(self, programme: Hindsight, plan: FloorPlan, layout: np.ndarray, cell: np.ndarray, left: int):
        self._ways = travel(plan)
        self._left = left
        after = programme.layouts.after[layout]
        self._cells, self._place = np.unique(cell, return_inverse=True)
        self._post = programme.post_stand[layout].T  # (posts, stands)
        # Every relocation, in the order of stands.
        self._stand, self._source, self._target = np.nonzero(after != NOTHING)
        self._stand_after = programme.table_stand[after[after != NOTHING], self._target]
        self._first = np.flatnonzero(np.diff(self._stand, prepend=-1))  # of each stand that has any

    def rounds(self, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return _rounds(self._ways, cells, np.repeat(self._cells[:, None], cells.shape[1], axis=1), self._left)

    def best(
        self, value: np.ndarray, move: int, known: tuple[np.ndarray, ...], rounds: tuple[np.ndarray, ...]
    ) -> np.ndarray:
        """Least damage from a move on, (stands, W), if one sets out just before; see `Hindsight`."""
        falls, harm, carry, refused = known
        last, each = len(falls) - 1, np.arange(value.shape[2])
        when, denied = np.minimum(move + rounds[0][move], last), rounds[1][move]  # (goals, places, W)
        best = np.full((len(self._place), len(each)), np.inf, np.float32)
        for post, stand in enumerate(self._post):
            there = when[post, self._place]
            best = np.minimum(best, falls[there, each] + value[there, stand[:, None], each] + denied[post, self._place])
        if len(self._stand):
            goal = len(self._post) + self._source, self._place[self._stand]
            get = when[goal]
            leg = get, self._source[:, None], self._target[:, None], each
            place = np.minimum(get + carry[leg], last)
            carried = value[place, self._stand_after[:, None], each] + falls[place, each] + EFFORT
            carried += denied[goal]
            carried += refused[leg]
            carried += harm[place, self._target[:, None], each] - harm[get, self._source[:, None], each]
            which = self._stand[self._first]
            best[which] = np.minimum(best[which], np.minimum.reduceat(carried, self._first))
        return best - falls[move]


def _rounds(ways: Travel, cells: np.ndarray, here: np.ndarray, left: int) -> tuple[np.ndarray, np.ndarray]:
    """What `round_the_child` finds before each move, and after the last one: both (T + 1, goals, places, W)."""
    found = [round_the_child(ways, cells[move:], here, left) for move in range(len(cells) - 1)]
    last_moves, last_denied = found[-1]
    found.append((np.zeros_like(last_moves), np.zeros_like(last_denied)))
    moves, denied = zip(*found, strict=True)
    return np.array(moves, np.int16), np.array(denied, np.float32)


def round_the_child(ways: Travel, cells: np.ndarray, cell: np.ndarray, left: int) -> tuple[np.ndarray, np.ndarray]:
    """Return how the caregiver gets about if it is known where the child will be.

    The child is in `cells` before each of its moves and after the last one, (T + 1, W), and the caregiver in `cell`,
    (places, W), with so many actions left before the next move. What comes of it are the child's moves until the
    caregiver is in each post or has done something at each table, and the price of those that lead into it: both
    (posts and tables, places, W).
    """
    step, child = ways.step, cells[0]
    goal = np.arange(step.shape[2])[:, None, None]
    end = np.array([*ways.posts, *[ways.done] * (len(goal) - len(ways.posts))])[:, None, None]
    at = step[left, child, goal, cell].astype(int)
    moves, denied = np.zeros(at.shape, int), np.zeros(at.shape, int)
    for after in cells[1 : MOVES + 1]:
        under_way = at != end
        if not under_way.any():
            break
        moves += under_way
        denied += under_way & (at == after) & (child != after)
        child = after
        at = np.where(under_way, step[ACTIONS, child, goal, at], at)
    return moves, PRICE * denied


@functools.lru_cache(maxsize=4)
def travel(plan: FloorPlan) -> Travel:
    """Return the ways through a house; made once."""
    return Travel(plan)


class Travel:
    """The caregiver's ways at the paper's pace, by the rules of `plans.routes`.

    Attributes:
        posts: Cells of the landings. A house without stairwells has one post all the same: where the tables are
            nearest.
        done: The number of the cell in which it has got a candle; see `step`.
        step: The cell that it is in after a number of actions, 0 to those of a timestep, on its way to each goal, the
            posts and then beside each table, (actions, children's cells, goals, cells). Who has got the candle from a
            table is in one more cell, which there is not, the last one: `done`.
        central: For every table the cell beside it from which the rest is nearest.
    """

    def __init__(self, plan: FloorPlan):
        graph, cells = plan.graph, len(plan.caregiver_cells)
        stands = graph.beside(plan.tables)
        self.posts = [plan.cell_index[cell] for cell in plan.stairwells]
        if not self.posts:
            self.posts = [int(graph.distances_from(stands).sum(axis=0).argmin()) if stands else 0]
        goals = [[post] for post in self.posts] + stands
        routes = RouteTables(plan, goals)
        open_way = routes.open_distance.astype(int)
        self.done = cells
        one = np.full((len(plan.free_cells), len(goals), cells + 1), cells, np.int16)
        for child in range(len(one)):
            distance, towards = (found[:-1] for found in routes.around(child))
            fetched = (distance == 0) & (np.arange(len(goals)) >= len(self.posts))[:, None]
            one[child, :, :cells] = np.where(fetched, cells, towards)
            # Where the child is thought to have walked through the caregiver it has been kept back, and bars no way.
            one[child, :, child] = graph.downhill(open_way)[:, child]
        steps = [np.broadcast_to(np.arange(cells + 1, dtype=np.int16), one.shape)]
        for _ in range(int(PAPER.cells)):
            steps.append(np.take_along_axis(one, steps[-1].astype(int), axis=2))
        self.step = np.stack(steps)
        self.central = [min(stand, key=lambda cell: open_way[:, cell].sum(), default=0) for stand in stands]

"""What would be best if one knew what comes: a programme over time, for every place of the caregiver and every layout.

As in `values`, damage by candles that stay where they are is left out, and bumps into bare tables, too; and the
caregiver is at a post, from which it sets out after a move of the child, or beside a table where it has just put a
candle down. What is left of a timestep when it arrives is lost.
"""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.foresight.layouts import AllLayouts
from caregiver_mj.caregivers.foresight.travel import Travel, travel
from caregiver_mj.caregivers.pace import PAPER
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

ACTIONS = int(PAPER.cells)  # in a timestep
PRICE = 1.0  # of a move that the caregiver denies the child, after which all comes differently, in damage
EFFORT = 0.05  # of carrying a candle, in damage: so that it is not done for nothing
MOVES = 30  # of the child, after which the caregiver is thought to have arrived anyway
_LEFT_AFTER = 0  # actions left when a candle has been put down: what there is until the next move is lost


class Hindsight:
    """The programme of a house.

    A *stand* is a layout with a post, or a layout with a table that bears a candle in it.

    Attributes:
        layouts: The layouts of the candles.
        stands: How many stands there are.
        post_stand: Those at posts, (layouts, posts).
        table_stand: Those beside tables, (layouts, tables), or NOTHING.
    """

    def __init__(self, plan: FloorPlan):
        """Finds the ways."""
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
        """What comes, as damage.

        Args:
            bumps: What the moves of the children bump into, (T, K, W), as `Future.object`.

        Returns:
            Damage of open stairwells before each move, (T + 1, W), and more damage of a candle on each table than of
            the bare table from each move on, (T + 1, tables, W).
        """
        damage, (length, _, worlds) = self._plan.damage, bumps.shape
        falls = damage.stairwell * ((bumps >= 0) & (bumps < len(self._plan.stairwells))).sum(axis=1)
        table = len(self._plan.stairwells) + np.arange(len(self._plan.tables))
        harm = (damage.candle - damage.table) * (bumps[:, None] == table[:, None, None]).sum(axis=2)
        nothing = np.zeros((1, len(table), worlds))
        before = np.concatenate([np.zeros((1, worlds)), np.cumsum(falls, axis=0)])
        after = np.concatenate([np.cumsum(harm[::-1], axis=0)[::-1].reshape(length, len(table), worlds), nothing])
        return before.astype(np.float32), after.astype(np.float32)

    def carrying(self, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How long it takes to carry a candle from one table to another.

        Args:
            cells: The first child's cell before each move and after the last one, (T + 1, W).

        Returns:
            Moves of the child meanwhile if the candle is got before each move, and the price of those that are denied,
            both (T + 1, tables, tables, W).
        """
        ways = travel(self._plan)
        here = np.repeat(np.array(ways.central, int)[:, None], cells.shape[1], axis=1)
        posts = len(ways.posts)
        moves, denied = (part[:, posts:].swapaxes(1, 2) for part in _rounds(ways, cells, here, _LEFT_AFTER))
        return moves, denied

    def to_come(
        self, cells: np.ndarray, bumps: np.ndarray, carrying: tuple[np.ndarray, np.ndarray], span: int
    ) -> np.ndarray:
        """Least damage from each move on if the caregiver is in each stand then.

        Args:
            cells: As for `carrying`.
            bumps: As for `costs`.
            carrying: What that has found.
            span: For how many moves it is wanted.

        Returns:
            Array (span, stands, W).
        """
        known = *self.costs(bumps), *carrying
        length, worlds = len(bumps), bumps.shape[2]
        posts, split = self.post_stand.shape[1], self.post_stand.size
        value = np.zeros((length + 1, self.stands, worlds), np.float32)
        from_posts, from_tables = (where.rounds(cells) for where in (self._from_posts, self._from_tables))
        for move in reversed(range(length)):
            stay, leave = value[move + 1, :split], self._from_posts.best(value, move + 1, known, from_posts)
            here = np.minimum(stay, leave).reshape(-1, posts, worlds)
            for post in range(posts):
                others = (bumps[move] >= 0) & (bumps[move] < len(self._plan.stairwells)) & (bumps[move] != post)
                here[:, post] += self._plan.damage.stairwell * others.sum(axis=0)
            value[move, :split] = here.reshape(split, worlds)
            value[move, split:] = self._from_tables.best(value, move, known, from_tables)
        return value[: min(span, length + 1)]


class _Ways:
    """Everything to which one can set out from some stands."""

    def __init__(self, programme: Hindsight, plan: FloorPlan, layout: np.ndarray, cell: np.ndarray, left: int):
        """Finds it.

        Args:
            programme: The programme.
            plan: The house.
            layout: Layout of each stand, (stands,).
            cell: Cell of each, likewise.
            left: Actions left when one sets out.
        """
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
        """See `round_the_child`, before each move, (T + 1, goals, places, W)."""
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
    """How the caregiver gets about if it is known where the child will be.

    Args:
        ways: The ways.
        cells: The child's cell before each of its moves and after the last one, (T + 1, W).
        cell: The caregiver's, (places, W).
        left: Actions that it has left before the next move.

    Returns:
        The child's moves until the caregiver is in each post or has done something at each table, and the price of
        those that lead into the caregiver: both (posts and tables, places, W).
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

"""How far caregivers are from the best that anybody could do, in houses small enough to know that.

For tiny generated houses the decision process of the grid, told toy bin and epsilon, is solved exactly twice: for a
caregiver that is free in its motion, and for one with the interventions of ours. What is to be least is the planner's
own: discounted damage, and a price of denied moves. Beside these optima stands what caregivers leave: the optimum where
an episode begins, and all that their actions in it then forgo.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.sparse import coo_array, csr_array

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.value_table import OBJECTIVE, Objective
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.child_group import ChildGroup, side_by_side
from caregiver_mj.children.novice import Novice
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.experiments import two_level
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.cell_graph import ACTIONS, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, State, Where
from caregiver_mj.plans.routes import RouteTables
from study import Parser, fill_in, run_all
from study import table as in_markdown

EPSILONS = (1.0, 0.5, 0.05)
CAREGIVERS = {
    "knows-goal": "planner, privileged: bin and epsilon (`knows-goal`)",
    "foresight": "planner (`foresight`)",
    "paper": "rule (`paper`)",
}
SIZES = ("8x7", "9x6-rooms2", "8x7-rooms2", "10x5", "9x6")  # with 13 to 25 free cells
FIRST_SEED = 600_000
TIMESTEPS = 400  # of an episode; what comes later counts less than .3 %
NEAR = 1.05  # of the optimum
ACTIONS_A_TIMESTEP = 3  # of the caregiver
_SWEEPS = 60  # by which a policy is evaluated
_TOLERANCE = 1e-5  # of all values, as a share of the greatest


class Job(NamedTuple):
    """All episodes in one house."""

    house: str
    episodes: int


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("houses", 50, "how many", metavar="N")
    parser.add("episodes", 40, "with each child")
    parser.add_jobs()
    parser.add_file("docs", "write it into the guide's page there", "DIR")


def run(options: argparse.Namespace) -> None:
    """Run the study; print its table."""
    work = [Job(house, options.episodes) for house in houses(options.houses)]
    text = report(pd.concat(run_all(costs, work, options.jobs, "houses"), ignore_index=True))
    print(text)
    if options.docs:
        fill_in(options.docs / "guide" / "foresight.md", "optimum", text)


def houses(count: int) -> list[str]:
    """Return the names of tiny houses."""
    return [f"house-{FIRST_SEED + i}-{SIZES[i % len(SIZES)]}" for i in range(count)]


def costs(job: Job) -> pd.DataFrame:
    """Return costs in a house: a row an episode and child, a column an optimum or a caregiver."""
    plan = FloorPlan.load(job.house)
    own = Exact(plan, EPSILONS)
    found = {name: forgone(own, make_caregiver(name, plan), job.episodes).sum(axis=0) for name in CAREGIVERS}
    found = {name: at_first(own, job.episodes) + cost for name, cost in found.items()}
    found |= {"free": at_first(Exact(plan, EPSILONS, free=True), job.episodes), "own": at_first(own, job.episodes)}
    return pd.DataFrame({"house": job.house, "epsilon": np.repeat(EPSILONS, job.episodes)} | found)


def begin(plan: FloorPlan, epsilons: Sequence[float], caregiver: Caregiver | None, episodes: int) -> GridWorld:
    """Return the beginning of as many episodes with each epsilon: the same ones for all caregivers."""
    world = GridWorld(plan, side_by_side(plan, [ChildGroup.of(one) for one in epsilons], episodes), caregiver)
    streams = [RandomStream.draw_group(np.random.RandomState(seed), 1, TIMESTEPS) for seed in range(episodes)]
    world.reset(streams * len(epsilons))
    return world


def at_first(exact: Exact, episodes: int) -> np.ndarray:
    """Return the optimum where each episode begins, (episodes with each child,)."""
    return exact.value[_state(exact, begin(exact.plan, exact.epsilons.tolist(), None, episodes))]


def forgone(exact: Exact, caregiver: Caregiver | None, episodes: int) -> np.ndarray:
    """Return the discounted cost of what a caregiver does beyond that of what is best, (timesteps, all episodes).

    It is never negative, and in expectation over what the child does next, which leaves out most of the chance.
    """
    world = begin(exact.plan, exact.epsilons.tolist(), caregiver, episodes)
    before = _state(exact, world)
    found = np.zeros((TIMESTEPS, len(before[0])))
    for timestep in range(TIMESTEPS):
        world.step()
        now = _state(exact, world)
        layout = exact.taken[now[0], before[2]]
        moved = (now[0], before[1], layout, *now[3:])  # the child has, and the caregiver not yet
        found[timestep] = exact.objective.discount ** (timestep + 1) * (exact.value[now] - exact.after[moved])
        before = now
    return found


def _state(exact: Exact, world: GridWorld) -> tuple[np.ndarray, ...]:
    """Return the indices of the worlds' states in the tables, (B,) each."""
    lying = world.plan.hazards.split(world.state)[2] == State.AS_PLANNED
    layout = exact.layout(world.candle_table, world.holding, world.orders.destination, lying)
    epsilon = np.repeat(np.arange(len(exact.epsilons)), len(layout) // len(exact.epsilons))
    return world.child_cell[:, 0], world.caregiver_cell, layout, world.goal[:, 0], epsilon


def report(rows: pd.DataFrame) -> str:
    """Return the table, of means over houses."""

    def samples(epsilon: float, column: str) -> list[np.ndarray]:
        some = rows[rows.epsilon == epsilon]
        return [house.to_numpy(float) for _, house in some.groupby("house", sort=False)[column]]

    lines = []
    for epsilon in EPSILONS:
        own = samples(epsilon, "own")
        names = {"free": "optimum, free in its motion", "own": "optimum of our interventions", **CAREGIVERS}
        for column, name in names.items():
            costs = samples(epsilon, column)
            ratio = two_level.of_ratio(costs, own)
            means, least = two_level.house_means(costs), two_level.house_means(own)
            near = f"{(means <= NEAR * least).sum()} of {len(costs)}" if column in CAREGIVERS else ""
            over = f"{ratio.value:.3f} ({ratio.low:.3f} to {ratio.high:.3f})" if column != "own" else "1"
            lines.append((f"{epsilon:g}", name, f"{means.mean():.3f}", over, near))
    titles = ("epsilon", "caregiver", "cost", "over the optimum of our interventions", f"houses within {NEAR - 1:.0%}")
    return in_markdown(titles, lines)


# -- The decision process, solved -------------------------------------------------------------------


class Exact:
    """Least cost to come of any caregiver that knows toy bin and epsilon.

    It shares only the house's moves, the novice and the objective with `caregiver_mj.caregivers.foresight`. It solves
    the process for one of two caregivers:

    - A free caregiver chooses each of its three actions in a timestep: walk to any next cell without the child, wait,
      get, or place.
    - A caregiver with our interventions chooses before each action to block a stairwell, to stand aside, to wait where
      it is or next to that, to relocate a candle to a table, or to pick something up off the floor. The rule of
      `plans.routes` moves it. With a candle in its hand it carries the candle to its table.

    The first layouts are the sets of tables with candles, with an empty hand. Those with one candle less, which is in
    the hand, follow for each table to which it is carried (for the free caregiver, for no particular one). These
    layouts repeat for each set of things on the floor, beginning with the set of all.

    Attributes:
        plan: The house.
        epsilons: Those of the children, (E,).
        objective: The quantity to minimise.
        taken: The layout that a child in each cell leaves of each layout, after it takes things off the floor,
            (C, layouts).
        cost: Of the child's next move, (C, R, layouts, G, E): by cell of the child and of the caregiver, toy bin and
            epsilon.
        value: Cost to come just before the child's move, shaped like `cost`.
        after: Cost to come just after the child's move, shaped like `cost`.
    """

    def __init__(
        self, plan: FloorPlan, epsilons: Sequence[float], objective: Objective = OBJECTIVE, free: bool = False
    ):
        """Solve it for a small house, for the caregiver that is `free` in its motion or the other one.

        Of the objective, which is to be least, sweeps and tolerance are not heeded.
        """
        self.plan, self.epsilons, self.objective, self._free = plan, np.asarray(epsilons, float), objective, free
        cells, places = len(plan.free_cells), len(plan.caregiver_cells)
        self._child = np.arange(cells)[:, None]
        self._list_layouts()
        self._list_steps()
        greedy = Novice(plan, 0.0).action_probabilities()[:, :, None]  # (C, G, 1, moves)
        epsilon = self.epsilons[:, None]
        self._chance = epsilon / len(ACTIONS) + (1 - epsilon) * greedy  # (C, G, E, moves)
        next_cell = plan.graph.moves[0]
        denied = (next_cell[:, None] == np.arange(places)[:, None]) & (next_cell[:, None] != self._child[..., None])
        self._there = np.where(denied, self._child[..., None], next_cell[:, None])  # (C, R, moves)
        price = objective.price * (1 - epsilon) * greedy + objective.random_price * epsilon / len(ACTIONS)
        self.cost = self._damage() + np.einsum("crm,cgem->crge", denied.astype(float), price)[:, :, None]
        self.value, self.after = self._solve()

    # -- What to expect --------------------------------------------------------------------------

    def layout(
        self, candle_table: np.ndarray, holding: np.ndarray, destination: np.ndarray, lying: np.ndarray
    ) -> np.ndarray:
        """Return the numbers of layouts, (B,).

        They are of the table of each candle, or NOTHING, (B, candles), the candle in the hand, or NOTHING, and the
        table to which that is carried, (B,) each, and of whether each thing still lies on the floor, (B, things).
        """
        where = np.where(holding == NOTHING, NOTHING, 0 if self._free else destination)
        return np.array(
            [
                self._number[tuple(sorted(set(tables) - {NOTHING})), to, tuple(things)]
                for tables, to, things in zip(candle_table.tolist(), where.tolist(), lying.tolist(), strict=True)
            ]
        )

    # -- The decision process --------------------------------------------------------------------

    def _list_layouts(self) -> None:
        tables, candles = range(len(self.plan.tables)), len(self.plan.candle_tables)
        full = [(layout, NOTHING) for layout in itertools.combinations(tables, candles)]
        fewer = list(itertools.combinations(tables, candles - 1)) if candles else []
        to = [0] if self._free else tables
        held = [(layout, table) for table in to for layout in fewer if self._free or table not in layout]
        floors = list(itertools.product((True, False), repeat=len(self.plan.floor_cells)))
        self._number = {(*one, lying): n for n, (lying, one) in enumerate(itertools.product(floors, [*full, *held]))}
        listed = list(self._number)
        self._empty = np.array([number for number, (_, there, _) in enumerate(listed) if there == NOTHING], int)
        self._held = {table: np.array([n for n, one in enumerate(listed) if one[1] == table], int) for table in to}
        self._bears = np.array([[table in layout for table in tables] for layout, *_ in listed], bool)
        self._bears = self._bears.reshape(len(listed), len(tables))
        self._lying = np.array([lying for *_, lying in listed], bool).reshape(len(listed), -1)
        self.taken = np.tile(np.arange(len(listed)), (len(self.plan.free_cells), 1))
        # What an action at a table, or in the cell of a thing, makes of a layout.
        self._handled, self._picked = [], []
        for (layout, to_table, lying), number in self._number.items():
            for thing, cell in enumerate(self.plan.floor_cells):
                gone = self._number[layout, to_table, (*lying[:thing], False, *lying[thing + 1 :])]
                self.taken[cell, number] = gone
                if lying[thing] and to_table == NOTHING:
                    self._picked.append((cell, number, gone))
            for table in tables:
                if to_table == NOTHING and table in layout:
                    rest = tuple(one for one in layout if one != table)
                    others = [
                        self._number.get((rest, there, lying)) for there in to if self._free or there not in layout
                    ]
                elif to_table != NOTHING and table not in layout and (self._free or table == to_table):
                    others = [self._number[tuple(sorted((*layout, table))), NOTHING, lying]]
                else:
                    others = []
                self._handled += [(table, number, other) for other in others]

    def _list_steps(self) -> None:
        """List where each choice leads to in an action, (C, R) each, and where a table is at hand, bool (C, R)."""
        graph, cells, places = self.plan.graph, len(self.plan.free_cells), len(self.plan.caregiver_cells)
        stands, here = graph.beside(self.plan.tables), np.broadcast_to(np.arange(places), (cells, places))
        around = np.array([[*n, *[i] * (5 - len(n))] for i, n in enumerate(graph.neighbours)])
        steps = [np.where(there == self._child, here, there) for there in around.T]
        if self._free:
            at = [np.isin(here, stand) for stand in stands]
            self._choices = [(np.arange(len(self._number)), there) for there in steps]
        else:
            posts = [[self.plan.cell_index[cell]] for cell in self.plan.stairwells]
            things = [[cell] for cell in self.plan.floor_cells]
            routes = RouteTables(self.plan, [*posts, *stands, *things])
            far, towards = (np.stack(one, axis=1) for one in zip(*map(routes.around, range(cells)), strict=True))
            at = [far[len(posts) + table] == 0 for table in range(len(stands))]
            self._choices = [(self._empty, there) for there in (*steps, *towards[: len(posts)], towards[-1])]
            for thing, there in enumerate(towards[len(posts) + len(stands) : -1]):
                self._choices.append((self._empty[self._lying[self._empty, thing]], there))
            for table, there in enumerate(towards[len(posts) : len(posts) + len(stands)]):
                bears = self._empty[self._bears[self._empty, table]]
                self._choices += [(bears, there), (self._held[table], there)]
        self._at = at

    def _damage(self) -> np.ndarray:
        """Return that of the child's next move."""
        damage, (_, target, index) = self.plan.damage, self.plan.graph.moves
        cells, places = len(target), len(self.plan.caregiver_cells)
        harm = np.zeros((cells, places, len(self._number), len(ACTIONS)))
        for cell, move in itertools.product(range(cells), range(len(ACTIONS))):
            if target[cell, move] == Target.STAIRWELL:
                is_open = np.arange(places) != cells + index[cell, move]
                harm[cell, :, :, move] = damage["stairwell"] * is_open[:, None]
            elif target[cell, move] == Target.TABLE:
                harm[cell, :, :, move] = np.where(self._bears[:, index[cell, move]], damage["candle"], damage["table"])
        for thing, cell in zip(self.plan.hazards.at(Where.FLOOR), self.plan.floor_cells, strict=True):
            enters = (self._there == cell) & (self._child[..., None] != cell)  # (C, R, moves)
            harm += thing.damage * enters[:, :, None] * self._lying[:, thing.index, None]
        return np.einsum("crlm,cgem->crlge", harm, self._chance)

    def _solve(self) -> tuple[np.ndarray, np.ndarray]:
        """Iterate policies until the bounds of MacQueen are close (Puterman 1994, sections 6.5 and 6.6)."""
        discount, moves = self.objective.discount, self._moves()
        cost = self.cost.ravel()
        value = np.zeros_like(cost)
        while True:
            after, chosen = value, np.arange(value.size)
            for _ in range(ACTIONS_A_TIMESTEP):
                after, states = self._act(after.reshape(self.cost.shape))
                chosen = chosen[states]
            new = cost + moves @ after
            low, high = (new - value).min(), (new - value).max()
            value = new
            if discount / (1 - discount) * (high - low) <= _TOLERANCE * max(1.0, value.max()):
                more = (high + low) / 2 / (1 - discount)  # what further sweeps add everywhere
                return (value + discount * more).reshape(self.cost.shape), (after + more).reshape(self.cost.shape)
            policy = csr_array((moves.data, chosen[moves.indices], moves.indptr), shape=moves.shape)
            for _ in range(_SWEEPS):
                value = cost + policy @ value

    def _moves(self) -> csr_array:
        """Return the discounted probabilities of the states after a move of the child, (states, states)."""
        _, target, index = self.plan.graph.moves
        shape = self.cost.shape
        state = np.arange(self.cost.size).reshape(shape)
        entries = []
        for move in range(len(ACTIONS)):
            chance = np.broadcast_to(self._chance[:, None, None, ..., move], shape)
            reaches = (target[:, move, None] == Target.BIN) & (index[:, move, None] == np.arange(shape[3]))
            reaches = np.broadcast_to(reaches[:, None, None, :, None], shape) & (chance > 0)
            cell = self._there[:, :, move]
            there = state[cell[..., None], np.arange(shape[1])[:, None], self.taken[cell]]
            goes_on = ~reaches & (chance > 0)
            entries.append((chance[goes_on], state[goes_on], there[goes_on]))
            for goal in range(shape[3]):
                other = np.broadcast_to(state[:, :, :, goal : goal + 1], shape)
                entries.append((chance[reaches] / shape[3], state[reaches], other[reaches]))
        chances, rows, columns = map(np.concatenate, zip(*entries, strict=True))
        size = (state.size, state.size)
        return csr_array(coo_array((self.objective.discount * chances, (rows, columns)), shape=size))

    def _act(self, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what is to come if one more action is done first, and the state to which the best one leads."""
        state = np.arange(after.size).reshape(after.shape)
        best, chosen = np.full_like(after, np.inf), state.copy()

        def consider(where: tuple[slice | np.ndarray | int, ...], found: np.ndarray, states: np.ndarray) -> None:
            better = found < best[where]
            best[where] = np.where(better, found, best[where])
            chosen[where] = np.where(better, states, chosen[where])

        for layouts, there in self._choices:
            where = (self._child[..., None], there[..., None], layouts)
            consider((slice(None), slice(None), layouts), after[where], state[where])
        if not self._free:  # where its candle is to be put down, it is
            for table, held in self._held.items():
                child, cell = np.nonzero(self._at[table])
                best[child[:, None], cell[:, None], held] = np.inf
        for table, number, other in self._handled:
            child, cell = np.nonzero(self._at[table])
            consider((child, cell, number), after[child, cell, other], state[child, cell, other])
        for place, number, other in self._picked:
            consider((slice(None), place, number), after[:, place, other], state[:, place, other])
        return best.ravel(), chosen.ravel()

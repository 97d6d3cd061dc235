"""The grid world, held against published figures and against a plain world of one episode, written here."""

import functools
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_plans import plan_texts, plans_with_things
from walks import distances, neighbours
from worlds import begun, streams

from caregiver_mj import CaregiverError, FloorPlan
from caregiver_mj.caregivers import CAREGIVERS, Caregiver, make_caregiver
from caregiver_mj.children.behaviour import Behaviour
from caregiver_mj.children.child_group import CHILDREN
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS, RandomStream
from caregiver_mj.grid.world import BareTablesWorld, GridWorld, run_episodes
from caregiver_mj.interventions.verb import DO_NOTHING, Intervention, Interventions
from caregiver_mj.plans.generator import generate
from caregiver_mj.plans.hazards import NOTHING, State

EPSILONS = (1.0, 0.75, 0.5, 0.25, 0.05)
PAPER = FloorPlan.load("paper")


# Unassisted novices in the house `paper`: an independent simulation of 4,000 episodes a row.
#        epsilon: damage, timesteps to threshold, cells visited, toys reached
ALONE = {
    1.00: (88.6, 43.2, 9.3, 0.5),
    0.75: (69.2, 55.3, 16.0, 5.3),
    0.50: (47.4, 78.3, 24.3, 11.9),
    0.25: (24.3, 136.4, 28.7, 19.2),
    0.05: (4.9, 198.8, 28.9, 25.1),
}
PUBLISHED_EPISODES = 4000
ROUNDING = 0.05  # the published figures have one decimal


@pytest.mark.parametrize("epsilon", EPSILONS)
def test_unassisted_novices_come_to_the_published_figures(epsilon):
    totals = run_episodes(PAPER, epsilon, None, range(500)).totals()
    names = ("damage", "timesteps_to_threshold", "cells_visited", "toys_reached")
    for name, published in zip(names, ALONE[epsilon], strict=True):
        figure = totals[name]
        error = figure.std(ddof=1) * np.sqrt(1 / len(figure) + 1 / PUBLISHED_EPISODES)
        assert figure.mean() == pytest.approx(published, abs=3 * error + ROUNDING), name


# Damage left at most, timesteps to threshold at least: with the caregiver of the paper, 2,000 episodes a row.
ASSISTED = {1.0: (0.32, 105), 0.5: (0.29, 170), 0.05: (0.38, 198)}


@pytest.mark.parametrize("epsilon", ASSISTED)
def test_the_caregiver_prevents_most_of_the_damage_and_leaves_the_toys(epsilon):
    alone = run_episodes(PAPER, epsilon, None, range(400)).totals()
    assisted = run_episodes(PAPER, epsilon, make_caregiver("paper", PAPER), range(400)).totals()
    left, timesteps = ASSISTED[epsilon]
    assert assisted["damage"].mean() <= left * alone["damage"].mean()
    assert assisted["timesteps_to_threshold"].mean() >= timesteps
    if epsilon < 1:  # random motion reaches half a toy an episode
        assert assisted["toys_reached"].mean() >= 0.97 * alone["toys_reached"].mean()
    assert (assisted["interventions_done"] <= assisted["interventions"]).all()


class PlainWorld:
    """One episode at a time, in sets and dictionaries of cells: slow, and obvious.

    It knows the rules of the paper and of `caregiver_mj.grid`, and shares nothing with them but the text of the
    plan, the novice's draws and the order north, east, south, west.
    """

    def __init__(self, text, assisted):
        self.at = {(r, c): kind for r, row in enumerate(text.splitlines()) for c, kind in enumerate(row)}
        self.things = [cell for cell in sorted(self.at) if self.at[cell] == "o"]
        self.at |= dict.fromkeys(self.things, ".")
        self.assisted = assisted
        self.free = [cell for cell in sorted(self.at) if self.at[cell] == "."]
        self.stairwells = [cell for cell in sorted(self.at) if self.at[cell] == "S"]
        self.tables = [cell for cell in sorted(self.at) if self.at[cell] in "CT"]
        self.bins = [cell for cell in sorted(self.at) if self.at[cell] == "B"]
        self.walkable = {*self.free, *self.stairwells}
        self.search = functools.cache(self._search)
        self.routes = functools.cache(self._routes)

    def _search(self, starts, *closed):
        """The caregiver's moves to the nearest of some cells, from all cells, round closed ones."""
        return distances(self.walkable - {*closed}, *starts - {*closed})

    @functools.cache  # noqa: B019 (a few worlds, in tests)
    def bump(self, thing):
        """The novice's moves until it bumps into a thing, from all free cells."""
        return distances({*self.free}, thing)

    def layers(self, start, goal):
        """Where the novice can be after 0, 1, 2, ... moves of a shortest path."""
        left, layer = self.bump(goal), {start}
        while layer:
            yield layer
            layer = {n for cell in layer for n in neighbours(cell) if left.get(n, 999) == left[cell] - 1 > 0}

    def _routes(self, start):
        """To how many bins a shortest path of the novice leads over each cell."""
        return {cell: sum(any(cell in y for y in self.layers(start, b)) for b in self.bins) for cell in self.walkable}

    @functools.cached_property
    def traps(self):
        """Where the novice can shut the caregiver in without a cell that it need not pass."""
        traps = set()
        for novice in self.free:
            needed = {min(layer) for goal in self.bins for layer in self.layers(novice, goal) if len(layer) == 1}
            for cell in self.walkable - {novice}:
                if set(self.search(frozenset([cell]), novice)) <= needed:
                    traps.add(cell)
        return traps

    def begin(self, stream, epsilon):
        self.stream, self.time, self.epsilon = stream, 0, epsilon
        starts = [cell for cell in self.free if cell not in self.things]
        self.novice = starts[int(stream.start[0] * len(starts))]
        others = [cell for cell in starts if cell != self.novice]
        self.caregiver = others[int(stream.start[1] * len(others))] if others else self.stairwells[-1]
        self.goal = self.bins[int(stream.start[2] * len(self.bins))]
        self.candles = [cell for cell in self.tables if self.at[cell] == "C"]  # each candle's table
        self.held = self.destination = self.intended = None
        self.lying = list(self.things)  # what is gone is None
        self.seen = {self.novice}
        self.over = False
        self.harm = dict.fromkeys("SCTo", 0)
        self.lasted, self.toys, self.begun, self.done = len(stream.steps), 0, 0, 0
        self.blocked, self.series, self.longest, self.until_stop = {"S": 0, ".": 0}, 0, 0, 0

    def step(self):  # noqa: C901, PLR0912 one timestep, written out
        chance, which, toy = self.stream.steps[self.time]
        self.time += 1
        if chance < self.epsilon:
            there = neighbours(self.novice)[int(which * 4)]
        else:
            left = self.bump(self.goal)
            good = [n for n in neighbours(self.novice) if left.get(n, 999) < left[self.novice]]
            there = good[int(which * len(good))]
        kind = self.at[there]
        if not (self.assisted and there == self.caregiver):
            self.series = 0
        if self.assisted and there == self.caregiver:
            self.blocked[kind] += 1
            self.series += 1
            self.longest = max(self.longest, self.series)
        elif kind == ".":
            self.novice = there
            if there in self.lying:
                self.lying[self.lying.index(there)] = None
                self.harm["o"] += 5
        elif kind == "S":
            self.harm["S"] += 5
        elif kind in "CT" and there in self.candles:
            self.harm["C"] += 4
        elif kind in "CT":
            self.harm["T"] += 1
        elif there == self.goal:
            self.toys += 1
            self.goal = self.bins[int(toy * len(self.bins))]
        if not self.over:
            self.seen.add(self.novice)
            self.until_stop = sum(self.harm.values())
            if self.until_stop > 15:
                self.over, self.lasted = True, self.time
        if self.assisted:
            for _ in range(3):
                self.act()

    def decide(self):
        """The greatest damage over distance; the sum that normalises the inverse distances is common to all."""
        bare = [self.bump(t)[self.novice] for t in self.tables if t not in self.candles]
        dangers = [(Fraction(5, self.bump(s)[self.novice]), ("S", i)) for i, s in enumerate(self.stairwells)]
        for i, table in enumerate(self.candles):
            moves = self.bump(table)[self.novice]
            if moves < max(bare):
                dangers.append((Fraction(4, moves), ("C", i)))
        dangers += [(Fraction(5, self.bump(o)[self.novice]), ("o", i)) for i, o in enumerate(self.lying) if o]
        return max(dangers, key=lambda danger: danger[0])[1] if dangers else None

    def act(self):  # noqa: C901 one action, written out
        target = ("C", self.held) if self.held is not None else self.decide()
        if target != self.intended:
            self.intended, self.counted = target, False
            self.begun += target is not None
        if target is None:
            refuge = self.least(lambda cell: self.routes(self.novice)[cell])
            self.walk(refuge)
            return
        kind, index = target
        if kind == "S":
            stand = safe = frozenset([self.stairwells[index]])
        elif kind == "o":
            stand = frozenset([self.lying[index]])
            safe = stand - self.traps
        else:
            table = self.destination if self.held is not None else self.candles[index]
            stand = frozenset(cell for cell in neighbours(table) if self.at[cell] == ".")
            safe = stand - self.traps
        if self.caregiver not in self.search(safe, self.novice):
            safe = stand
        moves = self.search(safe, self.novice).get(self.caregiver)
        if moves is None:
            self.make_room(stand)
        elif moves > 0:
            self.walk(safe)
        elif kind == "o":
            self.lying[index] = None
            self.done += 1
        elif kind == "C" and self.held is None:
            bare = [t for t in self.tables if t not in self.candles]
            self.destination = max(bare, key=lambda t: self.bump(t)[self.novice])
            self.held, self.candles[index] = index, None
        elif kind == "C":
            self.candles[index], self.held, self.intended = table, None, None
            self.done += 1
        if kind == "S" and self.caregiver in stand and not self.counted:
            self.done, self.counted = self.done + 1, True

    def make_room(self, stand):
        """The novice stands in the only way: as near to it as can be with a free cell between them."""
        beside = {self.novice, *neighbours(self.novice)} & self.walkable
        away = {}  # from each cell that is not beside it: moves to where to wait, past no cell that is
        for cell in self.walkable - beside:
            part = self.search(frozenset([cell]), *beside)
            nearest = min(self.search(stand)[there] for there in part)
            away[cell] = min(moves for there, moves in part.items() if self.search(stand)[there] == nearest)
        waiting = frozenset(cell for cell, moves in away.items() if moves == 0)
        out = self.search(waiting, self.novice)  # for one that is beside it
        options = [self.caregiver, *(cell for cell in neighbours(self.caregiver) if cell in self.walkable)]
        self.caregiver = min(options, key=lambda cell: (cell in beside, away.get(cell, out.get(cell, 999))))

    def least(self, cost):
        """The cells of least cost among those that the caregiver can reach."""
        part = self.search(frozenset([self.caregiver]), self.novice)
        lowest = min(cost(cell) for cell in part)
        return frozenset(cell for cell in part if cost(cell) == lowest)

    def walk(self, goals):
        moves = self.search(goals, self.novice)
        if moves[self.caregiver] > 0:
            self.caregiver = min(neighbours(self.caregiver), key=lambda cell: moves.get(cell, 999))

    def state(self):
        gone = tuple(thing is None for thing in self.lying)
        return self.novice, self.goal, self.caregiver, self.held, tuple(self.candles), gone

    def figures(self):
        return {
            "damage": sum(self.harm.values()),
            "damage_stairwell": self.harm["S"],
            "damage_candle": self.harm["C"],
            "damage_table": self.harm["T"],
            "damage_battery": self.harm["o"],
            "damage_until_stop": self.until_stop,
            "stopped": int(self.over),
            "timesteps_to_threshold": self.lasted,
            "cells_visited": len(self.seen),
            "toys_reached": self.toys,
            "moves_blocked": sum(self.blocked.values()),
            "moves_blocked_stairwell": self.blocked["S"],
            "moves_blocked_free": self.blocked["."],
            "longest_blocked": self.longest,
            "interventions": self.begun,
            "interventions_done": self.done,
        }


def batched_state(world, i):
    plan = world.plan
    held = int(world.holding[i])
    return (
        plan.free_cells[world.child_cell[i, 0]],
        plan.bins[world.goal[i, 0]],
        plan.caregiver_cells[world.caregiver_cell[i]],
        None if held == NOTHING else held,
        tuple(None if t == NOTHING else plan.tables[t] for t in world.candle_table[i]),
        tuple((plan.hazards.split(world.state[i])[2] == State.GONE).tolist()),
    )


# One for all episodes in a house: what it finds out about the house takes longest.
plain_world = functools.lru_cache(maxsize=1)(PlainWorld)


def compare_with_the_plain_world(text, epsilon, assisted, seeds, timesteps):
    plan = FloorPlan.parse(text)
    batch = streams(seeds, timesteps)
    world = GridWorld(plan, epsilon, make_caregiver("paper", plan) if assisted else None)
    world.reset(batch)
    states = []
    for _ in range(timesteps):
        states.append([batched_state(world, i) for i in range(len(batch))])
        world.step()
    totals = world.ledger.totals()
    plain = plain_world(text, assisted)
    for i, (stream,) in enumerate(batch):
        plain.begin(stream, epsilon)
        for timestep in range(timesteps):
            if not assisted:
                plain.caregiver = states[timestep][i][2]  # stands there, and is nowhere
            assert states[timestep][i] == plain.state(), f"episode {i} before timestep {timestep}"
            plain.step()
        figures = plain.figures()
        assert {name: totals[name][i] for name in figures} == figures


@settings(max_examples=15, deadline=None)
@given(
    plan_texts(largest=12) | plans_with_things(largest=12),
    st.sampled_from(EPSILONS),
    st.lists(st.integers(0, 10**6), min_size=1, max_size=4),
)
def test_with_a_caregiver_it_is_the_plain_world_step_by_step(text, epsilon, seeds):
    compare_with_the_plain_world(text, epsilon, True, seeds, timesteps=60)


@settings(max_examples=15, deadline=None)
@given(
    plan_texts() | plans_with_things(largest=20),
    st.sampled_from(EPSILONS),
    st.lists(st.integers(0, 10**6), min_size=1, max_size=4),
)
def test_without_a_caregiver_it_is_the_plain_world_step_by_step(text, epsilon, seeds):
    compare_with_the_plain_world(text, epsilon, False, seeds, timesteps=100)


@pytest.mark.parametrize("epsilon", [1.0, 0.25])
def test_in_the_paper_house_it_is_the_plain_world_for_whole_episodes(epsilon):
    compare_with_the_plain_world("\n".join(PAPER.rows), epsilon, True, range(2), EPISODE_TIMESTEPS)


@settings(max_examples=12, deadline=None)
@given(
    plan_texts(largest=12),
    st.sampled_from(sorted(CHILDREN)),
    st.sampled_from(EPSILONS),
    st.sampled_from(sorted(set(CAREGIVERS) - {"none"})),
)
def test_nothing_impossible_happens(text, child, epsilon, name):
    plan = FloorPlan.parse(text)
    world = begun(GridWorld(plan, f"{child}:{epsilon}", make_caregiver(name, plan)), range(6))
    between = plan.graph.distances_from(range(len(plan.caregiver_cells)))
    worlds = np.arange(6)
    for _ in range(60):
        novice, caregiver = world.child_cell[:, 0], world.caregiver_cell
        world.step()
        assert (between[novice, world.child_cell[:, 0]] <= 1).all()
        assert (between[caregiver, world.caregiver_cell] <= 3).all()
        assert (world.child_cell[:, 0] != world.caregiver_cell).all()
        # Every candle is on a table of its own, or is the one in the hand.
        for i in worlds:
            placed = world.candle_table[i][world.candle_table[i] != NOTHING]
            assert len(set(placed)) == len(placed) == len(plan.candle_tables) - (world.holding[i] != NOTHING)
    totals = world.ledger.totals()
    assert (totals["damage"] == sum(totals[f"damage_{kind}"] for kind in ("stairwell", "candle", "table"))).all()
    assert (totals["interventions_done"] <= totals["interventions"]).all()
    assert (totals["moves_blocked"] <= 60).all()


class Fixed(Caregiver):
    """Wants the same candidate always."""

    target = 0

    def choose(self, percept):
        return np.full(len(percept.child_cell), self.target)


def place(world, novice, caregiver):
    """Puts novice and caregiver on cells, as if the novice had stood still."""
    world.child_cell[:] = world.previous_cell[:] = world.plan.cell_index[novice]
    world.caregiver_cell[:] = world.plan.cell_index[caregiver]


def moving(world, action, timesteps=1):
    """Random streams in which the novice makes one move, always."""
    world.reset([[RandomStream(np.zeros(3), np.tile([0.0, (action + 0.5) / 4, 0.0], (timesteps, 1)))]])


NORTH = 0


class Waits(Fixed):
    waits = True

    def decide(self, percept):
        return Interventions.of([Intervention(DO_NOTHING, destination=self.plan.cell_index[1, 3])])


def test_it_waits_in_the_cell_that_it_was_told_and_that_is_no_intervention():
    plan = FloorPlan.parse("#########\n#.......#\n##C#B#T##\n#########")
    world = GridWorld(plan, 1.0, Waits(plan), caregiver_actions=1)
    moving(world, NORTH, 3)
    place(world, (1, 7), (1, 1))
    for column in (2, 3, 3):
        world.step()
        assert plan.caregiver_cells[world.caregiver_cell[0]] == (1, column)
    assert world.ledger.totals()["interventions"].tolist() == [0]
    world.caregiver.waits = False
    with pytest.raises(CaregiverError, match="destination of 'nothing' must be -1 to -1, got"):
        world.act_caregiver(world.caregiver)


@pytest.mark.parametrize(
    ("actions", "counts"), [(3, [3, 3, 3]), (5 / 3, [1, 2, 2, 1, 2, 2]), (2.5, [2, 3, 2, 3]), (16 / 3, [5, 5, 6])]
)
def test_a_share_of_an_action_that_is_left_counts_for_the_next_timestep(actions, counts):
    """A caregiver on a long way walks a cell in each action; it is told how many are left before the next moves."""
    plan = FloorPlan.parse("\n".join(["#" * 40, f"#{'.' * 38}#", f"##C#B#T{'#' * 33}", "#" * 40]))
    told = []

    class Told(Waits):
        def decide(self, percept):
            told.append(percept.time_left[0])
            return Interventions.of([Intervention(DO_NOTHING, destination=self.plan.cell_index[1, 38])])

    world = GridWorld(plan, 1.0, Told(plan), caregiver_actions=actions)
    moving(world, NORTH, len(counts))
    place(world, (1, 1), (1, 3))
    cells = [3]
    for _ in counts:
        world.step()
        cells.append(plan.caregiver_cells[world.caregiver_cell[0]][1])
    assert np.diff(cells).tolist() == counts
    np.testing.assert_allclose(told, [left / actions for count in counts for left in range(count, 0, -1)])


@settings(max_examples=15, deadline=None)
@given(
    plan_texts(largest=12),
    st.sampled_from(["1,0.25", "0.5,0.5", "1,1,0"]),
    st.sampled_from(["none", "nearest", "paper"]),
)
def test_children_are_never_in_one_cell_nor_in_the_caregivers(text, family, name):
    plan = FloorPlan.parse(text)
    children = family.count(",") + 1
    if len(plan.free_cells) <= children:
        return
    world = begun(GridWorld(plan, family, make_caregiver(name, plan)), range(6), children=children)
    for _ in range(40):
        world.step()
        cells = np.concatenate([world.child_cell, world.caregiver_cell[:, None]], axis=1)
        if name == "none":
            cells = world.child_cell
        assert all(len(set(row)) == len(row) for row in cells.tolist())
    totals = world.ledger.totals()
    for i in range(6):
        outcome = world.ledger.outcomes()[i]
        assert sum(outcome["damage_by_child"]) == outcome["damage"] == totals["damage"][i]
        assert sum(outcome["toys_by_child"]) == outcome["toys_reached"]


def test_a_house_whose_paths_would_not_fit_into_memory_is_refused_before_they_are_made(monkeypatch):
    monkeypatch.setattr("caregiver_mj.plans.routes.yielding", None)  # the first thing that is made
    plan = generate(1, (100, 100))
    with pytest.raises(CaregiverError, match=r"too large .* 7851 free cells, 199 tables .* 52\.6 GB, more than 6\.0"):
        GridWorld(plan, 0.5, make_caregiver("nearest", plan))


@pytest.mark.parametrize(("epsilon", "left"), [(1.0, 0.25), (0.05, 0.15)])
def test_bare_tables_only_in_the_paper_house(epsilon, left):
    """The figures are an independent simulation's, with two decimals."""
    alone, bare = run_episodes(PAPER, epsilon, None, range(500)), BareTablesWorld(PAPER, epsilon).run(streams(500))
    assert bare.damage.mean() / alone.damage.mean() == pytest.approx(left, abs=0.015)


@pytest.mark.parametrize("child", CHILDREN)
def test_with_bare_tables_only_there_are_bumps_into_these_and_nothing_else(child):
    totals = BareTablesWorld(PAPER, f"{child}:0.75").run(streams(20)).totals()
    assert (totals["damage"] == totals["damage_table"]).all()
    if child == "novice":  # no bump takes it anywhere else, so it goes the same ways
        alone = run_episodes(PAPER, 0.75, None, range(20)).totals()
        assert (totals["damage"] == alone["damage_table"] + alone["damage_candle"] / 4).all()
        assert (totals["moves_blocked"] == alone["damage_stairwell"] / 5).all()
        assert (totals["toys_reached"] == alone["toys_reached"]).all()


class Statue(Behaviour):
    """Stays where it is."""

    def act(self, sight, draws):
        return np.full(len(sight.cell), NOTHING)


# Something else to the west of every cell, which is what an index of -1 would mean.
@pytest.mark.parametrize("west", "S.CTB#")
def test_a_child_that_stays_comes_to_no_harm_and_to_no_toy(west):
    plan = FloorPlan.parse(f"#######\n##{west}..##\n##B..T#\n#C....#\n#######")
    world = GridWorld(plan, 1.0, make_caregiver("paper", plan))
    world.behaviours = [Statue(plan, 1.0)]
    world.reset(streams(1, 30))
    world.child_cell[:] = plan.cell_index[(1, 3)]
    world.caregiver_cell[:] = plan.cell_index[(3, 4)]
    world.goal[:] = 0
    for _ in range(30):
        world.step()
        assert world.child_cell.tolist() == [[plan.cell_index[(1, 3)]]]
        assert world.previous_action.tolist() == [[NOTHING]]
        assert world.bumped.tolist() == [[False]]
    totals = world.ledger.totals()
    assert [totals[name].tolist() for name in ("damage", "toys_reached", "moves_blocked")] == [[0], [0], [0]]


# Every caregiver with the novice, and every child with the rule.
@pytest.mark.parametrize(
    ("child", "name"),
    [("novice", name) for name in ("none", "random", "paper", "childproof", "learned", "attentive:.4")]
    + [(child, "paper") for child in CHILDREN if child != "novice"],
)
def test_an_episode_with_any_child_is_the_same_alone_and_among_others(child, name):
    """With a novice beside it, for what a child remembers must be its own."""
    plan = FloorPlan.load("paper")
    caregiver = make_caregiver(name, plan)
    world = GridWorld(plan, f"{child}:0.6,0.3", caregiver)
    families = streams((7, 3, 11), timesteps=50, children=2)
    together = world.run(families)
    alone = world.run(families[:1])
    others = world.run(families[1:])
    assert alone.outcomes() + others.outcomes() == together.outcomes()

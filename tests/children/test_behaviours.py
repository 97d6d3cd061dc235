"""Children other than the novice: their ways by hand in tiny houses, and what holds for every child."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_plans import plan_texts
from walks import distances
from worlds import streams

from caregiver_mj.children.behaviour import ChildPercept
from caregiver_mj.children.child_group import CHILDREN, ChildGroup
from caregiver_mj.children.novice import Novice
from caregiver_mj.children.random_stream import pick
from caregiver_mj.children.variants import SWITCH, Adversary, Avoider, Drifter, Explorer, Seeker, Waverer
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.cell_graph import ACTIONS, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

NORTH, EAST, SOUTH, WEST = range(4)
LAST = 0.999  # a draw that takes the last of several equally good moves, in the order of the actions


def see(cell, goal=0, caregiver_cell=NOTHING):
    """What children see; single values hold for all of them."""
    cell, goal, caregiver_cell = np.broadcast_arrays(np.atleast_1d(cell), goal, caregiver_cell)
    return ChildPercept(cell, goal, caregiver_cell, np.zeros(len(cell), bool))


def draws(*rows):
    return np.array(rows, float)


def walk(child, start, goal, draw, caregiver=NOTHING, timesteps=100):
    """Walks one child until it reaches a bin. Returns its cells before every move, and what it bumped into."""
    plan = child.plan
    next_cell, target, _ = plan.graph.moves
    child.reset(1)
    cell, cells, bumps = plan.cell_index[start], [], []
    for _ in range(timesteps):
        cells.append(plan.free_cells[cell])
        action = int(child.act(see(cell, goal, caregiver), draws((0.5, draw, 0.5)))[0])
        there = tuple(np.add(cells[-1], ACTIONS[action]).tolist())
        if there == plan.bins[goal]:
            return cells, bumps
        if target[cell, action] != Target.FREE:
            bumps.append(there)
        cell = int(next_cell[cell, action])
    raise AssertionError("it has not found its bin")


# From the upper left to the bin in the upper right one must go round the wall between them.
WALLED = FloorPlan.parse("#######\n#..#.B#\n#..#..#\n#.....#\n#######")


def test_the_explorer_remembers_to_the_end_of_the_episode_and_no_longer():
    explorer = Explorer(WALLED, 0.0)
    here = WALLED.cell_index[(1, 2)]
    first = [int(explorer.act(see(here), draws((0, LAST, 0)))[0]) for _ in range(3)]
    assert first == [EAST, SOUTH, SOUTH]
    explorer.reset(1)
    assert explorer.act(see(here), draws((0, LAST, 0))).tolist() == [EAST]


def test_stairs_in_which_the_caregiver_stands_teach_the_explorer_nothing():
    plan = FloorPlan.parse("#######\n#..S.B#\n#.....#\n#######")
    here, landing = plan.cell_index[(1, 2)], plan.cell_index[(1, 3)]
    for caregiver, second in ((landing, EAST), (NOTHING, SOUTH)):
        explorer = Explorer(plan, 0.0)
        sight = see(here, 0, caregiver)
        assert [int(explorer.act(sight, draws((0, LAST, 0)))[0]) for _ in range(2)] == [EAST, second]


@settings(max_examples=25, deadline=None)
@given(plan_texts(largest=12), st.integers(0, 2**31 - 1))
def test_the_explorer_finds_every_bin_and_bumps_into_nothing_twice(text, seed):
    plan = FloorPlan.parse(text)
    random = np.random.default_rng(seed)
    explorer = Explorer(plan, 0.0)
    start = plan.free_cells[int(random.integers(len(plan.free_cells)))]
    for goal in range(len(plan.bins)):
        _, bumps = walk(explorer, start, goal, float(random.random()), timesteps=plan.symbols.size**2)
        assert len(set(bumps)) == len(bumps)


# Two equally short ways round a pillar, and one bin that only a passage leads to.
PILLAR = FloorPlan.parse("######\n#...##\n#.#.B#\n#...##\n#.####\n#B####\n######")


@pytest.mark.parametrize("draw", [0.0, 0.4, LAST])
def test_the_avoider_goes_round_the_caregiver_where_it_can(draw):
    here = PILLAR.cell_index[(2, 1)]
    avoider = Avoider(PILLAR, 0.0)
    for caregiver, action in (((1, 2), SOUTH), ((3, 2), NORTH)):
        sight = see(here, 0, PILLAR.cell_index[caregiver])
        assert avoider.act(sight, draws((0, draw, 0))).tolist() == [action]
    free = see(here, 0, NOTHING)
    assert avoider.act(free, draws((0, draw, 0))).tolist() == [NORTH if draw < 0.5 else SOUTH]


def open_ways(plan, closed):
    """Cells from which a child gets to each bin round a closed cell: a plain search."""
    cells = {*plan.free_cells} - {closed}
    return [distances(cells, *(cell for cell in plan.free_neighbours(goal) if cell != closed)) for goal in plan.bins]


@settings(max_examples=30, deadline=None)
@given(plan_texts(largest=12), st.integers(0, 2**31 - 1))
def test_the_avoider_steps_into_the_caregiver_only_where_no_other_way_is_open(text, seed):
    plan = FloorPlan.parse(text)
    random, avoider = np.random.default_rng(seed), Avoider(plan, 0.0)
    next_cell, target, index = plan.graph.moves
    caregiver = int(random.integers(len(plan.caregiver_cells)))
    closed = plan.caregiver_cells[caregiver]
    ways = open_ways(plan, closed)
    for cell in range(len(plan.free_cells)):
        if cell == caregiver:
            continue
        for goal in range(len(plan.bins)):
            action = int(avoider.act(see(cell, goal, caregiver), draws((0, random.random(), 0)))[0])
            reaches = target[cell, action] == Target.BIN and index[cell, action] == goal
            assert reaches or target[cell, action] == Target.FREE
            if plan.free_cells[cell] in ways[goal]:
                assert reaches or plan.free_cells[next_cell[cell, action]] in ways[goal]


CORRIDOR = FloorPlan.parse("########\n#.....B#\n########")


class Careless(Seeker):
    """One that has become careless."""

    def epsilons(self, batch):
        return np.ones(batch)


def test_the_seeker_goes_to_the_caregiver_or_at_random_by_hand():
    seeker, middle, west = Seeker(CORRIDOR, 0.3), 2, 0
    assert seeker.act(see(middle, 0, west), draws((0.3, 0.5, 0))).tolist() == [WEST]
    assert seeker.act(see(middle, 0, west), draws((0.29, 0.5, 0))).tolist() == [SOUTH]
    assert Careless(CORRIDOR, 0.3).act(see(middle, 0, west), draws((0.3, 0.5, 0))).tolist() == [SOUTH]
    assert seeker.act(see(1, 0, west), draws((0.3, 0.5, 0))).tolist() == [WEST]  # into it
    assert seeker.act(see(middle, 0, NOTHING), draws((0.3, 0.5, 0))).tolist() == [EAST]  # to its bin


@settings(max_examples=15, deadline=None)
@given(plan_texts(largest=12), st.integers(0, 2**31 - 1))
def test_without_chance_the_seeker_is_the_adversary_and_with_nothing_else_all_are_the_novice(text, seed):
    plan, random = FloorPlan.parse(text), np.random.default_rng(seed)
    counts = (len(plan.free_cells), len(plan.bins), len(plan.caregiver_cells))
    sight = see(*(pick(random.random(20), count) for count in counts))
    chance = random.random((20, 3))
    assert (Seeker(plan, 0.0).act(sight, chance) == Adversary(plan, 0.0).act(sight, chance)).all()
    for kind in (Seeker, Avoider, Explorer):
        child = kind(plan, 1.0)
        child.reset(20)
        assert (child.act(sight, chance) == Novice(plan, 1.0).act(sight, chance)).all()


@pytest.mark.parametrize("name", CHILDREN)
@settings(max_examples=5, deadline=None)
@given(plan_texts(largest=12), st.sampled_from([0.0, 0.5, 1.0]), st.integers(0, 2**31 - 1))
def test_a_child_moves_by_its_own_draws_whoever_else_there_is(name, text, epsilon, seed):
    """Twice the same in a batch, and the same alone; and only moves that there are."""
    plan, random = FloorPlan.parse(text), np.random.default_rng(seed)
    next_cell, _, _ = plan.graph.moves
    batch, timesteps = 4, 40
    chance = random.random((timesteps, batch, 3))
    start = pick(random.random(batch), len(plan.free_cells))
    goal = pick(random.random((timesteps, batch)), len(plan.bins))
    caregiver = pick(random.random((timesteps, batch)), len(plan.caregiver_cells))

    def moves(which):
        child = ChildGroup.of(f"{name}:{epsilon}").children[0].make(plan)
        child.reset(len(which))
        cell, taken = start[which], []
        for t in range(timesteps):
            action = np.asarray(child.act(see(cell, goal[t, which], caregiver[t, which]), chance[t, which]))
            assert action.shape == (len(which),)
            assert np.issubdtype(action.dtype, np.integer)
            assert ((action >= NOTHING) & (action < len(ACTIONS))).all()
            taken.append(action)
            cell = np.where(action == NOTHING, cell, next_cell[cell, action])
        return np.array(taken).T.tolist()

    together = moves(np.arange(batch))
    assert moves(np.arange(batch)) == together
    assert [moves(np.array([i]))[0] for i in range(batch)] == together


#    0123456
WINDING = FloorPlan.parse("#######\n#..#..#\n#.B#.S#\n#.....#\n#######", "winding")


def way(child, caregiver, plan=WINDING):
    goal = NOTHING if caregiver is None else plan.cell_index[caregiver]
    cell = np.array([plan.cell_index[child]])
    sight = ChildPercept(cell, np.zeros(1, int), np.array([goal]), np.zeros(1, bool))
    return int(Adversary(plan, 0.5).act(sight, np.zeros((1, 3)))[0])


def test_it_goes_into_a_landing_only_if_the_caregiver_is_there():
    assert way((1, 5), (2, 5)) == SOUTH
    assert way((3, 5), (2, 5)) == NORTH
    # Through the landing it would be two moves.
    assert way((1, 5), (3, 5)) == WEST


PLAN = FloorPlan.load("paper")
SIGHT = ChildPercept(np.zeros(2, int), np.zeros(2, int), np.full(2, NOTHING), np.zeros(2, bool))


def course(child, timesteps, third=0.0):
    """The epsilons before each of so many moves, (timesteps, 2)."""
    child.reset(2)
    found = []
    for timestep in range(timesteps):
        found.append(child.epsilons(2))
        draw = third[timestep] if np.ndim(third) else third
        child.act(SIGHT, np.array([[0.5, 0.5, draw], [0.5, 0.5, 0.0]]))
    return np.array(found)


@pytest.mark.parametrize(("epsilon", "low", "high"), [(0.4, 0.05, 0.75), (0.1, 0.0, 0.2), (0.9, 0.8, 1.0), (1.0, 1, 1)])
def test_the_drifter_goes_evenly_from_one_end_to_the_other(epsilon, low, high):
    found = course(Drifter(PLAN, epsilon), 250)
    assert found[0] == pytest.approx(low)
    assert found[199:] == pytest.approx(high)
    assert np.diff(found[:200], axis=0) == pytest.approx((high - low) / 199)
    assert found[:200].mean() == pytest.approx(epsilon)


def test_the_waverer_walks_by_its_own_draws_and_turns_at_the_ends():
    # The fraction of 2^20 draws: 0 is up, 0.75 is down.
    down = 0.75 / 2**20
    found = course(Waverer(PLAN, 0.05), 4, [down, down, 0.0, 0.0])
    assert found[:, 0] == pytest.approx([0.05, 0.02, 0.01, 0.04])
    assert found[:, 1] == pytest.approx([0.05, 0.08, 0.11, 0.14])
    assert course(Waverer(PLAN, 0.98), 3)[:, 0] == pytest.approx([0.98, 0.99, 0.98])


def test_the_switcher_wants_one_half_of_the_bins_and_then_the_other():
    world = GridWorld(PLAN, "switcher:0.25", None)
    goals = []
    families = streams(20)
    world.reset(families)
    for _ in range(200):
        goals.append(world.goal.copy())
        world.step()
    half = (len(PLAN.bins) + 1) // 2
    before, after = np.array(goals[:SWITCH]), np.array(goals[SWITCH + 1 :])
    assert set(np.unique(before)) == set(range(half))
    assert set(np.unique(after)) == set(range(half, len(PLAN.bins)))

"""The toddler's walking, held against the figures that were measured on toddlers."""

import itertools

import numpy as np
import pytest

from caregiver_mj.children import toddler
from caregiver_mj.children.behaviour import ChildPercept
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.children.toddler import Toddler, bout_steps, mean_bout
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

ROOM = "#########\n#.......#\n#.......#\n#...B...#\n#.......#\n#.......#\n#########"
GRID = (np.arange(1_000_000) + 0.5) / 1_000_000


def walks(epsilon, cell_size, batch=200, timesteps=400):
    """What toddlers do in a room: actions (timesteps, batch), and what these lead to, likewise."""
    plan = FloorPlan.parse(ROOM, cell_size=cell_size)
    next_cell, target, _ = plan.graph.moves
    child, random = Toddler(plan, epsilon), np.random.default_rng(7)
    child.reset(batch)
    cell = random.integers(len(plan.free_cells), size=batch)
    nobody, no = np.full(batch, NOTHING), np.zeros(batch, bool)
    actions, targets = [], []
    for _ in range(timesteps):
        action = child.act(ChildPercept(cell, np.zeros(batch, int), nobody, no), random.random((batch, 3)))
        actions.append(action)
        targets.append(np.where(action == NOTHING, Target.FREE, target[cell, action]))
        cell = np.where(action == NOTHING, cell, next_cell[cell, action])
    return np.array(actions), np.array(targets)


def test_steps_of_a_bout():
    steps = bout_steps(GRID)
    assert (steps.min(), np.mean(steps <= 3)) == (1, pytest.approx(0.5, abs=1e-5))
    assert steps.mean() == pytest.approx(mean_bout(), rel=1e-3)
    # That of the 19-month-olds, of whose bouts 41 % have three steps or fewer: 0.59 go on after three.
    steps = bout_steps(GRID)
    for length in (3, 5, 8, 12):
        assert np.mean(steps[steps > length] > length + 3) == pytest.approx(0.59, abs=0.002)
    # The shortest and the longest bout that can be drawn.
    assert bout_steps(np.array([0.0, np.nextafter(1.0, 0.0)])).tolist() == [1, 3 + 205]


@pytest.mark.parametrize("cell_size", [0.6, 0.75, 1.0])
def test_it_walks_as_far_in_an_hour_as_was_measured(cell_size):
    actions, _ = walks(1.0, cell_size)
    share = np.mean(actions != NOTHING)
    assert share == pytest.approx(toddler.SHARE_OF_TIME_WALKING, abs=0.02)
    metres = share * 3600 * 1.6 / 3.6  # at 1.6 km/h whenever it walks
    assert metres == pytest.approx(704, rel=0.04)
    assert metres / toddler.STEP_LENGTH == pytest.approx(2368, rel=0.04)


@pytest.mark.parametrize("house", ["paper", "apartment"])
def test_in_a_house_with_toys_it_walks_as_far(house):
    world = GridWorld(FloorPlan.load(house), "toddler:0.75", None)
    world.reset([RandomStream.draw_group(seed, 1) for seed in range(100)])
    walking = []
    while not world.over:
        world.move_children()
        walking.append(np.mean(world.previous_action != NOTHING))
    assert world.ledger.toys.mean() > 1
    assert np.mean(walking) == pytest.approx(toddler.SHARE_OF_TIME_WALKING, rel=0.05)


@pytest.mark.parametrize("cell_size", [0.3, 0.75])
def test_at_its_toy_a_bout_ends_and_it_stays_as_long_as_was_measured(cell_size):
    """The median stay is 9.8 s, here of a child that walks to the same bin again and again."""
    actions, targets = walks(0.0, cell_size, timesteps=1000)
    stays = []
    for moves, found in zip(actions.T, targets.T, strict=True):
        walking = np.flatnonzero(moves != NOTHING)
        for now, then in itertools.pairwise(walking):
            if found[now] == Target.BIN:
                stays.append(then - now - 1)
    assert len(stays) > 1000
    assert min(stays) >= 1
    seconds = np.quantile(stays, [0.45, 0.55]) * cell_size * 3.6 / 1.6
    timestep = cell_size * 3.6 / 1.6
    assert seconds[0] - timestep <= 9.8 <= seconds[1] + timestep


def test_bouts_with_a_goal_lead_to_the_bin_and_into_nothing_else():
    _, targets = walks(0.0, 0.75)
    assert set(np.unique(targets)) == {Target.FREE, Target.BIN}
    _, targets = walks(1.0, 0.75)
    assert Target.WALL in targets


def test_a_bout_has_no_goal_with_probability_epsilon_by_hand():
    """It sets out if the first draw is low, for as many steps as the second says, and with a goal by the third."""
    plan = FloorPlan.parse("########\n#.....B#\n########", cell_size=toddler.STEP_LENGTH)

    class Careless(Toddler):
        def epsilons(self, batch):
            return np.ones(batch)

    def moves(*draws, kind=Toddler):
        child, taken = kind(plan, 0.3), []
        for one in draws:
            sight = ChildPercept(np.array([2]), np.array([0]), np.array([NOTHING]), np.array([False]))
            taken.append(int(child.act(sight, np.array([one]))[0]))
        return taken

    west, pause = (0.9, 0.8, 0.9), (0.99, 0.0, 0.0)
    assert moves(pause, (0.0, 0.4, 0.29), west, west, west, west) == [NOTHING, NOTHING, 3, 3, 3, NOTHING]
    with_a_goal = pause, (0.0, 0.4, 0.30), west, west, west, west
    assert moves(*with_a_goal) == [NOTHING, NOTHING, 1, 1, 1, NOTHING]
    assert moves(*with_a_goal, kind=Careless) == [NOTHING, NOTHING, 3, 3, 3, NOTHING]  # by what it is now

"""What episodes of tests are made of: random streams, and what a caregiver sees of one child."""

import functools

import numpy as np

from caregiver_mj.caregivers import Percept, make_caregiver
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS, RandomStream
from caregiver_mj.grid.world import GridWorld


def streams(seeds, timesteps=EPISODE_TIMESTEPS, children=1):
    """Random streams of episodes by their seeds, or of so many."""
    seeds = range(seeds) if isinstance(seeds, int) else seeds
    return [RandomStream.draw_group(np.random.RandomState(seed), children, timesteps) for seed in seeds]


def percept(plan, child, caregiver=0, candle_table=None, **more):
    """A percept of one world with one child, which has not moved: cells, the candles' tables, and further fields.

    Or of several, by a list of child cells: a single cell of the caregiver, and a list of tables, hold for all of them.
    """
    cells = np.reshape(child, (-1, 1))
    tables = np.reshape(plan.candle_tables if candle_table is None else candle_table, -1).astype(int)
    seen = {"child_cell": cells, "previous_cell": cells, "previous_action": np.full(cells.shape, -1)}
    seen |= {"caregiver_cell": np.full(len(cells), caregiver), "holding": np.full(len(cells), -1)}
    seen |= {"candle_table": np.tile(tables, (len(cells), 1))}
    return Percept(**{name: np.array(value) for name, value in (seen | more).items()})


def begun(world, seeds, timesteps=EPISODE_TIMESTEPS, children=1):
    """A grid at the start of episodes of some seeds, or of so many."""
    world.reset(streams(seeds, timesteps, children))
    return world


@functools.cache
def ran(name, plan, family, episodes=30):
    """The grid after some episodes with a caregiver, given by name."""
    world = GridWorld(plan, family, None if name == "none" else make_caregiver(name, plan, 0))
    world.run(streams(episodes))
    return world

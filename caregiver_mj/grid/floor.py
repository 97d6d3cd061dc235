"""The floor: the damage that blocking stairwells and relocating candles cannot prevent."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from caregiver_mj.children.family import Family
from caregiver_mj.children.tape import Tape
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.recording.ledger import Ledger


def run_floor(
    plan: FloorPlan,
    family: Family | float | str,
    seeds: Sequence[int],
    progress: Callable[[], None] = lambda: None,
) -> Ledger:
    """Runs one episode for every seed in a house without candles whose stairwells are all shut.

    What is left are bumps into tables, all of them bare. A stairwell that is shut blocks a child as a caregiver in it
    does. The children have the tapes of `run_episodes` with these seeds. Nobody is in their way; a caregiver could come
    out a little lower by standing between a child and a table, which nothing tells it to do.
    """
    family = Family.of(family)
    tapes = [Tape.draw_family(np.random.RandomState(seed), len(family)) for seed in seeds]
    world = GridWorld(plan, family, None, stairs_shut=True)
    world.reset(tapes)
    world.candle_table[:] = NOTHING
    for _ in range(len(tapes[0][0].steps)):
        world.step()
        progress()
    return world.ledger

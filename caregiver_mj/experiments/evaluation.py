"""Evaluate every caregiver with every child group, in the grid or in the house, one row an episode.

Episode i has the same seed, and so the same children, under every caregiver and epsilon and in both worlds (common
random numbers). A row depends only on the settings and on its place in them.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import tempfile
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from caregiver_mj.caregivers.registry import check_acts_alone
from caregiver_mj.children.behaviour import Behaviour
from caregiver_mj.errors import CaregiverError, check_kind
from caregiver_mj.experiments.blocks import Tables, belongs, merge, run_block, tables_of, try_all
from caregiver_mj.experiments.run_folder import RunFolder
from caregiver_mj.experiments.settings import GRID_BLOCK, Block, Settings
from caregiver_mj.experiments.summary import by_house, summarise
from caregiver_mj.experiments.workers import Executor, LocalExecutor

if TYPE_CHECKING:
    import pandas as pd  # imported where used: workers, and commands that only read a plan, do without


@dataclasses.dataclass(frozen=True)
class Evaluation:
    """The results of a run."""

    episodes: pd.DataFrame  #: a row an episode
    summary: dict[str, Any]  #: the content of summary.json
    #: a row for each caregiver, family and free cell: timesteps that children ended in the cell (`visits`) and damage
    #: that they took there, summed over all episodes
    maps: pd.DataFrame
    houses: pd.DataFrame  #: a row for each house, caregiver and family (see `by_house`)


def evaluate(
    settings: Settings,
    folder: RunFolder | None = None,
    *,
    jobs: int = 1,
    executor: Executor | None = None,
    progress: Callable[[int], None] = lambda _: None,
    grid_block: int = GRID_BLOCK,
) -> Evaluation:
    """Run every combination of caregiver and family.

    Args:
        settings: What to run.
        folder: Stores finished episodes at once, and supplies those of an earlier run.
        jobs: Worker processes of this machine. The results do not depend on it, nor on the next argument and the last.
        executor: Replaces the worker processes, such as a `DaskExecutor`.
        progress: Called with the number of episodes just finished or found.
        grid_block: Episodes to run at once in the grid.

    Raises:
        CaregiverError: The settings are wrong, a worker failed, or a result could not be written.
    """
    settings.check()
    check_kind("folder", folder, RunFolder, type(None))
    if folder and any(isinstance(child, Behaviour) for family in settings.families for child in family.children):
        raise CaregiverError("children of a run in a folder must be given by name, such as module:object")
    try_all(settings)
    with contextlib.ExitStack() as stack:
        if settings.queries.is_limited and not settings.queries.folder:  # shared by all processes
            counts = tempfile.TemporaryDirectory(prefix="caregiver_mj-")
            queries = dataclasses.replace(settings.queries, folder=stack.enter_context(counts))
            settings = dataclasses.replace(settings, queries=queries)
        return _evaluated(settings, folder, executor or LocalExecutor(jobs), progress, grid_block)


def _evaluated(
    settings: Settings, folder: RunFolder | None, executor: Executor, progress: Callable[[int], None], grid_block: int
) -> Evaluation:
    blocks = settings.blocks(grid_block, folder.extended_at if folder else ())
    done: dict[Block, Tables] = {}
    for block in blocks:
        found = folder.read(str(block)) if folder else None
        if found is not None and belongs(settings, block, found):
            done[block] = tables_of(settings, block, found)
            progress(len(block))
    pending = [block for block in blocks if block not in done]
    for block in pending:
        check_acts_alone(block.caregiver)
    work = functools.partial(run_block, settings)
    # Closed when a write fails or on Ctrl-C, so that no worker outlives the run.
    with contextlib.closing(executor.run(work, pending, settings.code)) as results:
        for block, result in results:
            if folder:
                folder.write(str(block), result)
            done[block] = tables_of(settings, block, result)
            progress(len(block))
    evaluation = sum_up(settings, [done[block] for block in blocks])
    if folder:
        folder.finish(**vars(evaluation))
    return evaluation


def sum_up(settings: Settings, parts: Sequence[Tables]) -> Evaluation:
    """Return the results of a run from the tables of its blocks, or of the runs to be pooled."""
    episodes, maps = merge(settings, parts)
    houses = by_house(episodes)
    return Evaluation(episodes, summarise(settings, episodes, houses), maps, houses)

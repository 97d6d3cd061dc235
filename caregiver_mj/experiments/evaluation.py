"""Evaluate every caregiver with every child group, in the grid or in the house, one row an episode.

Episode i has the same seed, and so the same children, under every caregiver and epsilon and in both worlds (common
random numbers). A row depends only on the settings and on its place in them.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import sys
import tempfile
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from caregiver_mj.caregivers.registry import check_acts_alone, find_caregiver, is_caregiver, make_caregiver
from caregiver_mj.children.behaviour import Behaviour
from caregiver_mj.errors import CaregiverError, check_kind
from caregiver_mj.experiments.run_folder import Result, RunFolder
from caregiver_mj.experiments.runner import MAPS, make_house, run_block
from caregiver_mj.experiments.settings import GRID_BLOCK, Block, Settings
from caregiver_mj.experiments.spec import BARE_TABLES, episode_seed
from caregiver_mj.experiments.summary import by_house, summarise
from caregiver_mj.experiments.workers import Executor, LocalExecutor
from caregiver_mj.plans.floor_plan import check_house
from caregiver_mj.recording.record import COLUMNS, names

if TYPE_CHECKING:
    import pandas as pd  # imported where used: workers, and commands that only read a plan, do without


_WHICH = ("world", "house", "caregiver", "family", "episode", "seed")
_TYPES = {column.name: column.type for column in COLUMNS}
_TEXTS = [name for name, kind in _TYPES.items() if kind == "str"]
_LISTS = names("child")  # columns with a value for each child
LARGEST = 2.0**53  # integers below this are exact in a float: no count reaches it


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
        jobs: Worker processes of this machine. The results do not depend on it, on `executor` or on `grid_block`.
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


@functools.lru_cache(maxsize=1)  # called before a folder is made, and again by `evaluate`
def try_all(settings: Settings) -> None:
    """Raise CaregiverError, before hours are spent, unless all caregivers, policies and children can be made.

    A caregiver of the package takes milliseconds, a policy of the robot's actions a second, in the first house.
    """
    for plan in settings.plans:
        for family in settings.families:
            family.make(plan)
        for name in settings.caregivers:
            found = None if name == BARE_TABLES else find_caregiver(name, queries=settings.queries)
            if found is not None and is_caregiver(found):
                check_house(make_caregiver(name, plan, settings.seed, settings.queries), plan)
            elif found is not None and plan is settings.plans[0]:
                make_house(settings.spec(plan, settings.families[0], name), visuals=False)


# -- Tables of a block or of a run ---------------------------------------------------------------------


class Tables(NamedTuple):
    """The tables of a block or of a run."""

    episodes: pd.DataFrame  # a row an episode
    maps: pd.DataFrame  # a row for each caregiver, family and free cell


def tables_of(settings: Settings, block: Block, result: Result) -> Tables:
    """Return the tables of one block."""
    import pandas as pd

    episodes = pd.DataFrame(result["rows"])
    for column in _TEXTS:
        episodes[column] = [sys.intern(text) for text in episodes[column]]
    plan = settings.house_of(block)
    row, column = np.array(plan.free_cells).T
    maps = []
    for family in block.families:
        what: dict[str, Any] = {"world": settings.world, "house": plan.name, "caregiver": block.caregiver}
        what |= {"family": str(family), "epsilon": family.epsilon}
        maps.append(pd.DataFrame(what | {"row": row, "column": column} | result["maps"][str(family)]))
    return Tables(episodes, pd.concat(maps, ignore_index=True))


def belongs(settings: Settings, block: Block, result: Result) -> bool:
    """Return whether a result from a folder belongs to this block: it has all rows, and a map for each family."""
    plan = settings.house_of(block)
    try:
        found = [tuple(row[key] for key in _WHICH) for row in result["rows"]]
        families = {str(family) for family in block.families}
        maps = [result["maps"][str(family)][name] for family in block.families for name in MAPS]
        rows = [[_fits(row[name], kind) for name, kind in _TYPES.items()] for row in result["rows"]]
        if any(row.keys() != _TYPES.keys() for row in result["rows"]) or not all(map(all, rows)):
            return False
        if not all(_fits(values, "list[float]") for values in maps) or result["maps"].keys() != families:
            return False
        children = {str(family): len(family) for family in block.families}
        if any(len(row[name]) != children[row["family"]] for row in result["rows"] for name in _LISTS):
            return False
        if any(of_family.keys() != {*MAPS} for of_family in result["maps"].values()):
            return False
    except (AttributeError, KeyError, TypeError):
        return False
    who = settings.world, plan.name, block.caregiver
    wanted = [
        (*who, str(family), episode, episode_seed(settings.seed, episode))
        for family in block.families
        for episode in block.numbers
    ]
    return found == wanted and {*map(len, maps)} == {len(plan.free_cells)}


def _fits(value: Any, kind: str) -> bool:
    """Return whether a value fits a column's type; numbers must be finite and not negative."""
    if kind == "str":
        return isinstance(value, str)
    if kind == "list[float]":
        return isinstance(value, list) and all(_fits(one, "float") for one in value)
    kinds = (int, float) if kind == "float" else (int,)
    return isinstance(value, kinds) and not isinstance(value, bool) and 0 <= value < LARGEST


def merge(settings: Settings, blocks: Sequence[Tables]) -> Tables:
    """Merge the tables of a run's blocks, ordered by house, family and caregiver."""
    import pandas as pd

    episodes = pd.concat([block.episodes for block in blocks], ignore_index=True)
    maps = pd.concat([block.maps for block in blocks], ignore_index=True)
    orders = {
        "house": {plan.name: i for i, plan in enumerate(settings.plans)},
        "family": {str(family): i for i, family in enumerate(settings.families)},
        "caregiver": {name: i for i, name in enumerate(settings.caregivers)},
    }

    def in_order(table: pd.DataFrame) -> pd.DataFrame:
        in_turn = functools.partial(table.sort_values, [*orders], kind="stable", ignore_index=True)
        return in_turn(key=lambda column: column.map(orders[column.name]))

    keys = [column for column in maps if column not in MAPS]
    return Tables(in_order(episodes), in_order(maps.groupby(keys, sort=False, as_index=False)[list(MAPS)].sum()))

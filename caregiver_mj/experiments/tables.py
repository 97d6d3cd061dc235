"""A run's rows and maps as tables, block by block: a million rows of JSON would not fit into memory together."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from caregiver_mj.experiments.blocks import MAPS
from caregiver_mj.experiments.run_folder import Result
from caregiver_mj.experiments.seeds import episode_seed
from caregiver_mj.experiments.settings import Block, Settings
from caregiver_mj.recording.record import COLUMNS

if TYPE_CHECKING:
    import pandas as pd  # imported where used: workers, and commands that only read a plan, do without

_WHICH = ("world", "house", "caregiver", "family", "episode", "seed")
_TYPES = {column.name: column.type for column in COLUMNS}
_TEXTS = [name for name, kind in _TYPES.items() if kind == "str"]
_LARGEST = 2.0**53  # from which on a number in a table is none that was counted


class Tables(NamedTuple):
    """What came of a block, or of a run.

    Attributes:
        episodes: A row an episode.
        maps: A row for each caregiver, family and free cell.
    """

    episodes: pd.DataFrame
    maps: pd.DataFrame


def tables_of(settings: Settings, block: Block, result: Result) -> Tables:
    """The tables of one block."""
    import pandas as pd

    episodes = pd.DataFrame(result["rows"])
    for column in _TEXTS:
        episodes[column] = [sys.intern(text) for text in episodes[column]]
    plan = settings.plan_of[block.house] if block.house else settings.plan
    row, column = np.array(plan.free_cells).T
    maps = []
    for family in block.families:
        what: dict[str, Any] = {"world": settings.world, "house": plan.name, "caregiver": block.caregiver}
        what |= {"family": str(family), "epsilon": family.epsilon}
        maps.append(pd.DataFrame(what | {"row": row, "column": column} | result["maps"][str(family)]))
    return Tables(episodes, pd.concat(maps, ignore_index=True))


def belongs(settings: Settings, block: Block, result: Result) -> bool:
    """Whether a result that was found in a folder is one of this block: all its rows, and a map for each family."""
    plan = settings.plan_of[block.house] if block.house else settings.plan
    try:
        found = [tuple(row[key] for key in _WHICH) for row in result["rows"]]
        maps = [result["maps"][str(family)][name] for family in block.families for name in MAPS]
        if not all(map(_is_row, result["rows"])) or not all(_fits(values, "list[float]") for values in maps):
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


def _is_row(row: Mapping[str, Any]) -> bool:
    """Whether it has all columns, each of its type."""
    return row.keys() == _TYPES.keys() and all(_fits(row[name], kind) for name, kind in _TYPES.items())


def _fits(value: Any, kind: str) -> bool:
    """Whether something can be in a column of a type: numbers are finite, and never negative."""
    if kind == "str":
        return isinstance(value, str)
    if kind == "list[float]":
        return isinstance(value, list) and all(_fits(one, "float") for one in value)
    kinds = (int, float) if kind == "float" else (int,)
    return isinstance(value, kinds) and not isinstance(value, bool) and 0 <= value < _LARGEST


def put_together(settings: Settings, blocks: Sequence[Tables]) -> Tables:
    """Those of a run: house by house, family by family, caregiver by caregiver."""
    import pandas as pd

    episodes = pd.concat([block.episodes for block in blocks], ignore_index=True)
    maps = pd.concat([block.maps for block in blocks], ignore_index=True)
    orders = {
        "house": {plan.name: i for i, plan in enumerate(settings.plans)},
        "family": {str(family): i for i, family in enumerate(settings.families)},
        "caregiver": {name: i for i, name in enumerate(settings.caregivers)},
    }

    def in_order(table: pd.DataFrame) -> pd.DataFrame:
        places = [table[column].map(order).to_numpy() for column, order in orders.items()]
        return table.iloc[np.lexsort(places[::-1])].reset_index(drop=True)

    keys = [column for column in maps if column not in MAPS]
    return Tables(in_order(episodes), in_order(maps.groupby(keys, sort=False, as_index=False)[list(MAPS)].sum()))

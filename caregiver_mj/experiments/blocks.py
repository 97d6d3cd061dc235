"""Run the episodes of a block, in the grid or in the house, and make tables of their rows and maps.

A row depends only on the settings and on its place in them.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from caregiver_mj.caregivers.registry import find_caregiver, is_caregiver, make_caregiver
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.run_folder import Result
from caregiver_mj.experiments.runner import make_house, run
from caregiver_mj.experiments.settings import Block, Settings
from caregiver_mj.experiments.spec import BARE_TABLES, NOBODY, episode_seed
from caregiver_mj.outside import plain
from caregiver_mj.plans.floor_plan import check_house
from caregiver_mj.recording.record import COLUMNS, EpisodeRecord

if TYPE_CHECKING:
    import pandas as pd  # imported where used: workers, and commands that only read a plan, do without


MAPS = ("visits", "damage")  # summed for every free cell over all episodes
_WHICH = ("world", "house", "caregiver", "family", "episode", "seed")
_TYPES = {column.name: column.type for column in COLUMNS}
_TEXTS = [name for name, kind in _TYPES.items() if kind == "str"]
_LARGEST = 2.0**53  # integers below this are exact in a float: no count reaches it


@functools.lru_cache(maxsize=1)  # called before a folder is made, and again by `evaluate`
def try_all(settings: Settings) -> None:
    """Make every caregiver and all children in each house, and every policy of the robot's actions in the first one.

    A mistake in user code then shows at once and not after hours. A caregiver of the package takes milliseconds, a
    policy of actions a second.

    Raises:
        CaregiverError: One cannot be made.
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


def run_block(settings: Settings, block: Block, answers: str | None = None) -> Result:
    """Run the episodes of a block; with `answers`, replay those of an earlier run instead of making a caregiver.

    Returns:
        The `rows`, with the columns of `EpisodeRecord` as keys, each family's `maps`, and the caregiver's `answers`.

    Raises:
        CaregiverError: A caregiver has no answers to replay, or a baseline has some.
    """
    if answers is not None:
        check_answers(block, answers)
    specs = settings.specs(block)
    outcome = run(specs, answers=answers or "")
    rows = [
        EpisodeRecord(
            world=spec.world,
            house=spec.plan.name,
            caregiver=spec.caregiver,
            family=str(spec.family),
            epsilon=spec.family.epsilon,
            children=len(spec.family),
            episode=number,
            seed=spec.own_seed,
            sight=spec.sight,
            **measured,
        )
        for spec, number, measured in zip(specs, [*block.numbers] * len(block.families), outcome.measured, strict=True)
    ]
    maps = (outcome.visits, outcome.damage)
    sums = [values.reshape(len(block.families), len(block.numbers), -1).sum(axis=1).tolist() for values in maps]
    return {
        "rows": list(map(vars, rows)),
        "maps": {
            str(family): dict(zip(MAPS, of_family, strict=True))
            for family, *of_family in zip(block.families, *sums, strict=True)
        },
        "answers": outcome.answers,
    }


def check_answers(block: Block, answers: Any) -> None:
    """Raise CaregiverError unless `answers` is the text of a block's caregiver, empty for a baseline."""
    if not isinstance(answers, str) or bool(answers) == (block.caregiver in NOBODY):
        wanted = "none" if block.caregiver in NOBODY else "the text of its arrays"
        raise CaregiverError(f"the answers of '{block.caregiver}' must be {wanted}, got {plain(repr(answers), 40)}")


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
    """Return whether a result found in a folder is of this block: it has all rows, and a map for each family."""
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
    """Whether a value fits a column's type; numbers must be finite and not negative."""
    if kind == "str":
        return isinstance(value, str)
    if kind == "list[float]":
        return isinstance(value, list) and all(_fits(one, "float") for one in value)
    kinds = (int, float) if kind == "float" else (int,)
    return isinstance(value, kinds) and not isinstance(value, bool) and 0 <= value < _LARGEST


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

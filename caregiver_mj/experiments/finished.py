"""Read finished runs from their folders, pool and compare them."""

from __future__ import annotations

import collections
import dataclasses
import functools
import json
import os
import pathlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd

from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.errors import CaregiverError, check_kind
from caregiver_mj.experiments import statistics
from caregiver_mj.experiments.evaluation import LARGEST, Tables, sum_up
from caregiver_mj.experiments.run_folder import (
    RunFolder,
    check_folder,
    describe_differences,
    in_short,
    read_json,
    unlike,
)
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.spec import BARE_TABLES, episode_seed
from caregiver_mj.experiments.summary import by_house, judge, judge_run
from caregiver_mj.outside import LARGEST_JSON, LARGEST_PIECE, LARGEST_RATIO, LARGEST_TABLE, limited_memory, read_file
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.recording.record import COLUMNS, MEASURES

SCORE = ("score", "score_ci_low", "score_ci_high")
_TYPES = {column.name: column.type for column in COLUMNS}
_HOLDS = {  # what columns of a type hold
    "str": "texts",
    "int": "whole numbers of at least 0",
    "float": "finite numbers of at least 0",
    "list[float]": "finite numbers of at least 0, one for each child",
}
_OF_MAPS = ("world", "house", "caregiver", "family", "epsilon", "row", "column", "visits", "damage")
_NEEDED = (  # columns of all versions
    *("world", "house", "caregiver", "family", "epsilon", "episode", "seed"),
    *("damage", "stopped", "timesteps_to_threshold", "cells_visited", "toys_reached", "moves_blocked"),
)
# Keys that may differ between pooled runs, or follow from others.
_EACH = ("seed", "episodes", "extended_at", "pooled", "file", "epsilons")
_PAIR = ["house", "family", "seed"]  # equal in two episodes with the same children
_SIDES = ("first", "second")
_ANEW = "`caregiver-mj evaluate --resume` writes it anew"
_NEVER_OPEN = (  # numbers of harm; others are None if undefined
    *("cells", "cells_harmed", "cells_decidable", "episodes_worse"),
    *("damage_alone", "damage_with", "damage_difference"),
)
_FILES = {  # files of a finished run, and messages if they are missing
    "run.json": "'{}' holds no run: `caregiver-mj evaluate --out DIR` makes one",
    "summary.json": "the run in '{}' is not finished: go on with `caregiver-mj evaluate --resume`",
    "episodes.parquet": f"the run in '{{}}' has no episodes.parquet: {_ANEW}",
    "maps.parquet": "the run in '{}' has no maps.parquet: run it again",
}
_NUMBER = 8  # bytes a number in a table
_NOT_SETTINGS = ("epsilons", "extended_at", "file", "houses")  # derived keys, or without effect on rows


@dataclasses.dataclass(frozen=True)
class Finished:
    """A finished run."""

    path: pathlib.Path  #: its folder
    record: dict[str, Any]  #: content of run.json
    settings: Settings  #: settings of the run
    episodes: pd.DataFrame  #: a row an episode
    maps: pd.DataFrame  #: a row for each caregiver, family and free cell
    summary: dict[str, Any]  #: content of summary.json

    @property
    def seeds(self) -> list[tuple[int, int]]:
        """Pair (seed, episodes) of the run, or of each pooled run."""
        pooled = self.record.get("pooled") or [[self.settings.seed, self.settings.episodes]]
        return [(int(seed), int(episodes)) for seed, episodes in pooled]

    @functools.cached_property
    def by_house(self) -> pd.DataFrame:
        """The table of `summary.by_house`."""
        return by_house(self._once)

    def judged_anew(self, caregivers: Sequence[str]) -> list[dict[str, Any]]:
        """Return the verdicts on some caregivers from the episodes alone: slower, but a summary may be forged."""
        names = [*caregivers, "none"]
        once = self._once[self._once["caregiver"].isin(names)]
        if "none" not in self.settings.caregivers:
            return judge(once, [], [])
        return judge_run(once, self.by_house[self.by_house["caregiver"].isin(names)])

    @property
    def _once(self) -> pd.DataFrame:
        """The episodes without repetitions: those of one seed are equal."""
        return self.episodes.drop_duplicates([*_PAIR, "caregiver"])


def read_finished(folder: str | os.PathLike[str]) -> Finished:
    """Read a finished run.

    Raises:
        CaregiverError: The folder holds no finished run or has links, or one of its files was changed.
    """
    path = pathlib.Path(folder)
    try:
        for name, message in _FILES.items():
            if not (path / name).is_file():
                raise CaregiverError(message.format(path))
        check_folder(path)
    except OSError as error:
        raise CaregiverError(f"the run in '{path}' cannot be read: {error.strerror}") from None
    try:
        found = Finished(path, *_read(path))
        found.seeds  # noqa: B018 (must be readable too)
        foreign = {
            "episodes.parquet": _foreign_episodes(found),
            "maps.parquet": _foreign_maps(found),
            "summary.json": _foreign_summary(found),
        }
    except KeyError as error:
        raise CaregiverError(f"the run in '{folder}' cannot be read: there is no {error} in it") from error
    except CaregiverError as error:
        raise CaregiverError(f"the run in '{folder}' cannot be read: {error}") from None
    except Exception as error:  # the files may hold anything
        raise CaregiverError(f"the run in '{folder}' cannot be read: {in_short(error)}") from error
    for name, wrong in foreign.items():
        if wrong:
            raise CaregiverError(f"the run in '{folder}' cannot be read: its {name} is that of another run; {_ANEW}")
    return found


def _read(path: pathlib.Path) -> tuple[dict[str, Any], Settings, pd.DataFrame, pd.DataFrame, dict[str, Any]]:
    record, summary = (_read_file(path / name, _dictionary) for name in ("run.json", "summary.json"))
    for key in ("versions", "code"):  # older runs lack the latter
        check_kind(f"{key} in run.json", record.get(key, {}), dict)
    settings = Settings.of_record(record)
    plans, who = settings.plans, len(settings.caregivers) * len(settings.families)
    rows = len(plans) * who * settings.episodes, sum(len(plan.free_cells) for plan in plans) * who
    names = ("episodes.parquet", "maps.parquet")
    episodes, maps = (
        _read_file(path / name, functools.partial(_table, rows=count)) for name, count in zip(names, rows, strict=True)
    )
    _read_file(path / names[0], lambda _: _check_columns(episodes))
    episodes, maps = (table[[c for c in of if c in table]] for table, of in ((episodes, _TYPES), (maps, _OF_MAPS)))
    return record, settings, episodes, maps, summary


def _check_columns(episodes: pd.DataFrame) -> None:
    """Raise ValueError unless the columns of episodes, of which older runs lack some, have valid values."""
    if lacking := [name for name in _NEEDED if name not in episodes]:
        raise ValueError(f"it must have a column '{lacking[0]}'")
    for name, kind in ((name, kind) for name, kind in _TYPES.items() if name in episodes):
        values = episodes[name]
        if kind == "str":
            fits = all(isinstance(value, str) for value in values.unique())
        elif kind == "list[float]":
            fits = all(isinstance(value, np.ndarray) for value in values)
            fits = fits and [*map(len, values)] == [*map(int, episodes["children"])]
            fits = fits and _are_amounts(np.concatenate([*values]))
        else:
            fits = pd.api.types.is_numeric_dtype(values.dtype) and _are_amounts(values.to_numpy(float))
            fits = fits and (kind == "float" or bool((values % 1 == 0).all()))
        if not fits:
            raise ValueError(f"its column '{name}' must have {_HOLDS[kind]}")


def _are_amounts(values: np.ndarray) -> bool:
    return bool(((values >= 0) & (values < LARGEST)).all())


def _read_file(path: pathlib.Path, read: Callable[[pathlib.Path], Any]) -> Any:
    """Return the content of a file; raise CaregiverError if it is damaged."""
    try:
        return read(path)
    except Exception as error:
        mend = "" if path.name == "run.json" else f"; {_ANEW}"
        raise CaregiverError(f"its {path.name} is damaged ({in_short(error)}){mend}") from error


def _dictionary(path: pathlib.Path) -> dict[str, Any]:
    found = read_json(path)
    json.loads(read_file(path, LARGEST_JSON), object_pairs_hook=_once)
    if not isinstance(found, dict):
        raise ValueError(f"it must hold a dictionary, got {type(found).__name__}")
    return found


def _once(pairs: list[tuple[str, Any]]) -> None:
    """Raise ValueError if a key is there twice: readers differ in which one they take."""
    counts = collections.Counter(key for key, _ in pairs)
    if twice := [key for key, count in counts.items() if count > 1]:
        raise ValueError(f"each of its keys must be there once, got '{twice[0]}' twice")


def _table(path: pathlib.Path, rows: int) -> pd.DataFrame:
    """Return the table in a file with a number of rows; its stated size is checked before it is unpacked."""
    import pyarrow.parquet

    content = read_file(path, LARGEST_TABLE)
    with pyarrow.parquet.ParquetFile(pyarrow.BufferReader(content)) as file:
        about, schema = file.metadata, file.schema_arrow
        if about.num_rows != rows:
            raise ValueError(f"it must have {rows:,} rows, got {about.num_rows:,}")
        groups = (about.row_group(i) for i in range(about.num_row_groups))
        size = sum(group.column(i).total_uncompressed_size for group in groups for i in range(group.num_columns))
        size = max(size, rows * len(schema) * _NUMBER)
        if size > LARGEST_PIECE + LARGEST_RATIO * len(content):
            raise ValueError(f"it must not unpack to {size:,} bytes, got a file of {len(content):,}")
        if others := [field.name for field in schema if not _fits_in_column(field.type)]:
            raise ValueError(f"its columns must be of numbers, texts or lists of numbers, got '{others[0]}'")
        with limited_memory(LARGEST_PIECE + size):
            return file.read(use_threads=False).to_pandas(use_threads=False)  # a thread takes memory, too


def _fits_in_column(kind: Any) -> bool:
    from pyarrow import types

    kinds = (types.is_integer, types.is_floating, types.is_boolean, types.is_string, types.is_large_string)
    return any(fits(kind) for fits in kinds) or (types.is_list(kind) and types.is_floating(kind.value_type))


def _who(found: Finished) -> set[tuple[str, str]]:
    """Return every pair of a caregiver and a family of the run."""
    return {(caregiver, str(family)) for caregiver in found.settings.caregivers for family in found.settings.families}


def _foreign_episodes(found: Finished) -> bool:
    """Return whether the episodes belong to another run."""
    episodes, settings = found.episodes, found.settings
    who = _who(found)
    houses = {plan.name for plan in settings.plans}
    if sum(count for _, count in found.seeds) != settings.episodes or not all(count > 0 for _, count in found.seeds):
        return True
    seeds = np.array([episode_seed(seed, number) for seed, count in found.seeds for number in range(count)])
    return (
        {*episodes.world} != {settings.world}
        or set(zip(episodes.caregiver, episodes.family, strict=True)) != who
        or set(episodes.house) != houses
        or set(episodes.episode) != set(range(settings.episodes))
        or len(episodes) != len(who) * len(houses) * settings.episodes
        or bool(episodes.duplicated(["house", "caregiver", "family", "episode"]).any())
        or not (episodes.seed.to_numpy() == seeds[episodes.episode.to_numpy(int)]).all()
    )


def _foreign_maps(found: Finished) -> bool:
    """Return whether the maps belong to another run."""
    maps = found.maps
    texts = ["world", "house", "caregiver", "family"]
    if not {*texts, "row", "column", "visits", "damage"} <= set(maps):
        return True
    if not all(isinstance(text, str) for name in texts for text in maps[name].unique()):
        return True
    cells = {cell for plan in found.settings.plans for cell in plan.free_cells}
    numbers = maps[["visits", "damage"]]
    if not all(map(pd.api.types.is_numeric_dtype, numbers.dtypes)):
        return True
    return (
        set(maps.caregiver) != set(found.settings.caregivers)
        or set(zip(maps.row, maps.column, strict=True)) != cells
        or bool(maps.duplicated(["house", "caregiver", "family", "row", "column"]).any())
        or not ((numbers >= 0) & (numbers < np.inf)).all(axis=None)
    )


def _foreign_summary(found: Finished) -> bool:
    """Return whether the summary belongs to another run; raise ValueError for an invalid number."""
    summary, wanted = found.summary, _who(found)
    check_kind("versions", summary["versions"], dict)
    against = [row for row in summary["comparisons"] if row.get("baseline") == "none"]
    means, compared = ([c for c in columns if c in found.episodes] for columns in (MEASURES, statistics.COMPARED))
    ends, worst = ("ci_low", "ci_high"), [row["worst"] for row in summary["harm"]]
    for rows, names in (
        (summary["rows"], [f"{column}_{part}" for column in means for part in ("mean", "sd", *ends)]),
        (against, [f"{column}_left" for column in ("damage", "toys_reached")]),
        (against, [f"{column}_left_{end}" for column in ("damage", "toys_reached") for end in ends]),
        (against, [f"{column}_difference_{part}" for column in compared for part in ("mean", *ends)]),
        (against, [f"{column}_p" for column in compared]),
        (against, [name for name in SCORE if any(name in row for row in against)]),  # older runs have none
        (summary["harm"], ["cells", "cells_harmed", "cells_decidable", "episodes_worse"]),
        (worst, ["damage_alone", "damage_with", *(f"damage_difference{end}" for end in ("", "_ci_low", "_ci_high"))]),
    ):
        numbers = [row[name] for row in rows for name in names]
        if lacking := [name for row in rows for name in names if name in _NEVER_OPEN and row[name] is None]:
            raise ValueError(f"{lacking[0]} of a summary must be a number, got None")
        if wrong := [number for number in numbers if not isinstance(number, int | float | None)]:
            raise ValueError(f"a number of a summary must be one, got {wrong[0]!r}")
        np.array(numbers, float)  # raises if one is too large
    rows, judged = ({(row["caregiver"], row["family"]) for row in part} for part in (summary["rows"], against))
    acting = {(caregiver, family) for caregiver, family in wanted if caregiver != "none"}
    acting = acting if "none" in found.settings.caregivers else set()
    texts = ("house", "family")
    harmful = {
        row["caregiver"] for row in summary["harm"] if all(isinstance(row["worst"][text], str) for text in texts)
    }
    return (rows, judged, harmful) != (wanted, acting, {name for name, _ in acting if name != BARE_TABLES})


def best_rescue(run: Finished, caregiver: str) -> tuple[FloorPlan, ChildGroup, int]:
    """Return house, children and number of the episode in which a caregiver prevented most damage.

    Raises:
        CaregiverError: The run lacks `none` or the caregiver, or that prevented nothing.
    """
    settings, key = run.settings, ["house", "family", "episode"]
    for name in dict.fromkeys(("none", caregiver)):
        if name not in settings.caregivers:
            raise CaregiverError(
                f"the run in '{run.path}' must have '{name}' to find the best rescue of '{caregiver}', got "
                f"{', '.join(settings.caregivers)}"
            )
    alone, guarded = (
        run.episodes[run.episodes.caregiver == name].set_index(key).damage for name in ("none", caregiver)
    )
    prevented = (alone - guarded).sort_index()
    if not prevented.max() > 0:
        raise CaregiverError(f"'{caregiver}' must prevent damage in an episode of '{run.path}', got none: see `report`")
    house, family, episode = prevented.idxmax()
    group = next(group for group in settings.families if str(group) == family)
    return settings.plan_of[house], group, int(episode)


def pool_runs(runs: Sequence[Finished], out: str | os.PathLike[str]) -> dict[str, Any]:
    """Write the episodes of all runs into one folder, run after run; each episode keeps its seed.

    The runs must have the same settings and versions, and different seeds, in any order.

    Returns:
        The content of the summary.json in the folder `out`.

    Raises:
        CaregiverError: The runs share a seed or have different settings, or the folder holds a run or is not writable.
    """
    if os.path.exists(os.path.join(out, "run.json")):
        raise CaregiverError(f"the output folder must hold no run, got '{out}': take another folder")
    if len(runs) < 2:
        raise CaregiverError(f"runs to be pooled must be at least 2, got {len(runs)}")
    first, *others = runs
    for other in others:
        both = _in_any_order(first.record), _in_any_order(other.record)
        if keys := unlike(*both, _EACH):
            raise CaregiverError(
                f"runs to be pooled must differ in their seeds alone, got '{first.path}' and '{other.path}': "
                + "; ".join(describe_differences(keys, *both, ("in the first", "in the second")))
            )
        if other_columns := {*first.episodes} ^ {*other.episodes}:
            raise CaregiverError(
                f"runs to be pooled must have the same columns, got '{min(other_columns)}' in one only of "
                f"'{first.path}' and '{other.path}'"
            )
    runs = sorted(runs, key=lambda run: run.seeds)  # bootstrap intervals depend on the order
    seeds = [pair for run in runs for pair in run.seeds]
    if len({seed for seed, _ in seeds}) < len(seeds):
        raise CaregiverError(f"runs to be pooled must have different seeds, got {', '.join(str(s) for s, _ in seeds)}")
    total = sum(episodes for _, episodes in seeds)
    record = {**{key: value for key, value in runs[0].record.items() if key != "extended_at"}, "episodes": total}
    record["pooled"] = [list(pair) for pair in seeds]
    parts, before = [], 0
    for run in runs:
        parts.append(Tables(run.episodes.assign(episode=run.episodes["episode"] + before), run.maps))
        before += run.settings.episodes
    pooled = sum_up(Settings.of_record(record), parts)
    pooled.summary["seeds"] = [seed for seed, _ in seeds]
    RunFolder(out, record).finish(**vars(pooled))
    return pooled.summary


def _in_any_order(record: dict[str, Any]) -> dict[str, Any]:
    """Return the record with caregivers and families sorted."""
    return record | {key: sorted(record[key], key=str) for key in ("caregivers", "families")}


def compare_runs(first: Finished, second: Finished, caregivers: Sequence[str] = ()) -> dict[str, Any]:
    """Compare the second run with the first, in their common episodes.

    `caregivers` names one caregiver of each run, or one for both; an empty list means all common ones.

    Returns:
        As JSON: `rows`, for each caregiver and family the mean damage `first` and `second`, and the columns of
        `statistics.comparison_rows` of the second against the first; `verdicts` of harm by these caregivers in all
        episodes of their own run (`run`, first or second); the `settings` that differ.

    Raises:
        CaregiverError: The runs differ in world or house, lack a caregiver, or have no episode in common.
    """
    ours, theirs = first.settings, second.settings
    if ours.world != theirs.world:
        raise CaregiverError(
            f"runs to compare must be of one world, got {ours.world} and {theirs.world}: `report` shows both"
        )
    for name in ours.plan_of.keys() & theirs.plan_of.keys():
        one, other = ours.plan_of[name], theirs.plan_of[name]
        if (one.rows, one.cell_size) != (other.rows, other.cell_size):
            raise CaregiverError(f"house '{name}' must be the same in both runs, got two floor plans")
    rows, pairs = [], _pairs(ours.caregivers, theirs.caregivers, caregivers)
    for pair in pairs:
        ours_, theirs_ = (
            run.episodes[run.episodes.caregiver == name].drop_duplicates(_PAIR)  # episodes of one seed are equal
            for run, name in zip((first, second), pair, strict=True)
        )
        # Pooling renumbers episodes.
        theirs_ = theirs_.drop(columns="episode").merge(ours_[[*_PAIR, "episode"]])
        ours_ = ours_.merge(theirs_[_PAIR])
        if ours_.empty:
            raise CaregiverError(_nothing_in_common(pair, ours, theirs))
        together = [side.assign(caregiver=name) for side, name in zip((ours_, theirs_), _SIDES, strict=True)]
        for row in statistics.comparison_rows(pd.concat(together, ignore_index=True), _SIDES[1], _SIDES[0]):
            theirs_here = (side[side.family == row["family"]].groupby("house")["damage"] for side in together)
            means = [float(damage.mean().mean()) for damage in theirs_here]  # over houses if there are several
            rows.append({**row, "baseline": pair[0], "caregiver": pair[1], **dict(zip(_SIDES, means, strict=True))})
    verdicts = [
        {"run": side, **verdict}
        for side, run, names in zip(_SIDES, (first, second), zip(*pairs, strict=True), strict=True)
        for verdict in run.judged_anew(names)
    ]
    found = {"rows": statistics.judged_together(rows), "verdicts": verdicts}
    return found | {"settings": _differences(first.record, second.record)}


def _nothing_in_common(pair: tuple[str, str], ours: Settings, theirs: Settings) -> str:
    names = " and ".join(f"'{name}'" for name in dict.fromkeys(pair))
    for what, one, other in (
        ("seed", ours.seed, theirs.seed),
        ("house", ours.place, theirs.place),
        ("epsilon", " ".join(map(str, ours.families)), " ".join(map(str, theirs.families))),
    ):
        if one != other:
            return f"the runs have no episode of {names} in common: {what} {one} in the first, {other} in the second"
    return f"the runs have no episode of {names} in common"


def _pairs(ours: Sequence[str], theirs: Sequence[str], wanted: Sequence[str]) -> list[tuple[str, str]]:
    if len(wanted) > 2:
        raise CaregiverError(f"caregivers to compare must be 1 or 2, got {len(wanted)}")
    pairs = [(wanted[0], wanted[-1])] if wanted else [(name, name) for name in ours if name in theirs]
    for name, there in ((name, there) for pair in pairs for name, there in zip(pair, (ours, theirs), strict=True)):
        if name not in there:
            raise CaregiverError(f"no caregiver '{name}' in the run: there are {', '.join(there)}")
    if not pairs:
        raise CaregiverError(f"no caregiver is in both runs: there are {', '.join(ours)} and {', '.join(theirs)}")
    return pairs


def _differences(first: dict[str, Any], second: dict[str, Any]) -> dict[str, list[Any]]:
    """Return the settings and versions that differ, with both values."""

    def flat(record: dict[str, Any]) -> dict[str, Any]:
        found = {key: value for key, value in record.items() if key not in _NOT_SETTINGS}
        if record["world"] == "grid":
            del found["embodiment"]
        for group in ("versions", "code"):
            found |= found.pop(group, None) or {}
        return found | {"plans": [plan["name"] for plan in record["plans"]]}

    ours, theirs = flat(first), flat(second)
    return {key: [ours.get(key), theirs.get(key)] for key in {**ours, **theirs} if ours.get(key) != theirs.get(key)}

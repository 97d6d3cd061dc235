"""Two finished runs of one world against each other, episode by episode."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pandas as pd

from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import statistics
from caregiver_mj.experiments.finished import Finished
from caregiver_mj.experiments.settings import Settings

_PAIR = ["house", "family", "seed"]  # what two episodes share that have the same children
_SIDES = ("first", "second")
_NOT_SETTINGS = ("epsilons", "extended_at", "file")  # follow from others, or nothing depends on them


def compare_runs(first: Finished, second: Finished, caregivers: Sequence[str] = ()) -> dict[str, Any]:
    """What comes of the second run less what comes of the first, in the episodes that both have.

    Args:
        first: A run.
        second: Another one of the same world.
        caregivers: Of the first and of the second; one name for that in both; none for all that both have.

    Returns:
        As JSON: `rows`, for each caregiver and family `first` and `second`, the mean damage in either, and all that
        `statistics.comparison_rows` has of the second against the first; `settings`, what is not the same in both.

    Raises:
        CaregiverError: The runs are of different worlds or houses, or have no such caregiver or no episode in common.
    """
    ours, theirs = first.settings, second.settings
    if ours.world != theirs.world:
        raise CaregiverError(
            f"one run is in the {ours.world}, the other in the {theirs.world}: `report` sets both beside"
        )
    for name in ours.plan_of.keys() & theirs.plan_of.keys():
        if ours.plan_of[name].rows != theirs.plan_of[name].rows:
            raise CaregiverError(f"house '{name}' is another one in the second run")
    rows = []
    for pair in _pairs(ours.caregivers, theirs.caregivers, caregivers):
        ours_, theirs_ = (
            run.episodes[run.episodes.caregiver == name] for run, name in zip((first, second), pair, strict=True)
        )
        # Where runs were pooled, episodes have other numbers than where they were not.
        theirs_ = theirs_.drop(columns="episode").merge(ours_[[*_PAIR, "episode"]])
        ours_ = ours_.merge(theirs_[_PAIR])
        if ours_.empty:
            raise CaregiverError(_nothing_in_common(pair, ours, theirs))
        together = [side.assign(caregiver=name) for side, name in zip((ours_, theirs_), _SIDES, strict=True)]
        for row in statistics.comparison_rows(pd.concat(together, ignore_index=True), _SIDES[1], _SIDES[0]):
            means = {name: _mean(side, row["family"]) for side, name in zip(together, _SIDES, strict=True)}
            rows.append({**row, "baseline": pair[0], "caregiver": pair[1], **means})
    return {"rows": statistics.judged_together(rows), "settings": _differences(first.record, second.record)}


def _nothing_in_common(pair: tuple[str, str], ours: Settings, theirs: Settings) -> str:
    """What to say of two caregivers none of whose episodes are the same."""
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
        raise CaregiverError(f"two caregivers are compared at once, not {len(wanted)}")
    pairs = [(wanted[0], wanted[-1])] if wanted else [(name, name) for name in ours if name in theirs]
    for name, there in ((name, there) for pair in pairs for name, there in zip(pair, (ours, theirs), strict=True)):
        if name not in there:
            raise CaregiverError(f"no episodes with the caregiver '{name}': there are {', '.join(there)}")
    if not pairs:
        raise CaregiverError(f"no caregiver is in both runs: there are {', '.join(ours)} and {', '.join(theirs)}")
    return pairs


def _mean(episodes: pd.DataFrame, family: str) -> float:
    """Mean damage, over houses if there are several."""
    chosen = episodes[episodes.family == family]
    return float(chosen.groupby("house")["damage"].mean().mean())


def _differences(first: dict[str, Any], second: dict[str, Any]) -> dict[str, list[Any]]:
    """Settings that are not the same, and versions, with what they are in either."""

    def flat(record: dict[str, Any]) -> dict[str, Any]:
        found = {key: value for key, value in record.items() if key not in _NOT_SETTINGS}
        if record["world"] == "grid":
            del found["embodiment"]
        for group in ("versions", "code"):
            found |= found.pop(group, None) or {}
        return found | {"plans": [plan["name"] for plan in record["plans"]]}

    ours, theirs = flat(first), flat(second)
    return {key: [ours.get(key), theirs.get(key)] for key in {**ours, **theirs} if ours.get(key) != theirs.get(key)}

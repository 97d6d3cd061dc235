"""Whether the run in a folder is one that can be gone on with, and what is then to be written down of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from caregiver_mj.errors import CaregiverError

Record = dict[str, Any]  # of a run, as JSON

_OF_ITS_OWN = ("file", "caregivers", "episodes", "code", "source", "extended_at")  # all else must be the same
_LONGEST = 200  # letters of a value that a message has


def continued(found: Record, wanted: Record) -> Record:
    """The record of a run that is gone on with: with the same settings, or more episodes, or more caregivers.

    Args:
        found: What is in the folder.
        wanted: What is to be run now.

    Returns:
        What is to be in the folder. Its `extended_at` are the numbers of episodes that the run has had before, for grid
        episodes are run many at once, and those that are done shall not be run again.

    Raises:
        CaregiverError: What is there belongs to other settings, or there is more of it than is wanted.
    """
    keys = unlike(found, wanted, _OF_ITS_OWN)
    if "caregivers" not in wanted:  # a study's, which cannot be added to
        if wrong := told(keys, found, wanted) or _other_source(found, wanted):
            raise CaregiverError("; ".join(wrong))
        return found
    if "caregivers" not in found:
        raise CaregiverError("its run.json is no record of a run: take another folder")
    if "pooled" in found:
        raise CaregiverError("it is of several runs that were pooled: go on with each of them, and pool them anew")
    there, here = found.get("caregivers"), wanted["caregivers"]
    if not isinstance(there, list) or not all(name in here for name in there):
        keys.append("caregivers")
    episodes, extended = found.get("episodes"), found.get("extended_at", [])
    if not isinstance(episodes, int) or not isinstance(extended, list) or episodes > wanted["episodes"]:
        keys.append("episodes")
    wrong = told(keys, found, wanted) or [*_other_source(found, wanted), *_other_code(found, wanted)]
    if wrong:
        less = "; a run can be added to, but not cut" if keys and {*keys} <= {"caregivers", "episodes"} else ""
        raise CaregiverError("; ".join(wrong) + less)
    if episodes < wanted["episodes"]:
        extended = [*extended, episodes]
    steps = [0, *extended, wanted["episodes"]]
    if not all(isinstance(step, int) for step in steps) or steps != sorted(set(steps)):
        raise CaregiverError(f"extended_at cannot be {extended}")
    if there == here and episodes == wanted["episodes"]:
        return found
    return {**wanted, **({"extended_at": extended} if extended else {})}


def unlike(one: Record, other: Record, but: Sequence[str]) -> list[str]:
    """Keys of what is not the same in two records, save some; where both are in the grid nothing depends on a robot."""
    if one.get("world") == other.get("world") == "grid":
        but = (*but, "embodiment")
    return [key for key in {**one, **other} if key not in but and one.get(key) != other.get(key)]


def told(keys: Sequence[str], found: Record, wanted: Record, where: tuple[str, str] = ("there", "here")) -> list[str]:
    """What is to be said of what is not the same in two records, and what to call them."""
    lines = []
    for key in keys:
        there, here = found.get(key), wanted.get(key)
        if isinstance(there, dict) and isinstance(here, dict):  # such as of versions
            differ = [name for name in {**there, **here} if there.get(name) != here.get(name)]
            there, here = ({name: values.get(name) for name in differ} for values in (there, here))
        elif key == "plans":
            there, here = (_names(plans) for plans in (there, here))
            if there == here:
                lines.append(f"the floor plans of {here} are others {where[0]} than {where[1]}")
                continue
            key = "houses"
        lines.append(f"{key} is {_short(there)} {where[0]} and {_short(here)} {where[1]}")
    return lines


def _names(plans: Any) -> Any:
    """What floor plans in a record are called, if they are such."""
    if not isinstance(plans, list) or not all(isinstance(plan, dict) for plan in plans):
        return plans
    return " ".join(str(plan.get("name")) for plan in plans)


def _short(value: Any) -> str:
    """What can be told of a value in a line."""
    text = str(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."


def _other_source(found: Record, wanted: Record) -> list[str]:
    """What is to be said of the package's own source if that is not what it was."""
    there, here = found.get("source"), wanted.get("source")
    if there == here:
        return []
    return [
        f"the source of caregiver_mj that decides rows has changed, from {there} to {here}; put it back, or take "
        "another folder"
    ]


def _other_code(found: Record, wanted: Record) -> list[str]:
    """What is to be said of code that is not what it was."""
    there, here = found.get("code") or {}, wanted.get("code") or {}
    if not isinstance(there, dict):
        return [f"code is {there} there and {here} here"]
    added = {f"caregiver {name}" for name in wanted["caregivers"] if name not in found["caregivers"]}
    return [
        f"the code of {what} has changed, from {there.get(what)} to {here.get(what)}; "
        "put it back, or take another folder"
        for what in {**there, **here}
        if there.get(what) != here.get(what) and what not in added
    ]

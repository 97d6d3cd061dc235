"""Runs that differ in their seed alone, put together as one run with more episodes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.by_house import by_house
from caregiver_mj.experiments.continuing import told, unlike
from caregiver_mj.experiments.finished import Finished
from caregiver_mj.experiments.run_folder import RunFolder
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.summary import summarise
from caregiver_mj.experiments.tables import Tables, put_together

# May be what it likes in each run, or follows from others.
_EACH = ("seed", "episodes", "extended_at", "pooled", "file", "epsilons")


def pool_runs(runs: Sequence[Finished], out: str | os.PathLike[str]) -> dict[str, Any]:
    """Writes a folder with the episodes of all runs, one run's after the other's; each keeps its seed.

    Args:
        runs: Finished runs of the same settings and versions, but each of a seed of its own, in any order.
        out: The folder, in which there must not be a run.

    Returns:
        The content of its summary.json.

    Raises:
        CaregiverError: The runs are of one seed, or of different settings; or the folder cannot be written.
    """
    if os.path.exists(os.path.join(out, "run.json")):
        raise CaregiverError(f"'{out}' already holds a run: take another folder for those that are pooled")
    first, *others = runs
    for other in others:
        both = _in_any_order(first.record), _in_any_order(other.record)
        if keys := unlike(*both, _EACH):
            raise CaregiverError(
                f"'{first.path}' and '{other.path}' are not the same but for the seed: "
                + "; ".join(told(keys, *both, ("in the first", "in the second")))
            )
    runs = sorted(runs, key=lambda run: run.seeds)  # for intervals depend on the order of what they are resampled from
    seeds = [pair for run in runs for pair in run.seeds]
    if len({seed for seed, _ in seeds}) < len(seeds):
        raise CaregiverError(f"runs to be pooled must have different seeds, not {', '.join(str(s) for s, _ in seeds)}")
    total = sum(episodes for _, episodes in seeds)
    record = {**{key: value for key, value in runs[0].record.items() if key != "extended_at"}, "episodes": total}
    record["pooled"] = [list(pair) for pair in seeds]
    parts, before = [], 0
    for run in runs:
        parts.append(Tables(run.episodes.assign(episode=run.episodes["episode"] + before), run.maps))
        before += run.settings.episodes
    settings = Settings.of_record(record)
    episodes, maps = put_together(settings, parts)
    houses = by_house(episodes)
    summary = {**summarise(settings, episodes, houses), "seeds": [seed for seed, _ in seeds]}
    RunFolder(out, record).finish(episodes, summary, maps, houses)
    return summary


def _in_any_order(record: dict[str, Any]) -> dict[str, Any]:
    """A record that does not tell in which order a run has had its caregivers and its families."""
    return record | {key: sorted(record[key], key=str) for key in ("caregivers", "families")}

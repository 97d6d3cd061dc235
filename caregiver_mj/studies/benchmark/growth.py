"""The closed loop as houses, tables and candles get more."""

from __future__ import annotations

import statistics
from typing import Any

from rich.console import Console

from caregiver_mj.plans.generator import generate
from caregiver_mj.studies.benchmark.effort import Effort
from caregiver_mj.studies.benchmark.scene import Scene
from caregiver_mj.studies.display import make_table

_LARGE = 40  # cells a side of the houses in which only tables and candles grow
# Cells a side, candles, bare tables.
_SIZES = ((12, 2, 2), (20, 10, 10), (30, 20, 20), (_LARGE, 5, 5), (_LARGE, 20, 20), (_LARGE, 40, 40))


def growth(effort: Effort, console: Console) -> dict[str, Any]:
    """Measures all sizes in turn, over and over."""
    scenes = [
        Scene(generate(0, (side, side), stairwells=4, candles=candles, tables=tables, bins=4), effort.large_seconds)
        for side, candles, tables in _SIZES
    ]
    for scene in scenes:
        scene.record()
    runs: list[list[tuple[float, ...]]] = [[] for _ in scenes]
    for _ in range(effort.repeats):
        for scene, repeats in zip(scenes, runs, strict=True):
            repeats.append((*scene.run(), scene.replay()[0]))
    rows = [_row(*each) for each in zip(_SIZES, scenes, runs, strict=True)]
    table = make_table("The closed loop as houses grow", "cells", "tables", "candles", "x real time",
                       "us a control step", "physics", "policy", "task", "bare mj_step")  # fmt: skip
    for row in rows:
        table.add_row(f"{row['side']} x {row['side']}", *(f"{value:.0f}" for value in list(row.values())[1:]))
    console.print(table)
    large = [row for row in rows if row["side"] == _LARGE]
    in_all, at_large = _ratios(rows[0], rows[-1]), _ratios(large[0], large[-1])
    verdict = "at most linear, as it shall be" if at_large["time"] <= at_large["objects"] else "MORE THAN LINEAR"
    for where, ratio in ((f"{in_all['cells']:.0f} x the cells", in_all), (f"{_LARGE} x {_LARGE} cells", at_large)):
        console.print(f"{ratio['objects']:.0f} x the tables and candles in {where} take {ratio['time']:.1f} x the time")
    console.print(f"growth with the tables and candles at one size of house: {verdict}\n")
    return {"houses": rows, "ratios": in_all, "ratios_at_one_size": at_large}


def _row(size: tuple[int, int, int], scene: Scene, repeats: list[tuple[float, ...]]) -> dict[str, float]:
    """What comes of a scene's repeats: seconds in all, in physics, in the policy, and of the replay."""
    side, candles, tables = size
    columns = zip(*repeats, strict=True)
    total, physics, policy, bare = (1e6 * statistics.median(column) / scene.steps for column in columns)
    return {
        "side": side,
        "tables": candles + tables,
        "candles": candles,
        "real_time_factor": 1e6 * scene.env.control_timestep() / total,
        "microseconds_a_step": total,
        "microseconds_physics": physics,
        "microseconds_policy": policy,
        "microseconds_task": total - physics - policy,
        "microseconds_bare": bare,
    }


def _ratios(few: dict[str, float], many: dict[str, float]) -> dict[str, float]:
    """By how much more there is of everything."""
    return {
        "cells": (many["side"] / few["side"]) ** 2,
        "objects": (many["tables"] + many["candles"]) / (few["tables"] + few["candles"]),
        "time": many["microseconds_a_step"] / few["microseconds_a_step"],
    }

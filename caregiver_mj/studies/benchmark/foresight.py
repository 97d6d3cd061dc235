"""What foresight costs as houses grow: its preparation, its memory, its decisions.

Time is that of the processor: what else the machine is doing counts for little.
"""

from __future__ import annotations

import dataclasses
import pathlib
import statistics
import time
from typing import Any

import numpy as np
from rich.console import Console

from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.children.tape import Tape
from caregiver_mj.experiments.workers import run_jobs
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.studies.benchmark.clock import Clock
from caregiver_mj.studies.benchmark.effort import EPSILON, Effort
from caregiver_mj.studies.display import make_table

_BATCH = 400  # episodes at once
_SECONDS = 4  # for which they run, times the repeats, if they do not end before
_HALF, _LARGE = "20 x 20", "40 x 40, 40 candles"


@dataclasses.dataclass(frozen=True)
class Budget:
    """What foresight may cost in a house, on one core: seconds, milliseconds, megabytes, timesteps a second."""

    preparation: float = np.inf
    decision: float = np.inf
    memory: float = 2000.0
    speed: float = 0.0


_HOUSES = {
    "paper": "paper",
    "apartment": "apartment",
    _HALF: "house-0-20x20",
    _LARGE: "house-0-40x40-stairwells6-candles40-tables20-bins6",
}
_BUDGETS = {"paper": Budget(5.0, 20.0, speed=20_000.0), _LARGE: Budget(60.0, 100.0)}


def foresight(effort: Effort, console: Console) -> dict[str, dict[str, float]]:
    """Every house in a process of its own, in the grid."""
    jobs = [(house, _SECONDS * effort.repeats) for house in _HOUSES.values()]
    figures = {}
    for name, job in zip(_HOUSES, jobs, strict=True):
        [(_, figures[name])] = run_jobs(cost, [job], 2)
    table = make_table("Foresight in the grid, one core", "house", "cells", "preparation s", "peak MB", "ms a decision",
                       "of 100 the longest", "timesteps/s", "as it shall be")  # fmt: skip
    for name, row in figures.items():
        budget = _BUDGETS.get(name, Budget())
        kept = (
            row["preparation"] <= budget.preparation
            and row["decision_99"] <= budget.decision
            and row["megabytes"] <= budget.memory
            and row["timesteps_a_second"] >= budget.speed
        )
        table.add_row(name, f"{row['cells']}", f"{row['preparation']:.1f}", f"{row['megabytes']:.0f}",
                      f"{row['decision']:.1f}", f"{row['decision_99']:.1f}", f"{row['timesteps_a_second']:,.0f}",
                      "yes" if kept else "NO")  # fmt: skip
    console.print(table)
    return figures


def cost(job: tuple[str, int]) -> dict[str, Any]:
    """Measures a house in a worker.

    Args:
        job: The name of the house, and for how many seconds at least to run the batch.
    """
    house, seconds = job
    plan = FloorPlan.load(house)
    start = time.process_time()
    caregiver = ForesightCaregiver(plan)
    preparation = time.process_time() - start
    world, clock = GridWorld(plan, EPSILON, caregiver), Clock(time.process_time)
    with clock.of(caregiver, "decide"):
        world.run(_tapes(1))
    milliseconds = [1000 * call for call in clock.times]
    _speed(world, seconds)  # finds the ways round children, which a house keeps
    return {
        "cells": len(plan.free_cells),
        "preparation": preparation,
        "decision": statistics.median(milliseconds),
        "decision_99": float(np.percentile(milliseconds, 99)),
        "timesteps_a_second": _speed(world, seconds),
        "megabytes": _peak(),  # after all the rest
    }


def _speed(world: GridWorld, seconds: float) -> float:
    """Novice timesteps a second of a batch, which runs for so many seconds, or to its end."""
    tapes = _tapes(_BATCH)
    world.reset(tapes)
    start = time.process_time()
    while world.timestep < len(tapes[0][0].steps) and time.process_time() - start < seconds:
        world.step()
    return _BATCH * world.timestep / (time.process_time() - start)


def _tapes(count: int) -> list[tuple[Tape, ...]]:
    return [Tape.draw_family(np.random.RandomState(seed), 1) for seed in range(count)]


def _peak() -> float:
    """The most memory that the process has had, in MB. What `resource` says counts the parent's, too."""
    status = pathlib.Path("/proc/self/status").read_text(encoding="ascii")
    return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")) * 1.024e-3

"""How long it takes to build a house, and everything round it."""

from __future__ import annotations

import functools
import statistics
import time

from rich.console import Console

from caregiver_mj.experiments.workers import run_jobs
from caregiver_mj.house.physics import Physics
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.generator import generate
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.studies.benchmark.clock import seconds_of
from caregiver_mj.studies.benchmark.effort import EPSILON, Effort
from caregiver_mj.studies.display import make_table
from caregiver_mj.tasks import load

_GOAL = 1.0  # seconds for the model of a 12 x 10 house


def _small() -> FloorPlan:
    return generate(0, (12, 10), stairwells=2, candles=2, tables=3, bins=3)


def _large() -> FloorPlan:
    return generate(0, (40, 40), stairwells=6, candles=40, tables=40, bins=6)


_PLANS = {"12 x 10, 2 candles": _small, "40 x 40, 40 candles": _large}


def building(effort: Effort, console: Console) -> dict[str, dict[str, float]]:
    """Seconds for the model, the environment, and the caregiver up to its first action."""
    table = make_table("Building a house", "house", "model s", "environment s", "caregiver s")
    # Pictures of wood and grass are painted once in a process.
    [(_, first)] = run_jobs(build_first, [0], 2)
    figures = {"first in a process": {"model": first}}
    table.add_row("12 x 10, the first in a process", f"{first:.2f}")
    for name, make in _PLANS.items():
        times: list[tuple[float, float, float]] = []
        for _ in range(effort.repeats):  # a new plan each time: plans keep what they have worked out
            other, fresh = make(), make()
            model = seconds_of(functools.partial(Physics.from_plan, other))
            start = time.perf_counter()
            env = load("supervise", fresh, EPSILON, random=0)
            ready = time.perf_counter()
            policy = CaregiverPolicy(env)
            policy(env.reset())
            times.append((model, ready - start, time.perf_counter() - ready))
        row = [statistics.median(column) for column in zip(*times, strict=True)]
        figures[name] = dict(zip(("model", "environment", "caregiver_to_first_action"), row, strict=True))
        table.add_row(name, *(f"{seconds:.2f}" for seconds in row))
    console.print(table)
    verdict = "as it shall be" if first < _GOAL else "TOO SLOW"
    console.print(f"a 12 x 10 house in less than {_GOAL:g} s, even the first in a process: {verdict}\n")
    return figures


def build_first(_: int) -> float:
    """Builds a house in a worker that has built none."""
    plan = _small()
    return seconds_of(lambda: Physics.from_plan(plan))

"""The closed loop in the houses of the package; bare physics and dm_control's own tasks beside it."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from rich.console import Console

from caregiver_mj.studies.benchmark.dissection import dissect, print_parts
from caregiver_mj.studies.benchmark.effort import Effort
from caregiver_mj.studies.benchmark.prototype import HOUSE, MANIPULATOR, prototype
from caregiver_mj.studies.benchmark.scene import Scene
from caregiver_mj.studies.display import make_table

_HOUSES = (HOUSE, "apartment")
_SUITE = (MANIPULATOR, "humanoid:walk")  # of dm_control
_SUITE_SECONDS = 30.0  # simulated, at most, for each of those


def closed_loop(effort: Effort, console: Console) -> dict[str, Any]:
    """Measures all of it in turn, over and over."""
    scenes = {house: Scene(house, effort.seconds) for house in _HOUSES}
    for scene in scenes.values():
        scene.record()
    suite = {name: _suite_task(*name.split(":")) for name in _SUITE}
    runs: dict[str, list[tuple[float, ...]]] = {house: [] for house in scenes}
    factors: dict[str, list[float]] = {name: [] for name in suite}
    for _ in range(effort.repeats):
        for house, scene in scenes.items():
            runs[house].append((*scene.run(), *scene.replay()))
        for name, run in suite.items():
            factors[name].append(run(min(effort.seconds, _SUITE_SECONDS)))
    houses = {house: _summary(effort.seconds, repeats) for house, repeats in runs.items()}
    for house, row in houses.items():
        row["parts"] = dissect(scenes[house])
    figures = {"houses": houses, "dm_control": {name: statistics.median(each) for name, each in factors.items()}}
    _print_loops(console, figures)
    for house, row in houses.items():
        print_parts(console, house, row["parts"], scenes[house].steps)
    return figures


def _summary(seconds: float, repeats: list[tuple[float, ...]]) -> dict[str, Any]:
    """What comes of the repeats: seconds in all, in physics, in the policy, of the replay; and its deviation."""
    total, physics, policy, bare, _ = map(statistics.median, zip(*repeats, strict=True))
    return {
        "real_time_factor": seconds / total,
        "bare_real_time_factor": seconds / bare,
        # The ratio of each repeat's two runs, which follow each other: a load that comes and goes hits both.
        "ratio": statistics.median(run[0] / run[3] for run in repeats),
        "share_physics": physics / total,
        "share_policy": policy / total,
        "share_task": 1 - (physics + policy) / total,
        "replay_deviation": max(run[4] for run in repeats),
    }


def _print_loops(console: Console, figures: dict[str, Any]) -> None:
    title = "Closed loop: supervise, one core; beside it dm_control's tasks with zero action"
    table = make_table(title, "house", "x real time", "prototype", "bare mj_step", "ratio",
                       "physics", "policy", "task")  # fmt: skip
    for house, row in figures["houses"].items():
        shares = (f"{row[f'share_{part}']:.0%}" for part in ("physics", "policy", "task"))
        table.add_row(house, f"{row['real_time_factor']:.0f}", prototype(house), f"{row['bare_real_time_factor']:.0f}",
                      f"{row['ratio']:.2f}", *shares)  # fmt: skip
    for name, factor in figures["dm_control"].items():
        table.add_row(name, f"{factor:.0f}", prototype(name))
    console.print(table)
    ratio = figures["houses"][HOUSE]["real_time_factor"] / figures["dm_control"][MANIPULATOR]
    console.print(f"{HOUSE} is {ratio:.1f} x as fast as {MANIPULATOR}")
    deviation = max(row["replay_deviation"] for row in figures["houses"].values())
    console.print(f"replayed through bare mj_step, the episodes end within {deviation:.1g} m or rad of themselves\n")


def _suite_task(domain: str, task: str) -> Callable[[float], float]:
    """One of dm_control's tasks with zero action: a function from simulated seconds to the real-time factor."""
    from dm_control import suite  # after caregiver_mj.house.rendering, which has been imported by now

    env = suite.load(domain, task, task_kwargs={"random": 0})
    action = np.zeros(env.action_spec().shape)

    def run(seconds: float) -> float:
        steps = round(seconds / env.control_timestep())
        env.reset()
        start = time.perf_counter()
        for _ in range(steps):
            if env.step(action).last():
                env.reset()
        return steps * env.control_timestep() / (time.perf_counter() - start)

    return run

"""Episodes in 1 process and in 2 workers, and the memory of a worker."""

from __future__ import annotations

import statistics
import time
from typing import Any

from rich.console import Console

from caregiver_mj.experiments.workers import run_jobs
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.studies.benchmark.effort import EPSILON, Effort
from caregiver_mj.studies.display import make_table
from caregiver_mj.tasks import load


def processes(effort: Effort, console: Console) -> dict[str, Any]:
    """Real-time factors of all processes together, building not counted, and megabytes."""
    jobs = [(seed, effort.seconds) for seed in range(effort.jobs)]
    results = {count: [result for _, result in run_jobs(run_episode, jobs, count)] for count in (1, 2)}
    factor = {
        count: count * sum(r["simulated"] for r in rows) / sum(r["seconds"] for r in rows)
        for count, rows in results.items()
    }
    figures = {
        "real_time_factor_1": factor[1],
        "real_time_factor_2": factor[2],
        "speed_up": factor[2] / factor[1],
        "megabytes_a_worker": statistics.median(row["megabytes"] for row in results[2]),
    }
    table = make_table("Jobs", "jobs", "x real time, together")
    for count in results:
        table.add_row(str(count), f"{factor[count]:.0f}")
    console.print(table)
    console.print(
        f"2 workers do {figures['speed_up']:.2f} x as much as 1; each takes {figures['megabytes_a_worker']:.0f} MB\n"
    )
    return figures


def run_episode(job: tuple[int, float]) -> dict[str, float]:
    """Runs an episode of a seed, for some simulated seconds, in a worker."""
    import psutil  # here, for it comes with the tests' packages only

    seed, length = job
    env = load("supervise", "paper", EPSILON, random=seed)
    policy = CaregiverPolicy(env)
    timestep = env.reset()
    start = time.perf_counter()
    while not timestep.last() and env.physics.time() < length:
        timestep = env.step(policy(timestep))
    seconds = time.perf_counter() - start
    return {
        "seconds": seconds,
        "simulated": env.physics.time(),
        "megabytes": psutil.Process().memory_info().rss / 1e6,
    }

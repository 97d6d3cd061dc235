"""The same run on our own pool and on a Dask cluster, both of this machine with two workers each."""

from __future__ import annotations

import logging
import time
from typing import Any

import pandas as pd
from rich.console import Console

from caregiver_mj.experiments.cluster import DaskExecutor
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.executors import Executor, LocalExecutor
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.plans.sets import house_set
from caregiver_mj.studies.benchmark.effort import EPSILON, Effort
from caregiver_mj.studies.display import make_table

_WORKERS = 2
_EPISODES = 20  # of `paper` in each house, in the grid: a job each


def executors(effort: Effort, console: Console) -> dict[str, Any]:
    """Houses a second on each, in turns so that both have the machine at its best and worst; starting workers counts.

    Raises:
        AssertionError: The rows are not the same.
    """
    import distributed  # here, for all other sections do without

    logging.getLogger("distributed").setLevel(logging.ERROR)  # of this process; workers talk on standard error
    plans = house_set(f"train-{effort.houses}")
    settings = Settings(plans, "grid", ("paper",), (EPSILON,), _EPISODES)
    seconds: dict[str, float] = {"local": 0.0, "dask": 0.0}
    tables = []

    def measure(name: str, executor: Executor, start: float) -> None:
        tables.append(evaluate(settings, executor=executor).episodes.drop(columns="wall_seconds"))
        seconds[name] += time.perf_counter() - start

    for name in ("local", "dask", "dask", "local"):
        start = time.perf_counter()
        if name == "local":
            measure(name, LocalExecutor(_WORKERS), start)
            continue
        options = {"n_workers": _WORKERS, "threads_per_worker": 1, "dashboard_address": "127.0.0.1:0"}
        with distributed.LocalCluster(**options) as cluster, DaskExecutor(cluster.scheduler_address) as executor:
            measure(name, executor, start)
    for found in tables[1:]:
        pd.testing.assert_frame_equal(found, tables[0], check_exact=True)
    rate = {name: 2 * effort.houses / taken for name, taken in seconds.items()}
    table = make_table(f"Executors, {_WORKERS} workers each", "executor", "houses", "houses/s", "x local")
    for name, houses in rate.items():
        table.add_row(name, str(effort.houses), f"{houses:.1f}", f"{houses / rate['local']:.2f}")
    console.print(table)
    console.print(f"{len(tables[0])} episodes on each, twice: the same rows\n")
    return {"houses": effort.houses, "houses_a_second": rate, "dask_over_local": rate["dask"] / rate["local"]}

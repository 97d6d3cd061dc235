"""The benchmark's command."""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import pathlib
from typing import Any

from caregiver_mj.experiments.versions import versions
from caregiver_mj.studies import benchmark
from caregiver_mj.studies.benchmark.building import building
from caregiver_mj.studies.benchmark.calls import parts
from caregiver_mj.studies.benchmark.closed_loop import closed_loop
from caregiver_mj.studies.benchmark.effort import QUICK, Effort
from caregiver_mj.studies.benchmark.executors import executors
from caregiver_mj.studies.benchmark.filming import filming
from caregiver_mj.studies.benchmark.foresight import foresight
from caregiver_mj.studies.benchmark.growth import growth
from caregiver_mj.studies.benchmark.hitches import hitches
from caregiver_mj.studies.benchmark.processes import processes
from caregiver_mj.studies.benchmark.prototype import PROTOTYPE
from caregiver_mj.studies.benchmark.rendering import rendering
from caregiver_mj.studies.display import make_console

SECTIONS = {
    "closed_loop": closed_loop,
    "hitches": hitches,
    "parts": parts,
    "building": building,
    "growth": growth,
    "foresight": foresight,
    "rendering": rendering,
    "filming": filming,
    "processes": processes,
    "executors": executors,
}


def main(arguments: list[str] | None = None) -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=benchmark.__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="shorter episodes and fewer repeats: about a minute")
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=list(SECTIONS), help="only these sections")
    parser.add_argument("--houses", type=int, metavar="N", help="houses to run on each executor")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args(arguments)
    effort = QUICK if options.quick else Effort()
    if options.houses is not None:
        effort = dataclasses.replace(effort, houses=options.houses)
    console = make_console()
    load = os.getloadavg()[0]
    figures: dict[str, Any] = {
        "versions": versions(),
        "cores": os.cpu_count(),
        "load_before": load,
        "effort": dataclasses.asdict(effort),
        "prototype": PROTOTYPE,
    }
    console.print(f"{os.cpu_count()} cores; load before the start {load:.1f}: figures are low if that is not near 0\n")
    for name in options.only:
        figures[name] = SECTIONS[name](effort, console)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")

"""The ablations' command."""

from __future__ import annotations

import argparse

import numpy as np

from caregiver_mj.children.tape import Tape
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.studies import ablations
from caregiver_mj.studies.ablations.study import Study
from caregiver_mj.studies.ablations.tables import print_safety, print_thresholds, print_variants


def main(arguments: list[str] | None = None) -> None:
    """Runs the study and prints its tables."""
    parser = argparse.ArgumentParser(description=ablations.__doc__)
    parser.add_argument("--house", default="paper", help="name or file of the floor plan")
    parser.add_argument("--episodes", type=int, default=2000, help="episodes for every variant and epsilon")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first episode")
    options = parser.parse_args(arguments)
    seeds = range(options.seed, options.seed + options.episodes)
    tapes = [Tape.draw_family(np.random.RandomState(seed), 1) for seed in seeds]
    study = Study(FloorPlan.load(options.house), tapes)
    alone = study.alone()
    for print_table in (print_variants, print_thresholds):
        print_table(study, alone)
        print()
    print_safety(study)

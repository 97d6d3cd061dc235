"""Runs the lives, a house and a caregiver a job."""

from __future__ import annotations

import functools
import pathlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from caregiver_mj.caregivers.registry import CAREGIVERS
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.sets import house_set
from caregiver_mj.studies.learning_child.life import KINDS, MEASURES, Job, Lives, live
from caregiver_mj.studies.trials import run_all

NONE = "none"
GUARDS = ("nearest", "paper", "foresight")

Houses = list[np.ndarray]  # of each house, (learners, columns)


class Grown:
    """The children that have grown up, by caregiver.

    Attributes:
        guards: Names of the caregivers, without `none`.
        childhood: Episodes with the caregiver.
        after: Episodes alone after these.
        exams: Ages at which it was asked what would happen if they were alone.
    """

    def __init__(self, jobs: Sequence[Job], lives: Sequence[Lives]):
        """Sorts them, a job and its lives each."""
        first = jobs[0]
        self.childhood, self.after, self.exams = first.childhood, first.after, first.exams
        self._lives: dict[str, list[Lives]] = {}
        for job, found in zip(jobs, lives, strict=True):
            self._lives.setdefault(job.caregiver, []).append(found)
        self.guards = tuple(name for name in self._lives if name != NONE)
        self.houses, self.learners = len(self._lives[NONE]), first.learners

    def course(self, caregiver: str, measure: str, kind: str) -> Houses:
        """A measure in every episode of every child of a kind, (learners, episodes) for each house."""
        which = MEASURES.index(measure), slice(None), KINDS.index(kind)
        return [one.course[which].T for one in self._lives[caregiver]]

    def mean(self, caregiver: str, measure: str, kind: str, first: int, end: int) -> Houses:
        """The mean over episodes [first, end), (learners,) for each house."""
        return [one[:, first:end].mean(axis=1) for one in self.course(caregiver, measure, kind)]

    def exam(self, caregiver: str, kind: str) -> Houses:
        """Damage in an episode alone at each of the ages, (learners, ages) for each house."""
        return [one.exams[:, KINDS.index(kind)].T for one in self._lives[caregiver]]


def measure(jobs: Sequence[Job], processes: int, folder: pathlib.Path | None) -> Grown:
    """Runs jobs; those whose lives are in the folder, if there is one, are not run again."""
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
    return Grown(jobs, run_all(functools.partial(_kept, folder), jobs, processes, "growing up"))


def jobs_of(houses: str, guards: Sequence[str], options: Mapping[str, Any], exams: Sequence[int]) -> list[Job]:
    """All jobs, house by house.

    Args:
        houses: Name of a set.
        guards: Names of caregivers.
        options: What else a `Job` is made of.
        exams: The ages of the exams; those after childhood are left out.

    Raises:
        CaregiverError: There is no such set or caregiver.
    """
    for name in guards:
        CAREGIVERS[name]
        if name == NONE:
            raise CaregiverError("children alone are there in any case: leave 'none' out")
    ages = tuple(age for age in exams if age <= options["childhood"])
    plans = [plan for plan in house_set(houses) if len(plan.hazards)]
    return [Job(plan.name, name, **options, exams=ages) for plan in plans for name in (NONE, *guards)]


def _kept(folder: pathlib.Path | None, job: Job) -> Lives:
    if folder is None:
        return live(job)
    ages = "-".join(map(str, job.exams))
    name = f"{job.house}_{job.caregiver}_{job.learners}_{job.childhood}_{job.after}_{ages}_{job.epsilon:g}_{job.seed}"
    file = folder / f"{name}.npz"
    if not file.is_file():
        lives = live(job)
        half = file.with_suffix(".tmp.npz")
        np.savez_compressed(half, course=lives.course.astype(np.float32), exams=lives.exams.astype(np.float32))
        half.replace(file)  # so that a file is there as a whole or not at all
    with np.load(file) as kept:
        return Lives(kept["course"].astype(float), kept["exams"].astype(float))

"""Runs the episodes in the grid, a house a job."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.experts import Elsewhere
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.caregivers.foresight.knows_goal import KnowsGoalCaregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.children.family import Family
from caregiver_mj.children.side_by_side import side_by_side
from caregiver_mj.experiments.seeds import episode_seed, episode_tapes
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import house_set
from caregiver_mj.studies.generalisation.priors import HOW, PRIORS, WHOSE, Telling, experts, tell, walks
from caregiver_mj.studies.trials import run_all

NONE, RULE, ALIKE, KNOWS = "none", "paper", "paper-alike", "knows-goal"
FAMILIES = ("1,0.25", "0.75,0.05")
CHILDREN = ("0.4", "drifter:0.4", "waverer:0.4", "0.25", "switcher:0.25")
CHANGES = (0.0, 0.005, 0.02, 0.1)  # probability in a timestep that epsilon changes, as `foresight` believes

Damages = dict[str, np.ndarray]  # by caregiver: of every episode, (episodes, families)


@dataclasses.dataclass(frozen=True)
class Job:
    """All that is done in one house.

    Attributes:
        house: Its name.
        learnt_in: Name of the set of houses in which the experts elsewhere walk.
        alone: Episodes of each novice alone.
        two: Episodes of each two children with each caregiver.
        changing: Episodes of each child that changes, or not, with each caregiver.
    """

    house: str
    learnt_in: str
    alone: int
    two: int
    changing: int


@dataclasses.dataclass(frozen=True)
class Found:
    """What came out in a house.

    Attributes:
        telling: How well P(safe) tells, by whose routes were learnt, and whether theta is a draw or the mean.
        two: Damage to two children; a column for each of `FAMILIES`.
        changing: Damage to one child; a column for each of `CHILDREN`.
    """

    telling: Mapping[tuple[str, str], Telling]
    two: Damages
    changing: Damages


def measure(houses: str, learnt_in: str, alone: int, two: int, changing: int, jobs: int) -> list[Found]:
    """Runs everything in every house of a set."""
    work = [Job(plan.name, learnt_in, alone, two, changing) for plan in house_set(houses)]
    return run_all(run, work, jobs, "in the grid")


def run(job: Job) -> Found:
    """Runs the episodes of a house: those that `evaluate` runs with seed 0."""
    plan, elsewhere = FloorPlan.load(job.house), _learnt(job.learnt_in)
    seen = walks(plan, job.alone)
    telling = {}
    for whose, how in PRIORS:
        theta = experts(whose, elsewhere).action_prior(plan, np.random.default_rng(0), how == HOW[0])
        telling[whose, how] = tell(plan, theta, seen)
    guards: dict[str, Callable[[FloorPlan], Caregiver | None]] = {
        NONE: lambda plan: None,
        **{whose: functools.partial(PaperCaregiver, experts=experts(whose, elsewhere)) for whose in WHOSE},
        ALIKE: functools.partial(PaperCaregiver, weighs_safety=False),
    }
    watchers: dict[str, Callable[[FloorPlan], Caregiver | None]] = {
        NONE: lambda plan: None,
        RULE: PaperCaregiver,
        **{foresight(change): functools.partial(ForesightCaregiver, change=change) for change in CHANGES},
        KNOWS: KnowsGoalCaregiver,
    }
    return Found(
        telling,
        {name: _damage(plan, make(plan), FAMILIES, job.two) for name, make in guards.items()},
        {name: _damage(plan, make(plan), CHILDREN, job.changing) for name, make in watchers.items()},
    )


def foresight(change: float) -> str:
    """What it is called if it believes in so much change."""
    return f"foresight, change {change:g}"


def _damage(plan: FloorPlan, caregiver: Caregiver | None, who: Sequence[str], episodes: int) -> np.ndarray:
    """Damage of every episode of every family, (episodes, families): all in one batch."""
    families = [Family.of(name) for name in who]
    tapes = [episode_tapes(episode_seed(0, episode), len(families[0])) for episode in range(episodes)]
    ledger = GridWorld(plan, side_by_side(plan, families, episodes), caregiver).run(tapes * len(families))
    return ledger.damage.reshape(len(families), episodes).T


@functools.lru_cache(maxsize=1)  # all jobs of a process learn in the same houses
def _learnt(houses: str) -> Elsewhere:
    return Elsewhere.in_houses(house_set(houses))

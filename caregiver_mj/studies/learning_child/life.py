"""The lives of children that learn: some episodes with a caregiver, then some alone."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.family import Family
from caregiver_mj.children.tape import Tape
from caregiver_mj.experiments.seeds import episode_seed, episode_tapes
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.studies.learning_child.learner import TOY, Learner

KINDS = ("careless", "wary")
MEASURES = ("damage", "toys", "return", "coverage", "known")


@dataclasses.dataclass(frozen=True)
class Job:
    """All children that grow up in one house with one caregiver.

    Attributes:
        house: Its name.
        caregiver: Its name.
        learners: Children of each kind.
        childhood: Episodes with the caregiver.
        after: Episodes alone after these.
        exams: Ages, in episodes, at which it is asked what would happen if it were alone now.
        epsilon: Share of random moves.
        seed: Seed of all chance.
    """

    house: str
    caregiver: str
    learners: int
    childhood: int
    after: int
    exams: tuple[int, ...]
    epsilon: float
    seed: int


@dataclasses.dataclass(frozen=True)
class Lives:
    """What came of them.

    Attributes:
        course: Each of `MEASURES` in every episode, (measures, episodes, kinds, learners). The coverage is the share of
            free cells that are visited until the damage is above 15; known is the share of the moves into stairwells
            and into tables with candles that are believed to do harm, after the episode.
        exams: Damage in an episode alone at each age, without learning in it, (ages, kinds, learners).
    """

    course: np.ndarray
    exams: np.ndarray


def live(job: Job) -> Lives:
    """Runs the lives of a job. Those with another caregiver, and of another kind, have the same chance."""
    plan = FloorPlan.load(job.house)
    learner = Learner(plan, job.epsilon, np.repeat([False, True], job.learners))
    guarded = GridWorld(plan, Family((learner,)), make_caregiver(job.caregiver, plan, job.seed))
    alone = GridWorld(plan, Family((learner,)), None)
    dangerous = _dangerous(plan)
    length = job.childhood + job.after
    course, exams = np.empty((len(MEASURES), length, len(KINDS), job.learners)), []
    for age in range(length + 1):
        if age in job.exams:
            exams.append(_exam(plan, learner, _tapes(job, length + age)))
        if age == length:
            break
        world = guarded if age < job.childhood else alone
        lesson = Lesson(world, learner)
        totals = world.run(_tapes(job, age), lesson).totals()
        lesson.over()
        toys, damage = totals["toys_reached"], totals["damage"]
        coverage = totals["cells_visited"] / len(plan.free_cells)
        known = learner.believed_harmful()[:, dangerous].mean(axis=1) if dangerous.any() else np.full(len(toys), np.nan)
        values = np.stack([damage, toys, TOY * toys - damage, coverage, known])
        course[:, age] = values.reshape(len(MEASURES), len(KINDS), job.learners)
    return Lives(course, np.array(exams).reshape(-1, len(KINDS), job.learners))


class Lesson:
    """Has a learner learn from every move of an episode, and once more from all of them in the end, the last one first.

    It is called after each timestep of a world with one child.
    """

    def __init__(self, world: GridWorld, learner: Learner):
        self._world, self._learner = world, learner
        self._damage = np.zeros(())
        self._moves: list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = []

    def __call__(self) -> None:
        """Learns from the last move."""
        world, damage = self._world, self._world.ledger.damage
        move = world.previous_cell[:, 0], world.previous_action[:, 0], damage - self._damage, world.child_cell[:, 0]
        self._moves.append(move)
        self._learner.learn(*move)
        self._damage = damage

    def over(self) -> None:
        """Goes over the whole episode, from its end."""
        for move in reversed(self._moves):
            self._learner.learn(*move)


def _dangerous(plan: FloorPlan) -> np.ndarray:
    """Which moves lead into a stairwell, or into a table on which a candle stands at first, (free cells, 4)."""
    _, target, index = plan.graph.moves
    return (target == Target.STAIRWELL) | ((target == Target.TABLE) & np.isin(index, plan.candle_tables))


def _exam(plan: FloorPlan, learner: Learner, tapes: Sequence[Sequence[Tape]]) -> np.ndarray:
    """Damage in an episode alone of children that stay as they are, (B,)."""
    return GridWorld(plan, Family((copy.copy(learner),)), None).run(tapes).damage


def _tapes(job: Job, number: int) -> Sequence[Sequence[Tape]]:
    """The chance of every child in an episode of a number, the same for both kinds."""
    seeds = [episode_seed(job.seed, 1000 * number + learner) for learner in range(job.learners)]
    return [episode_tapes(seed, 1) for seed in seeds] * len(KINDS)

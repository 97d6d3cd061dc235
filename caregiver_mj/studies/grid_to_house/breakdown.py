"""What the house costs, one thing after the other: the grid with ever more of what the robot lacks.

How long the robot takes is measured in the house; the handicaps are such that the grid's caregiver takes as long.
"""

from __future__ import annotations

import dataclasses
from typing import TypeVar

import pandas as pd

from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.side_by_side import side_by_side
from caregiver_mj.experiments.seeds import episode_seed, episode_tapes
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.studies.grid_to_house.grid import WatchedGrid
from caregiver_mj.studies.grid_to_house.handicap import Handicap, HandicappedGrid
from caregiver_mj.studies.grid_to_house.phases import DONE
from caregiver_mj.studies.grid_to_house.rows import caregiver_of

# Levels between the grid and the house, each with all that those before it have, and what is new in it, in words.
GRID = "grid"
STEPS = {"once": "deciding once", "driving": "driving", "waiting": "waiting"}
REMAINDER = "not explained"
ALONE = {"driving alone": "driving", "waiting alone": "waiting"}  # one handicap without the others

AnyGrid = TypeVar("AnyGrid", bound=HandicappedGrid)


@dataclasses.dataclass(frozen=True)
class InGrid:
    """Episodes of a run, with the caregiver in the grid.

    Attributes:
        settings: Of the run.
        count: Episodes in each house with each novice, whatever the run has.
    """

    settings: Settings
    count: int

    def damages(self, handicaps: dict[str, Handicap], house: str) -> dict[str, pd.DataFrame]:
        """Damage at every level in one house: a row an episode, a column an epsilon."""
        return {level: self.damage(handicap, house) for level, handicap in handicaps.items()}

    def damage(self, handicap: Handicap, house: str) -> pd.DataFrame:
        """The same with one handicap."""
        damage = self._run(HandicappedGrid, handicap, house).ledger.damage.reshape(-1, self.count).T
        index = pd.MultiIndex.from_product([[house], range(self.count)], names=["house", "episode"])
        return pd.DataFrame(damage, index, columns=[family.epsilon for family in self.settings.families])

    def phases(self, handicap: Handicap, house: str) -> pd.DataFrame:
        """Phases in one house with the `time` that each took, in thirds of a timestep."""
        log = self._run(WatchedGrid, handicap, house).phases
        table = pd.DataFrame(log, columns=["phase", "actions", "near", "shortest"])
        return table.assign(time=handicap.pace * table.actions + handicap.near * table.near)

    def _run(self, kind: type[AnyGrid], handicap: Handicap, house: str) -> AnyGrid:
        """A grid in which all episodes have been run, those of one epsilon after those of another."""
        settings, plan = self.settings, self.settings.plan_of[house]
        tapes = [episode_tapes(episode_seed(settings.seed, i), 1) for i in range(self.count)]
        children = side_by_side(plan, settings.families, self.count)
        caregiver = make_caregiver(caregiver_of(settings), plan, settings.seed)
        assert caregiver is not None  # it is one that acts
        world = kind(plan, children, caregiver, handicap)
        world.run(tapes * len(settings.families))
        return world


def pace(phases: pd.DataFrame) -> float:
    """How much longer the robot takes for what the grid's caregiver does, with no child in the house.

    Args:
        phases: The house's phases.
    """
    done = phases[(phases.end == DONE) & phases.clear.notna()]
    return float((done.clear + done.hand).sum() / done.grid.sum())


def near(phases: pd.DataFrame, in_grid: pd.DataFrame, handicap: Handicap, action_time: float) -> float:
    """How much longer an action near the child must take for the child to cost the grid's caregiver what it costs.

    Args:
        phases: The house's phases.
        in_grid: The grid's phases with some handicap.
        handicap: That one.
        action_time: Seconds of an action.

    Returns:
        `Handicap.near`.
    """
    done = phases[(phases.end == DONE) & phases.clear.notna()]
    lost = (done.house - done.hand - done.clear).mean() / action_time
    own = in_grid.assign(lost=handicap.pace * (in_grid.actions - in_grid.shortest)).groupby("phase")
    alike = done.phase.map(own.lost.mean()).mean(), done.phase.map(own.near.mean()).mean()  # of as many of each phase
    return float(max(0.0, (lost - alike[0]) / alike[1]))


def ladder(pace: float, near: float) -> dict[str, Handicap]:
    """The handicap of every level, and those of one thing alone."""
    return {
        GRID: Handicap(),
        "once": Handicap(once=True),
        "driving": Handicap(True, pace),
        "waiting": Handicap(True, pace, near),
        "driving alone": Handicap(pace=pace),
        "waiting alone": Handicap(near=near),
    }


def delay(phases: pd.DataFrame, in_grid: pd.DataFrame, action_time: float) -> float:
    """Mean seconds by which a phase in the grid takes longer than on the shortest way, for as many of each phase.

    Args:
        phases: The house's phases.
        in_grid: The grid's phases.
        action_time: Seconds of an action.
    """
    done = phases[phases.end == DONE]
    extra = (in_grid.time - in_grid.shortest) * action_time
    return float(done.phase.map(extra.groupby(in_grid.phase).mean()).mean())

"""The page's table of the physical house."""

from __future__ import annotations

import numpy as np
import pandas as pd

from caregiver_mj.experiments.intervals import Estimate, of_difference, of_ratio
from caregiver_mj.studies.documents import table
from caregiver_mj.studies.sensitivity.house import ALONE, OWN
from caregiver_mj.studies.sensitivity.tables import cells


def left(episodes: pd.DataFrame, robot: str) -> list[Estimate[float]]:
    """Share of the unassisted damage that is left with one of `ROBOTS`, at each epsilon."""
    return [of_ratio(_of(group, robot), _of(group, ALONE)) for _, group in _by_epsilon(episodes)]


def difference(episodes: pd.DataFrame, robot: str, column: str) -> list[Estimate[float]]:
    """What is measured with one of `ROBOTS` less that with `paper`, at each epsilon."""
    return [of_difference(_of(group, robot, column), _of(group, OWN, column)) for _, group in _by_epsilon(episodes)]


def house_table(episodes: pd.DataFrame) -> str:
    """Damage left by each robot, and what it changes beside `paper`."""
    rows = []
    for robot in dict.fromkeys(episodes.robot):
        if robot == ALONE:
            continue
        rows.append((_name(robot), "left", *cells(left(episodes, robot))))
        if robot != OWN:
            rows.append((_name(robot), "damage less `paper`'s", *cells(difference(episodes, robot, "damage"), "+")))
            rows.append((_name(robot), "toys less `paper`'s", *cells(difference(episodes, robot, "toys_reached"), "+")))
    return table(("robot", "", *(f"at {epsilon:g}" for epsilon, _ in _by_epsilon(episodes))), rows)


def _name(robot: str) -> str:
    caregiver, *rest = robot.split(" ", 1)
    return " ".join([f"`{caregiver}`", *rest])


def _by_epsilon(episodes: pd.DataFrame) -> pd.api.typing.DataFrameGroupBy:
    return episodes.groupby("epsilon", sort=False)


def _of(episodes: pd.DataFrame, robot: str, column: str = "damage") -> np.ndarray:
    """A column of one robot, by episode."""
    return episodes[episodes.robot == robot].sort_values("episode")[column].to_numpy(float)

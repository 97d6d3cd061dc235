"""Predictions and what became of them, sorted by what was predicted: sums over the episodes of a house."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from caregiver_mj.children.family import Family
from caregiver_mj.experiments.seeds import episode_seed, episode_tapes
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.studies.calibration.children import Bystander, families, has_company
from caregiver_mj.studies.calibration.watch import Questions, Watched, watch_children

HORIZONS = (1, 5, 15)  # timesteps
HARMLESS, SAFE = "harmless", "P(safe)"  # what is asked of a stretch of timesteps, and the paper's number for it
# Ends of the bins of what is predicted. Most collisions are improbable, so the lower ones are narrow.
EDGES = np.array([0, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0])
BINS = len(EDGES) - 1


@dataclasses.dataclass(frozen=True)
class House:
    """A house to watch children in.

    Attributes:
        plan: The house.
        episodes: How many of each child.
        seed: Of the run to which they belong.
    """

    plan: FloorPlan
    episodes: int
    seed: int = 0


def tally_house(house: House) -> pd.DataFrame:
    """Watches all children in a house.

    Returns:
        A row for every child (`family`), horizon, kind of question and bin that occurs: how often (`count`), and the
        sums of what was `predicted`, of whether it `happened`, and of the `square` of the difference.
    """
    tapes = [episode_tapes(episode_seed(house.seed, episode), 1) for episode in range(house.episodes)]
    parts = []
    for company in (False, True):
        names = [name for name in families() if has_company(name) == company]
        children = [Family.parse(name) for name in names]
        beside = Bystander(house.plan) if company else None
        watched = watch_children(house.plan, children, tapes, HORIZONS, beside)
        parts.append(tally(watched, Questions.of(house.plan).kinds, names, house.episodes))
    return pd.concat(parts, ignore_index=True).assign(house=house.plan.name)


def tally(watched: Watched, kinds: np.ndarray, names: Sequence[str], episodes: int) -> pd.DataFrame:
    """Sorts what was watched.

    Args:
        watched: Children of several kinds, as many episodes of each.
        kinds: What each question is about, (Q,).
        names: What the children are called.
        episodes: How many of each there are.
    """
    rows: list[dict[str, Any]] = []
    for number, horizon in enumerate(HORIZONS):
        happened = watched.happened(horizon)
        times = len(happened)
        predicted, possible = watched.predicted[number, :times], watched.possible[number, :times]
        for place, name in enumerate(names):
            some = slice(place * episodes, (place + 1) * episodes)
            for kind in dict.fromkeys(kinds):
                asked = kinds == kind
                which = possible[:, some, asked]  # what cannot happen is no prediction
                found = predicted[:, some, asked][which], happened[:, some, asked][which]
                rows += _rows(*found, family=name, horizon=horizon, kind=kind)
            (anything,) = np.flatnonzero(kinds == "anything")
            harmless = ~happened[:, some, anything].ravel()
            for kind, stated in ((HARMLESS, 1 - predicted[:, some, anything]), (SAFE, watched.safe[:times, some])):
                rows += _rows(stated.ravel(), harmless, family=name, horizon=horizon, kind=kind)
    return pd.DataFrame(rows)


def _rows(predicted: np.ndarray, happened: np.ndarray, **what: Any) -> Iterator[dict[str, Any]]:
    predicted = predicted.astype(float)
    number = np.clip(np.searchsorted(EDGES, predicted, side="right") - 1, 0, BINS - 1)
    sums = {
        "count": np.ones(len(number)),
        "predicted": predicted,
        "happened": happened.astype(float),
        "square": (predicted - happened) ** 2,
    }
    sums = {name: np.bincount(number, values, BINS) for name, values in sums.items()}
    for place in np.flatnonzero(sums["count"]).tolist():
        yield what | {"bin": place} | {name: float(values[place]) for name, values in sums.items()}

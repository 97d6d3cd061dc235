"""Blocking in the house and in the grid: how often the caregiver comes in between, and what that does to the damage.

The house's episodes are those of a finished run, or run here. The same children are then in the grid as it is, where a
child gets to its cell at once, and in the grid in which the caregiver does one, two or all three of its actions while
the children are on their way (`GridWorld(..., meanwhile=1)`), which is like the house: there the robot sees after 7 %
of a move where it leads, and the child is at a stairwell's edge, a table or a robot in its way after 35 to 50 % of it.
"""

from __future__ import annotations

import argparse

import numpy as np
import pandas as pd

from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.family import Family
from caregiver_mj.experiments.settings import episode_tapes
from caregiver_mj.grid.world import CAREGIVER_ACTIONS, GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import houses_named
from caregiver_mj.viz.report.words import Table, number
from studies import contacts
from study import Parser

COLUMNS = {
    "damage": "damage",
    "damage_stairwell": "at stairs",
    "damage_candle": "at candles",
    "damage_table": "at bare tables",
    "moves_blocked": "moves blocked",
    "moves_blocked_stairwell": "into a stairwell",
    "moves_entered": "cut off",
    "moves_entered_blocked": "and blocked",
    "moves_held_up": "held up",
}
_WORLDS = ("grid", *(f"grid, {n} meanwhile" for n in range(1, CAREGIVER_ACTIONS + 1)), "house")


def add_options(parser: Parser) -> None:
    """Declare the options."""
    contacts.add_options(parser)


def run(options: argparse.Namespace) -> None:
    """Run the study; print its tables."""
    rows = compare(contacts.episodes_of(options), options.caregiver)
    print("\n".join(table.markdown() for table in tables(rows)))


def in_grid(plan: FloorPlan, family: str, caregiver: str, seeds: list[int], meanwhile: int) -> pd.DataFrame:
    """The same episodes in the grid, a row each, with `COLUMNS`."""
    children = Family.parse(family)
    world = GridWorld(plan, children, make_caregiver(caregiver, plan), meanwhile=meanwhile)
    totals = world.run([episode_tapes(seed, len(children)) for seed in seeds]).totals()
    return pd.DataFrame({column: totals[column] for column in COLUMNS})


def compare(episodes: pd.DataFrame, caregiver: str) -> pd.DataFrame:
    """The rows of every world, with its name in `where`, and the house's name in `house`."""
    found = []
    for (house, family), group in episodes.groupby(["house", "family"], sort=False):
        (plan,) = houses_named([house])
        key = {"house": house, "family": family, "episode": group.episode.to_numpy()}
        found.append(group[list(COLUMNS)].reset_index(drop=True).assign(where="house", **key))
        for meanwhile in range(CAREGIVER_ACTIONS + 1):
            rows = in_grid(plan, family, caregiver, group.seed.tolist(), meanwhile)
            found.append(rows.assign(where=_WORLDS[meanwhile], **key))
    return pd.concat(found, ignore_index=True)


def tables(rows: pd.DataFrame) -> list[Table]:
    """Means of an episode in each world, and how far each grid is from the house."""
    means = rows.groupby("where")[list(COLUMNS)].mean()
    shown = [(where, *(number(means.loc[where, c], 2) for c in COLUMNS)) for where in _WORLDS]
    apart = rows.pivot(index=["house", "family", "episode"], columns="where", values="damage")
    errors = apart.drop(columns="house").sub(apart["house"], axis=0)
    far = [
        (where, number(-errors[where].mean(), 2, "+"), number(errors[where].abs().mean(), 2), _share(errors[where]))
        for where in _WORLDS[:-1]
    ]
    count = f"{len(apart)} episodes in {rows.house.nunique()} houses"
    return [
        Table(f"Means of an episode, {count}", ("", *COLUMNS.values()), shown),
        Table("The house's damage less the grid's", ("", "mean", "mean size", "episodes with the same damage"), far),
    ]


def _share(errors: pd.Series) -> str:
    return f"{number(100 * float(np.mean(errors == 0)), 0)} %"

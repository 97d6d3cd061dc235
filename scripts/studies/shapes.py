"""What caregivers leave in the physical house and in the grid, by the shape of the house.

The episodes in the house are those of a finished run of `caregiver-mj evaluate --world house`; the same are run in the
grid. Houses drawn by hand count as one shape. With `--slowed N` the first N episodes of every cell are also run
in the grid with a caregiver as slow as the robot: what the house costs beyond that is not its speed.
"""

from __future__ import annotations

import argparse
import copy
import dataclasses
import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.percept import Pace
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.children.walk import novice_timestep
from caregiver_mj.errors import CaregiverError, check_integer
from caregiver_mj.experiments import intervals, two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.interventions.verb import CLOSE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import KINDS, NOTHING
from caregiver_mj.plans.rooms import SHAPES
from caregiver_mj.plans.sets import houses_named
from caregiver_mj.policy.pace import robot_pace
from caregiver_mj.robot.embodiment import DEFAULT
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.tasks.base import CONTROL_TIMESTEP
from study import Page, Parser, read_run, run_all, run_episodes

COUNTS = ("strikes", "strikes_surface", "candles_dropped")
SLOWED = {"pace": False, "separation": True}  # columns of damage, and whether the caregiver slows down beside a child
TICKS = 5  # into which a step of the caregiver is divided
# Attributes of a world that a caregiver's action changes.
_CHANGED = "caregiver_cell", "holding", "candle_table", "state", "orders", "done", "ledger"
PARTS = "interventions", "interventions_done", "moves_blocked_stairwell", "moves_blocked_free", "toys_reached"


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add_file("run", "a finished run in the house", "DIR", required=True)
    parser.add("slowed", 0, "episodes of every cell that are also run at the robot's speed", metavar="N")
    parser.add_jobs()


def run(options: argparse.Namespace) -> Page:
    """Run the same episodes in the grid; return the page."""
    houses, settings = read_run(options.run)
    if settings.world != "house" or "none" not in settings.caregivers:
        raise CaregiverError(f"'{options.run}' must hold a run in the house with 'none' among its caregivers")
    check_integer("--slowed", options.slowed, 0, settings.episodes)
    slow = run_slowed(houses, settings, options.slowed, options.jobs) if options.slowed else None
    grid = run_episodes(dataclasses.replace(settings, world="grid"), options.jobs)
    cells = pd.read_parquet(options.run / "houses.parquet")
    return page(houses, grid, cells[cells.caregiver != "none"], settings, slow)


def _shape_of(name: str) -> str:
    """The shape of a generated house, such as `hall` of `hall-17`; else "home" or "house"."""
    shape = name.rpartition("-")[0]
    if shape in SHAPES:
        return shape
    return "home" if name.startswith("home-") else "house"


class SlowedGrid(GridWorld):
    """The grid with a caregiver as slow as the robot, for one episode of one child at a time.

    It takes the robot's time to set off and stop, to walk a cell and to handle things; what it does is done once that
    is over. After every move of the child it thinks again, and sets off anew if it then wants something else.
    """

    def __init__(self, plan: FloorPlan, family: ChildGroup, caregiver: Caregiver, pace: Pace, separates: bool = True):
        """Prepare episodes.

        Args:
            plan: The house.
            family: The child.
            caregiver: The caregiver, which knows its pace.
            pace: The time that its actions take.
            separates: Whether it also slows down beside the child, as its pace says.
        """
        super().__init__(plan, family, caregiver)
        self._pace = caregiver.pace = pace if separates else dataclasses.replace(pace, beside=())
        self._cells = np.array(plan.caregiver_cells)

    def reset(self, streams: Sequence[Sequence[RandomStream]]) -> None:
        super().reset(streams)
        if self.child_cell.shape != (1, 1):
            raise CaregiverError(f"streams must be of one episode of one child, got {self.child_cell.shape}")
        self._aim: tuple[Any, ...] | None = None  # the state that it works towards, for so many ticks yet
        self._left, self._walks = 0, False

    def care(self, caregiver: Caregiver) -> None:
        """Run the caregiver in one novice timestep."""
        ticks, stands = round(TICKS * self._pace.cells), False
        for tick in range(ticks):
            self.time_left = np.full(1, 1.0 - tick / ticks)
            if tick == 0 or not (self._left or stands):
                stands = self._decide(caregiver)
            if stands:
                continue
            self._left -= 1
            if self._left == 0:
                before = self.caregiver_cell[0]
                self._act(caregiver, lambda after: after == self._aim)
                self._walks, self._aim = self.caregiver_cell[0] != before, None

    def _decide(self, caregiver: Caregiver) -> bool:
        """Begin what it wants now, or go on with it; return whether it wants nothing that changes the world."""
        before, held = self._state(), self.holding[0]
        after, verb = self._act(caregiver, lambda after: after == before)
        if after == before:
            self._aim, self._left, self._walks = None, 0, False
        elif after != self._aim:
            self._walks &= self._aim is None  # else it stops on its way
            self._aim, pace = after, self._pace
            if after[0] != before[0]:
                time = self._way(before[0], after[0]) + (0.0 if self._walks else pace.start)
            elif after[1] != held:
                time = pace.get if held == NOTHING else pace.place
            else:
                time = pace.close if verb == CLOSE else pace.pick_up
            self._left = max(1, round(TICKS * time))
        return after == before

    def _act(self, caregiver: Caregiver, accepts: Callable[[tuple[Any, ...]], bool]) -> tuple[tuple[Any, ...], str]:
        """Run an action of the caregiver, taken back unless its outcome is accepted; return that, and its verb."""
        kept = {name: copy.deepcopy(getattr(self, name)) for name in _CHANGED}
        self.act_caregiver(caregiver)
        after, verb = self._state(), str(self.orders.verb[0])
        if not accepts(after):
            vars(self).update(kept)
        return after, verb

    def _state(self) -> tuple[Any, ...]:
        """The caregiver's cell, what it holds, where the candles are, and what has become of the hazards."""
        return (
            int(self.caregiver_cell[0]),
            int(self.holding[0]),
            self.candle_table[0].tolist(),
            self.state[0].tolist(),
        )

    def _way(self, start: int, end: int) -> float:
        """Return the steps that it takes from a cell to the next one."""
        here, child = self._cells[start], self._cells[self.child_cell[0, 0]]
        return float(self._pace.way(self._cells[end] - here, child - here))


@functools.lru_cache(maxsize=2)
def pace_of(plan: FloorPlan, robot: str = DEFAULT) -> Pace:
    """Return the pace of a robot, by its name, in a house."""
    seconds = novice_timestep(CONTROL_TIMESTEP, plan.cell_size)
    return robot_pace(Navigator(plan, find_embodiment(robot)), seconds, CONTROL_TIMESTEP)


def slowed(job: tuple[str, str, str, int, bool, str]) -> float:
    """Return the damage of an episode in a `SlowedGrid`: of house, caregiver, child, seed, separation and robot."""
    house, name, child, seed, separates, robot = job
    (plan,) = houses_named([house])
    caregiver = make_caregiver(name, plan)
    assert caregiver is not None  # it is not "none"
    world = SlowedGrid(plan, ChildGroup.of(child), caregiver, pace_of(plan, robot), separates)
    return float(world.run([RandomStream.draw_group(np.random.RandomState(seed), 1)]).damage[0])


def run_slowed(house: pd.DataFrame, settings: Settings, episodes: int, jobs: int) -> pd.DataFrame:
    """Run the first episodes of every cell with a slowed caregiver; return their rows, with columns of `SLOWED`.

    Raises:
        CaregiverError: There are several children in a house, or the robot does not see everything.
    """
    if settings.sight != "all" or (house.children != 1).any():
        raise CaregiverError("--slowed must be of a run with one child in each house, and with sight 'all'")
    rows = house[(house.caregiver != "none") & (house.episode < episodes)].copy()
    keys = ["house", "caregiver", "family", "seed"]
    for column, separates in SLOWED.items():  # those of a house one after the other, so that its tables are made once
        work = [(*row, separates, settings.embodiment) for row in rows[keys].itertuples(index=False, name=None)]
        rows[column] = run_all(slowed, work, jobs, column)
    return rows


def page(
    house: pd.DataFrame,
    grid: pd.DataFrame,
    cells: pd.DataFrame,
    settings: Settings,
    slow: pd.DataFrame | None = None,
) -> Page:
    """Return the page of the same episodes in both worlds, and of what `run_slowed` has found."""
    drawn = {plan.name for plan in houses_named(["drawn-10"])}
    of_shape = {name: "drawn by hand" if name in drawn else _shape_of(name) for name in dict.fromkeys(house.house)}
    groups = {where: [name for name in of_shape if of_shape[name] == where] for where in of_shape.values()}
    caregivers = [name for name in settings.caregivers if name != "none"]
    lines = [
        _line(where, parts, caregiver, house, grid)
        for where, parts in {**{where: [names] for where, names in groups.items()}, "all": [*groups.values()]}.items()
        for caregiver in caregivers
    ]
    harmed = cells[cells.harm_verdict == "more"]
    values = {
        "settings": settings,
        "lines": lines,
        "parts": [
            (part, [table[table.caregiver == name][part].mean() for name in caregivers for table in (grid, house)])
            for part in (*(f"damage_{kind.name}" for kind in KINDS), *PARTS)
        ],
        "caregivers": caregivers,
        "counts": {name: int(house.loc[house.caregiver != "none", name].sum()) for name in COUNTS},
        "with_robot": int((house.caregiver != "none").sum()),
        "alike": _alike(house, grid),
        "cells": {name: int((cells.caregiver == name).sum()) for name in caregivers},
        "slowed": [] if slow is None else slowed_lines({**groups, "all": [*of_shape]}, caregivers, slow, grid),
        "slow": 0 if slow is None else len(slow),
        "harm": {name: [*harmed.house[harmed.caregiver == name]] for name in caregivers},
    }
    return Page(values)


def _line(
    where: str, groups: Sequence[Sequence[str]], caregiver: str, house: pd.DataFrame, grid: pd.DataFrame
) -> dict[str, Any]:
    """Return what a caregiver leaves in some houses, in groups of one shape each, in both worlds."""
    names = [name for group in groups for name in group]
    alone = house[house.house.isin(names) & (house.caregiver == "none")].damage.mean()
    ours, theirs = ([_damage(table, name, caregiver) for name in names] for table in (house, grid))
    means = [sum(found.mean() for found in damage) / len(names) for damage in (theirs, ours)]
    return {
        "shape": where,
        "houses": len(names),
        "caregiver": caregiver,
        "alone": alone,
        "means": means,
        "ratio": of_ratio(ours, theirs, [len(group) for group in groups]),
    }


def of_ratio(ours: Sequence[np.ndarray], theirs: Sequence[np.ndarray], sizes: Sequence[int]) -> Estimate[float]:
    """Return the ratio of the means over houses, an array of episodes each, of so many houses of every shape, in turn.

    Its interval is over the episodes of a single house, over houses within their shapes if there are several of each of
    several shapes, else over houses.
    """
    if len(ours) == 1:
        return intervals.of_ratio(ours[0], theirs[0])
    if len(sizes) == 1 or min(sizes) == 1:
        return two_level.of_ratio(ours, theirs)
    return of_stratified_ratio(two_level.house_means(ours), two_level.house_means(theirs), sizes)


def of_stratified_ratio(ours: np.ndarray, theirs: np.ndarray, sizes: Sequence[int]) -> Estimate[float]:
    """Return the ratio of two means, (n,) each, of a sample with a fixed number of houses of every shape, in turn.

    What differs from shape to shape is no chance: the combined ratio estimate with its linearised variance (Cochran,
    Sampling Techniques, 1977, section 6.11), and Student's t. There must be two houses of each shape, or more.
    """
    ratio = ours.sum() / theirs.sum() if theirs.any() else np.nan
    each = np.split(ours - ratio * theirs, np.cumsum(sizes)[:-1])
    variance = sum(len(errors) * errors.var(ddof=1) for errors in each)
    reach = stats.t.ppf(0.5 + intervals.CONFIDENCE / 2, len(ours) - len(sizes)) * np.sqrt(variance) / theirs.sum()
    return Estimate(ratio, max(0.0, ratio - reach), ratio + reach)


def slowed_lines(
    groups: dict[str, list[str]], caregivers: Sequence[str], slow: pd.DataFrame, grid: pd.DataFrame
) -> list[dict[str, Any]]:
    """Return the mean damage in the slowed episodes in every world, and what the house adds to it, of every group."""
    keys = ["house", "caregiver", "family", "episode"]
    both = slow.merge(grid[[*keys, "damage"]], on=keys, suffixes=("", "_grid"))
    both["more"] = both.damage - both.separation
    lines = []
    for where, names in groups.items():
        for caregiver in caregivers:
            own = both[both.house.isin(names) & (both.caregiver == caregiver)]
            more = two_level.of_mean([house.to_numpy() for _, house in own.groupby("house", sort=False).more])
            means = [own[column].mean() for column in ("damage_grid", *SLOWED, "damage")]
            lines.append({"shape": where, "caregiver": caregiver, "means": means, "more": more})
    return lines


def _damage(table: pd.DataFrame, house: str, caregiver: str) -> Any:
    """Return the mean damage over the children of every episode in a house, (episodes,)."""
    own = table[(table.house == house) & (table.caregiver == caregiver)]
    return own.groupby("episode").damage.mean().to_numpy()


def _alike(house: pd.DataFrame, grid: pd.DataFrame) -> tuple[int, int]:
    """Return how many episodes alone have the same damage in both worlds, and of how many."""
    keys = ["house", "family", "episode"]
    both = house[house.caregiver == "none"].merge(grid[grid.caregiver == "none"], on=keys, suffixes=("", "_grid"))
    return int((both.damage == both.damage_grid).sum()), len(both)

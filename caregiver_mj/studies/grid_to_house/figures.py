"""The figures of damage: every house, and what leads from the grid to the house."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.studies.grid_to_house.breakdown import GRID, REMAINDER, STEPS
from caregiver_mj.studies.grid_to_house.ratios import by_house, ratio, steps
from caregiver_mj.studies.grid_to_house.results import GOAL, Results
from caregiver_mj.studies.grid_to_house.tables import number
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.style import INK, STYLE

_STYLE = STYLE | {"axes.grid": False, "axes.titlesize": 10, "axes.titlelocation": "left"}
_MOST = 2.5  # ratio up to which houses are drawn; those above it are at the edge
_SPREAD = 0.28  # over how much of its place a column of houses is spread
_AREA = 60.0  # of the point of a house that has the mean share of the damage, points²
_GRID_COLOUR = (176, 184, 196)
_STEP_COLOURS = dict(
    zip((*STEPS, REMAINDER), (colours.BIN, colours.ROBOT, colours.TODDLER, (148, 156, 168)), strict=True)
)


def draw_houses(results: Results) -> Figure:
    """The ratio in every house, and over all of them."""
    epsilons = results.rows.epsilons
    with mpl.rc_context(_STYLE):
        figure = Figure((7.2, 3.8), layout="constrained", facecolor="white")
        axes = figure.subplots()
        axes.set_title("Damage in the house over damage in the grid, with the caregiver")
        axes.axhline(1, color=INK, linewidth=0.8)
        axes.axhline(1 + GOAL, color=INK, linewidth=0.8, linestyle=":")
        axes.text(len(epsilons) + 0.5, 1 + GOAL, f" {1 + GOAL:.2f}", va="center", color=INK)
        for i, chosen in enumerate([*([e] for e in epsilons), list(epsilons)]):
            ours, theirs = (results.rows.damage(world, "paper")[chosen] for world in ("house", "grid"))
            _draw_points(axes, i, by_house(ours, theirs).dropna())
            _draw_estimate(axes, i, ratio(ours, theirs))
        axes.set_xticks(range(len(epsilons) + 1), [*(f"epsilon {e:g}" for e in epsilons), "all"])
        axes.set_xlim(-0.5, len(epsilons) + 0.5)
        axes.set_ylim(0, _MOST * 1.03)
        axes.set_xlabel("A point is a house, its area the house's share of the grid's damage; ^ is above.", color=INK)
    return figure


def _draw_points(axes: Axes, place: int, houses: pd.DataFrame) -> None:
    """The houses of `by_house`."""
    sideways = place + _SPREAD * np.linspace(-1, 1, max(2, len(houses)))[: len(houses)]
    area = _AREA * houses.weight * len(houses)
    outside = (houses.ratio > _MOST).to_numpy()
    for marker, shown in (("o", ~outside), ("^", outside)):
        height = houses.ratio.clip(upper=_MOST)[shown]
        axes.scatter(sideways[shown], height, area[shown], color=colours.unit(colours.ROBOT), alpha=0.45,
                     linewidths=0, marker=marker)  # fmt: skip


def _draw_estimate(axes: Axes, place: int, found: Estimate) -> None:
    low, high = max(0.0, found.low), min(2 * _MOST, found.high)
    axes.vlines(place, low, high, color=INK, linewidth=1.6)
    axes.plot(place, found.value, "D", color=INK, markersize=5)
    axes.text(place + 0.06, found.value, f" {number(found.value)}", va="bottom", color=INK, fontweight="bold")


def draw_steps(results: Results) -> Figure:
    """What leads from the grid to the house, at each epsilon and in all."""
    epsilons, found = results.rows.epsilons, steps(results)
    titles = [*(f"epsilon {e:g}" for e in epsilons), "all"]
    with mpl.rc_context(_STYLE):
        figure = Figure((7.2, 4.8), layout="constrained", facecolor="white")
        rows = -(-len(titles) // 3)
        grid = figure.subplots(rows, 3, sharex=True, sharey=True, squeeze=False)
        for i, (axes, title) in enumerate(zip(grid.flat, titles, strict=False)):
            axes.set_title(title)
            each = {
                name: Estimate(*(float(ends[i]) for ends in by_epsilon)) if i < len(epsilons) else whole
                for name, (by_epsilon, whole) in found.items()
            }
            _draw_waterfall(axes, each)
        for axes in list(grid.flat)[len(titles) :]:
            axes.set_visible(False)
        tops = [1 + sum(float(np.nan_to_num(by[0][i])) for by, _ in found.values()) for i in range(len(epsilons))]
        grid.flat[0].set_ylim(0, max(1.5, min(_MOST, 1.25 * max(tops, default=1.0))))
        figure.supylabel("damage, in units of the grid's", color=INK, fontsize=9)
    return figure


def _draw_waterfall(axes: Axes, found: dict[str, Estimate]) -> None:
    """The grid's damage, what each step adds to it with its interval, and the house's damage."""
    axes.axhline(1, color=INK, linewidth=0.6)
    axes.axhline(1 + GOAL, color=INK, linewidth=0.6, linestyle=":")
    axes.bar(0, 1, color=colours.unit(_GRID_COLOUR))
    level = 1.0
    for i, (name, step) in enumerate(found.items(), 1):
        value = float(np.nan_to_num(step.value))
        axes.bar(i, value, bottom=level, color=colours.unit(_STEP_COLOURS[name]))
        low, high = (np.clip(level + end, -9, 9) for end in (step.low, step.high))
        axes.vlines(i, low, high, color=INK, linewidth=1.0)
        top = max(level, level + value, high) + 0.02
        axes.text(i, top, number(step.value, "+"), ha="center", color=INK, fontsize=7, clip_on=True)
        level += value
    last = len(found) + 1
    axes.bar(last, level, color=colours.unit(colours.DAMAGE))
    axes.text(last, level + 0.02, number(level), ha="center", color=INK, fontsize=8, fontweight="bold")
    names = [GRID, *(STEPS.get(name, name) for name in found), "house"]
    axes.set_xticks(range(last + 1), names, rotation=60, ha="right", rotation_mode="anchor", fontsize=7)

"""The figures of damage: every house, and what leads from the grid to the house."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.studies.grid_to_house.breakdown import GRID, REMAINDER, STEPS
from caregiver_mj.studies.grid_to_house.ratios import at, by_house, ratio, steps
from caregiver_mj.studies.grid_to_house.results import GOAL, Results
from caregiver_mj.studies.grid_to_house.tables import number
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.style import FAINT, INK, STYLE

_STYLE = STYLE | {"axes.grid": False, "axes.titlesize": 10, "axes.titlelocation": "left"}
_MOST = 2.5  # ratio up to which is drawn; houses above it are at the edge
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
            ours, theirs = (damage[chosen] for damage in results.rows.cared)
            _draw_points(axes, i, by_house(ours, theirs).dropna())
            _draw_estimate(axes, i, ratio(ours, theirs))
        axes.set_xticks(range(len(epsilons) + 1), [*(f"epsilon {e:g}" for e in epsilons), "all"])
        axes.set_xlim(-0.5, len(epsilons) + 0.5)
        axes.set_ylim(0, _MOST * 1.03)
        axes.set_xlabel(
            "A point is a house with damage in the grid, its area the house's share of it; ^ is above.", color=INK
        )
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


def _draw_estimate(axes: Axes, place: int, found: Estimate[float]) -> None:
    low, high = max(0.0, found.low), min(2 * _MOST, found.high)
    axes.vlines(place, low, high, color=INK, linewidth=1.6)
    axes.plot(place, found.value, "D", color=INK, markersize=5)
    axes.text(place + 0.06, found.value, f" {number(found.value)}", va="bottom", color=INK, fontweight="bold")


def draw_steps(results: Results) -> Figure:
    """What leads from the grid to the house, at each epsilon and in all."""
    epsilons, found = results.rows.epsilons, steps(results)
    with mpl.rc_context(_STYLE):
        figure = Figure((7.2, 4.8), layout="constrained", facecolor="white")
        grid = figure.subplots(-(-(len(epsilons) + 1) // 3), 3, sharex=True, sharey=True, squeeze=False)
        for axes in grid.flat:
            axes.set_visible(False)
        extent = [1.0, 1 + GOAL]
        for i, axes in zip(range(len(epsilons) + 1), grid.flat, strict=False):
            whole = i == len(epsilons)
            axes.set_visible(True)
            axes.set_title("all" if whole else f"epsilon {epsilons[i]:g}")
            extent += _draw_waterfall(
                axes, {name: each[1] if whole else at(each[0], i) for name, each in found.items()}
            )
        grid.flat[0].set_ylim(max(0.0, min(extent) - 0.15), min(_MOST, max(extent) + 0.25))
        figure.supylabel("damage, in units of the grid's", color=INK, fontsize=9)
    return figure


def _draw_waterfall(axes: Axes, found: dict[str, Estimate[float]]) -> list[float]:
    """What each step adds to the grid's damage, with its interval; returns the levels."""
    axes.axhline(1, color=INK, linewidth=0.6)
    axes.axhline(1 + GOAL, color=INK, linewidth=0.6, linestyle=":")
    levels, last = [1.0], len(found) + 1
    for i, (name, step) in enumerate(found.items(), 1):
        level, value = levels[-1], float(np.nan_to_num(step.value))
        axes.bar(i, value, bottom=level, color=colours.unit(_STEP_COLOURS[name]))
        axes.vlines(i, *(np.clip(level + end, -9, 9) for end in (step.low, step.high)), color=INK, linewidth=1.0)
        _write_above(axes, i, number(step.value, "+"))
        axes.hlines(level + value, i - 0.4, i + 1.4 * (i < last), color=FAINT, linewidth=0.6)
        levels.append(level + value)
    for place, level in ((0, 1.0), (last, levels[-1])):
        axes.plot(place, level, "D", color=INK, markersize=4.5)
        _write_above(axes, place, number(level))
    names = [GRID, *(STEPS.get(name, name) for name in found), "house"]
    axes.set_xticks(range(last + 1), names, rotation=60, ha="right", rotation_mode="anchor", fontsize=7)
    return levels


def _write_above(axes: Axes, place: float, text: str) -> None:
    """Writes below the upper edge, where no interval makes it illegible."""
    axes.text(place, 0.94, text, transform=axes.get_xaxis_transform(), ha="center", color=INK, fontsize=7,
              bbox={"facecolor": "white", "edgecolor": "none", "pad": 1})  # fmt: skip

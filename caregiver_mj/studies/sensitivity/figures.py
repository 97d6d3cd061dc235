"""The page's figure."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.studies.sensitivity.conditions import LINEAR, NEAREST, PAPER, SPEEDS, STILL, WEIGHTED
from caregiver_mj.studies.sensitivity.places import Place
from caregiver_mj.studies.sensitivity.results import Results
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.style import INK, STYLE

_COLOURS = (colours.ROBOT, colours.BIN, colours.CANDLE, colours.STAIRWELL)
_TOP = 1.2  # share left at which an axis ends; there is room for the legend above what is measured
_SPREAD = 0.6  # of the room between two epsilons

Series = dict[str, list[Estimate[float]]]


def draw(results: Results) -> Figure:
    """Damage left, a row of panels for each place, a column for each of four things that are varied."""
    panels = [_series(results, place) for place in results.places]
    titles = list(panels[0])
    with mpl.rc_context(STYLE):
        figure = Figure((3.0 * len(titles), 2.4 * len(panels)), layout="constrained")
        grid = figure.subplots(len(panels), len(titles), sharex=True, sharey=True, squeeze=False)
        for row, place, found in zip(grid, results.places, panels, strict=True):
            for axes, title in zip(row, titles, strict=True):
                _panel(axes, found[title])
            row[0].set_ylabel(f"{place.name}: damage left")
        for axes, title in zip(grid[0], titles, strict=True):
            axes.set_title(title, fontsize=10)
            axes.legend(fontsize=7.5, loc="upper left", ncols=2, handlelength=1.0, labelspacing=0.2)
        for axes in grid[-1]:
            axes.set_xticks(range(len(EPSILONS)), [f"{epsilon:g}" for epsilon in EPSILONS])
            axes.set_xlabel("epsilon")
    return figure


def _series(results: Results, place: Place) -> dict[str, Series]:
    """What there is to compare, by the panel's title."""
    weights: Series = {}
    for name, condition in WEIGHTED.items():
        weights[name] = results.left(place, condition, name)
    dearest = list(WEIGHTED)[-1]
    weights[f"{dearest}, nearest"] = results.left(place, NEAREST, dearest)
    return {
        "damage of stairs : candle : table": weights,
        "reading of P(reach)": {"inverse": results.left(place, PAPER), "linear": results.left(place, LINEAR)},
        "caregiver's actions a timestep": {str(n): results.left(place, one) for n, one in SPEEDS.items()},
        "making room for the child": {"yields": results.left(place, PAPER), "still": results.left(place, STILL)},
    }


def _panel(axes: Axes, series: Series) -> None:
    offsets = np.linspace(-0.5, 0.5, len(series)) * _SPREAD * (len(series) - 1) / len(series)
    for (name, estimates), colour, offset in zip(series.items(), _COLOURS, offsets, strict=False):
        _points(axes, estimates, offset, colours.unit(colour), name)
    axes.set_ylim(0.0, _TOP)


def _points(
    axes: Axes, estimates: Sequence[Estimate[float]], offset: float, colour: tuple[float, ...], name: str
) -> None:
    value, low, high = np.array(estimates).T
    places = np.arange(len(estimates)) + offset
    axes.vlines(places, low, high, color=colour, linewidth=1.8)
    axes.plot(places, value, "o", color=colour, markeredgecolor=INK, markeredgewidth=0.5, markersize=4.5, label=name)

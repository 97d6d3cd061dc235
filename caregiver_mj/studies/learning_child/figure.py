"""The page's figure."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from caregiver_mj.studies.learning_child.life import KINDS
from caregiver_mj.studies.learning_child.measure import NONE, Grown
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.style import INK, STYLE

_PANELS = {
    "damage": "damage an episode",
    "return": "return: toys less damage",
    "coverage": "cells seen before the stop",
    "known": "dangerous moves shunned",
}
_COLOURS = (colours.HARM, colours.ROBOT, colours.CANDLE, colours.BIN, colours.STAIRWELL)


def draw(grown: Grown) -> Figure:
    """Each measure over age, a row for each kind of child: means, and the middle half of the children of a house."""
    with mpl.rc_context(STYLE):
        figure = Figure((3.1 * len(_PANELS), 5.6), layout="constrained")
        grid = figure.subplots(len(KINDS), len(_PANELS), sharex=True, sharey="col")
        for row, kind in zip(grid, KINDS, strict=True):
            for axes, (measure, title) in zip(row, _PANELS.items(), strict=True):
                _panel(axes, grown, measure, kind)
                axes.set_title(title if kind == KINDS[0] else "", fontsize=10)
            row[0].set_ylabel(f"{kind} children")
        for axes, measure in zip(grid[-1], _PANELS, strict=True):
            axes.set_xlabel("episodes lived")
            if measure != "return":
                axes.set_ylim(bottom=0)
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5, fontsize=9)
    return figure


def _panel(axes: Axes, grown: Grown, measure: str, kind: str) -> None:
    for name, colour in zip((NONE, *grown.guards), _COLOURS, strict=False):
        houses = [one for one in grown.course(name, measure, kind) if not np.isnan(one).any()]
        value = np.mean([one.mean(axis=0) for one in houses], axis=0)
        low, high = np.mean([np.quantile(one, (0.25, 0.75), axis=0) for one in houses], axis=0)
        age, shade = np.arange(1, len(value) + 1), colours.unit(colour)
        label = "alone from the first" if name == NONE else f"with {name}"
        axes.fill_between(age, low, high, color=shade, alpha=0.15, linewidth=0)
        axes.plot(age, value, color=shade, linewidth=1.4, label=label)
    axes.axvline(grown.childhood + 0.5, color=INK, linewidth=0.9, linestyle="--")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))

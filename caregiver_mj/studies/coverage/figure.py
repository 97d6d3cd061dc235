"""The figure of docs/coverage.md."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from caregiver_mj.studies.coverage.page import WANTED
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.style import INK, STYLE

_COLOURS = (colours.ROBOT, colours.BIN, colours.CANDLE, colours.DAMAGE)
_BAND = "#dfe3e8"
_STYLE = STYLE | {"axes.grid": False}
_WIDTH = 0.19  # of a method's column


def draw(episodes: pd.DataFrame) -> Figure:
    """Coverage of every cell by method and size, and below it on which side the intervals miss."""
    left = episodes[episodes.quantity == "damage left"]
    with mpl.rc_context(_STYLE):
        figure = Figure((5.2, 5.6), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        sizes, methods = left["size"].unique(), left.method.unique()
        for i, (method, colour) in enumerate(zip(methods, _COLOURS, strict=True)):
            shade = colours.unit(colour)
            places = np.arange(len(sizes)) + (i - (len(methods) - 1) / 2) * _WIDTH
            groups = [left[(left.method == method) & (left["size"] == size)] for size in sizes]
            for place, group in zip(places, groups, strict=True):
                spread = place + np.linspace(-0.35, 0.35, len(group)) * _WIDTH
                above.plot(spread, 100 * group.covered, "o", color=shade, markersize=3.4, markeredgewidth=0)
            flattering = [100 * group.too_low.mean() for group in groups]
            below.bar(places, flattering, 0.85 * _WIDTH, color=shade, label=method)
            other = [-100 * group.too_high.mean() for group in groups]
            below.bar(places, other, 0.85 * _WIDTH, color=shade, alpha=0.45)
        _label(above, below, [f"{size} episodes" for size in sizes])
    return figure


def _label(above: Axes, below: Axes, sizes: list[str]) -> None:
    above.axhspan(100 * WANTED[0], 100 * WANTED[1], color=_BAND, zorder=0)
    above.axhline(95, color=INK, linewidth=0.8, zorder=1)
    above.set_ylabel("interval covers the truth, %\n(a point: house and epsilon)")
    below.axhline(0, color=INK, linewidth=0.8)
    for wanted in (2.5, -2.5):
        below.axhline(wanted, color=INK, linewidth=0.8, linestyle=":")
    below.set_yticks([-2.5, 0, 2.5, 5], ["2.5", "0", "2.5", "5"])
    below.set_ylabel("truth above the interval\n(flattering), or below it, %")
    below.set_xticks(range(len(sizes)), sizes)
    handles, labels = below.get_legend_handles_labels()
    above.legend(handles, labels, loc="lower right", ncols=2, fontsize=8.5)

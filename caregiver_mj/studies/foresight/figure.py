"""The frontier: damage against what the child pays for less of it."""

from __future__ import annotations

import matplotlib as mpl
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.studies.foresight.measure import means
from caregiver_mj.studies.foresight.variants import ABLATIONS, BESIDE, FLOOR, PRICE, key_of
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.style import INK, STYLE

_SHOWN = EPSILONS[1:]  # at 1 there are no toys to speak of
_PANELS = {"moves_blocked_free": "free moves denied an episode", "toys_reached": "toys kept"}


def draw(rows: pd.DataFrame) -> Figure:
    """A column of panels for each epsilon: damage left over free moves denied, and over toys kept.

    Args:
        rows: What `measure` has found.
    """
    found = means(rows)
    with mpl.rc_context(STYLE):
        figure = Figure((3.1 * len(_SHOWN), 6.0), layout="constrained")
        grid = figure.subplots(len(_PANELS), len(_SHOWN), squeeze=False)
        for column, epsilon in zip(grid.T, _SHOWN, strict=True):
            for axes, (what, title) in zip(column, _PANELS.items(), strict=True):
                _panel(axes, found.xs(f"{epsilon:g}", level="family"), what)
                axes.set_xlabel(title)
            column[0].set_title(f"epsilon {epsilon:g}", fontsize=10)
        for row in grid:
            row[0].set_ylabel("damage left")
        handles, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8)
    return figure


def _panel(axes: Axes, found: pd.DataFrame, what: str) -> None:
    left = found.damage / found.damage["none"]
    across = found[what] / found[what]["none"] if what == "toys_reached" else found[what]
    axes.axhline(left[FLOOR], color=INK, linewidth=0.8, linestyle=":", label="floor of blocking and relocating")
    prices = sorted(ABLATIONS[PRICE], key=float)
    keys = [key_of(PRICE, price) for price in prices]
    line = colours.unit(colours.ROBOT)
    axes.plot(across[keys], left[keys], "-", color=line, linewidth=1.0, label="foresight, prices of a denied move")
    axes.plot(across[keys], left[keys], "o", color=line, markersize=3.0)
    axes.plot(across["foresight"], left["foresight"], "o", color=line, markeredgecolor=INK, label="foresight")
    palette = (colours.STAIRWELL, colours.CANDLE, colours.BIN, colours.FLAME, colours.HARM, colours.TODDLER)
    for name, colour, marker in zip(BESIDE, palette, "sD^vP*", strict=True):
        axes.plot(
            across[name], left[name], marker, color=colours.unit(colour), markeredgecolor=INK, markersize=6, label=name
        )
    if what == "toys_reached":
        axes.axvline(0.97, color=INK, linewidth=0.6, linestyle="--")

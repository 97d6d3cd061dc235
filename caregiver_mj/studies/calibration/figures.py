"""The figures: a small reliability diagram for every child."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from caregiver_mj.studies.calibration.children import TOGETHER, families, title
from caregiver_mj.studies.calibration.scores import Scores
from caregiver_mj.studies.calibration.tally import HARMLESS, HORIZONS, SAFE
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.panels import explain, panels
from caregiver_mj.viz.figures.style import INK, MUTED, STYLE

FEWEST = 200  # predictions in a bin, below which it is not drawn
HARMLESS_FOR = HORIZONS[-1]  # timesteps of a harmless stretch
_COLUMNS, _WIDTH, _HEIGHT = 4, 8.6, 1.95  # panels in a row; inches of the figure and of a row
_SHADES = (colours.CANDLE, colours.ROBOT, colours.BIN)
_LOWEST = 1e-4  # where the axes of collisions begin


def draw_collisions(rows: pd.DataFrame) -> Figure:
    """Predicted probability of a collision with an object against its frequency, both on a logarithmic scale."""
    with mpl.rc_context(STYLE):
        figure, grid = _grid()
        for family, axes in grid.items():
            axes.set(xscale="log", yscale="log", xlim=(_LOWEST, 1), ylim=(_LOWEST, 1))
            axes.plot([_LOWEST, 1], [_LOWEST, 1], color=MUTED, linewidth=0.8, zorder=1)
            for horizon, shade in zip(HORIZONS, _SHADES, strict=True):
                _line(axes, Scores.of(rows, family, horizon), shade)
        _finish(figure, grid, [f"within {_timesteps(horizon)}" for horizon in HORIZONS], "a collision")
    return figure


def draw_harmless(rows: pd.DataFrame) -> Figure:
    """What is said of the next timesteps against how often they were harmless: the belief, and P(safe|tau)."""
    with mpl.rc_context(STYLE):
        figure, grid = _grid()
        for family, axes in grid.items():
            axes.plot([0, 1], [0, 1], color=MUTED, linewidth=0.8, zorder=1)
            for kind, shade in zip((HARMLESS, SAFE), _SHADES[:2], strict=True):
                _line(axes, Scores.of(rows, family, HARMLESS_FOR, (kind,)), shade)
            axes.set(xlim=(0, 1), ylim=(0, 1.02))
        _finish(figure, grid, ["the belief", "the paper's P(safe|tau)"], f"{_timesteps(HARMLESS_FOR)} without harm")
    return figure


def _grid() -> tuple[Figure, dict[str, Axes]]:
    return panels({family: title(family) for family in (TOGETHER, *families())}, _COLUMNS, _WIDTH, _HEIGHT)


def _line(axes: Axes, scores: Scores, shade: colours.Colour) -> None:
    """What happened by what was predicted, in bins of which there is enough."""
    predicted, (value, low, high) = scores.reliability()
    drawn = scores.count.sum(axis=0) >= FEWEST
    if not drawn.any():
        return  # an empty line would stretch the layout
    x, value, low, high = (values[drawn] for values in (predicted, value, low, high))
    colour = colours.unit(shade)
    # What never happened lies below a logarithmic scale, and is drawn at its edge.
    foot = axes.get_ylim()[0] if axes.get_yscale() == "log" else 0.0
    x = np.maximum(x, foot)
    bounded = np.isfinite(high) & (low > 0)
    axes.vlines(x[bounded], np.maximum(low, foot)[bounded], high[bounded], color=colour, linewidth=1.0, alpha=0.55)
    axes.plot(x, np.maximum(value, foot), "o-", color=colour, markersize=2.8, linewidth=1.1, clip_on=False)


def _finish(figure: Figure, grid: dict[str, Axes], keys: Sequence[str], what: str) -> None:
    handles = [
        Line2D([], [], color=colours.unit(shade), marker="o", markersize=4)
        for _, shade in zip(keys, _SHADES, strict=False)
    ]
    explain(figure, dict(zip(keys, handles, strict=True)))
    figure.supxlabel(f"predicted probability of {what}", fontsize=9.5, color=INK)
    figure.supylabel("frequency with which it happened", fontsize=9.5, color=INK)


def _timesteps(count: int) -> str:
    return f"{count} timestep" + "s" * (count != 1)

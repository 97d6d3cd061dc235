"""The report's figures: bars as in the paper's figures 2 to 4, what is left of the damage, and heat maps of the house.

They are drawn for a column some 400 pixels wide, so that they can be read on a phone as they are.
"""

from __future__ import annotations

import dataclasses
import io
import itertools
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import matplotlib.colors
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch, Polygon, Rectangle

from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.symbols import BIN, CANDLE, STAIRWELL, TABLE
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import Colour

ALONE, GUARDED = colours.DAMAGE, colours.ROBOT  # bars without and with the caregiver

# From nothing to most, on the dark ground of a map.
WENT = (colours.FLOOR, (52, 78, 118), (128, 138, 126), colours.TODDLER)
HURT = (colours.FLOOR, (116, 44, 42), colours.DAMAGE, (255, 226, 150))

_WIDTH, _HEIGHT = 4.2, 3.2  # inches
_INK, _FAINT, _RULE = "#1b212b", "#6b7686", "#dfe3e8"
_SERIES = ((colours.ROBOT, "o"), (colours.BIN, "s"), (colours.STAIRWELL, "^"), (colours.CANDLE, "v"))
_PUBLISHED = {"marker": "D", "color": "white", "markeredgecolor": _INK, "markersize": 5.5, "linestyle": "none"}
_STYLE = {
    "font.size": 9.5,
    "axes.edgecolor": _FAINT,
    "axes.labelcolor": _INK,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "grid.color": _RULE,
    "xtick.color": _INK,
    "xtick.major.size": 0,
    "ytick.color": _INK,
    "ytick.major.size": 0,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "svg.hashsalt": "caregiver_mj",  # the same figure is the same file
}


@dataclasses.dataclass(frozen=True)
class Series:
    """A quantity for each novice; all arrays have that length, NaN where there is no number.

    Attributes:
        label: What it is called in the legend.
        mean: Means.
        low: Lower ends of their intervals.
        high: Upper ends.
        sd: Standard deviations, if they are to be shown.
        published: The paper's means, if it has any.
    """

    label: str
    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray
    sd: np.ndarray | None = None
    published: np.ndarray | None = None


def bars(novices: Sequence[str], alone: Series, guarded: Series, quantity: str, top: float | None = None) -> Figure:
    """Grouped bars of every novice without and with the caregiver, in the form of the paper's figures.

    Args:
        novices: Their names.
        alone: Without the caregiver, with standard deviations.
        guarded: With it, likewise.
        quantity: The label of the axis.
        top: The greatest value there can be, if there is one.
    """
    with mpl.rc_context(_STYLE):
        figure, axes = _figure()
        places, width = np.arange(len(novices)), 0.38
        keys = {}
        for series, colour, offset in ((alone, ALONE, -width / 2), (guarded, GUARDED, width / 2)):
            x = places + offset
            keys[series.label] = axes.bar(x, series.mean, 0.92 * width, color=_rgb(colour))
            keys["standard deviation"] = axes.errorbar(
                x, series.mean, series.sd, fmt="none", ecolor=_FAINT, elinewidth=1, capsize=3
            )
            interval = axes.vlines(x, series.low, series.high, color=_INK, linewidth=3.2)
            if np.isfinite(series.low).any():
                keys["95 % interval"] = interval
            if series.published is not None and np.isfinite(series.published).any():
                keys["published"] = axes.plot(x + 0.25 * width, series.published, **_PUBLISHED)[0]
        axes.set_xticks(places, novices)
        axes.set_ylabel(quantity)
        if top is not None:
            axes.set_ylim(0, 1.16 * top)
            axes.set_yticks(np.linspace(0, top, 5))
        order = [alone.label, guarded.label, "published", "standard deviation", "95 % interval"]
        _legend(axes, {name: keys[name] for name in order if name in keys})
    return figure


def damage_left(novices: Sequence[str], series: Sequence[Series]) -> Figure:
    """Damage as a share of that without a caregiver, a marker with its interval for each novice."""
    with mpl.rc_context(_STYLE):
        figure, axes = _figure()
        places = np.arange(len(novices))
        published = next((s.published for s in series if s.published is not None), np.full(len(novices), np.nan))
        count = len(series) + bool(np.isfinite(published).any())
        offsets = (np.arange(count) - (count - 1) / 2) * min(0.18, 0.7 / count)
        keys = {}
        for one, (colour, marker), offset in zip(series, itertools.cycle(_SERIES), offsets, strict=False):
            x = places + offset
            axes.vlines(x, one.low, one.high, color=_rgb(colour), linewidth=2.4)
            keys[one.label] = axes.plot(
                x, one.mean, marker, color=_rgb(colour), markeredgecolor=_INK, markeredgewidth=0.6, markersize=6.5
            )[0]
        if count > len(series):
            keys["published"] = axes.plot(places + offsets[-1], published, **_PUBLISHED)[0]
        axes.axhline(1.0, color=_rgb(ALONE), linewidth=1.6)
        axes.text(len(novices) - 0.52, 1.015, "no caregiver", ha="right", va="bottom", color=_INK, fontsize=9)
        axes.set_xticks(places, novices)
        axes.set_xlim(-0.5, len(novices) - 0.5)
        axes.set_ylim(0, max(1.15, 1.05 * np.nanmax([1.0, *(np.nanmax([*s.high, *s.mean, 0]) for s in series)])))
        axes.set_ylabel("damage left")
        _legend(axes, keys)
    return figure


def heat_map(plan: FloorPlan, values: np.ndarray, scale: Sequence[Colour], top: float, quantity: str) -> Figure:
    """The house from above, its free cells coloured by a number.

    Args:
        plan: The house.
        values: One for each free cell.
        scale: Colours from zero to the greatest value.
        top: What that value is.
        quantity: The label of the colour bar.
    """
    rows, columns = plan.shape
    ground, text = _rgb(colours.GROUND), _rgb((242, 244, 247))
    heat = matplotlib.colors.LinearSegmentedColormap.from_list("heat", [_rgb(colour) for colour in scale])
    norm = matplotlib.colors.PowerNorm(0.5, 0, top or 1.0)  # square roots, or a few cells would outshine all others
    with mpl.rc_context({**_STYLE, "axes.grid": False, "text.color": text, "xtick.color": text}):
        below = 0.62  # inches for the colour bar
        height = _WIDTH * rows / columns + below
        figure = Figure((_WIDTH, height), facecolor=ground)
        axes = figure.add_axes((0, below / height, 1, 1 - below / height))
        axes.set_axis_off()
        axes.set(xlim=(-0.5, columns - 0.5), ylim=(rows - 0.5, -0.5), aspect="equal")
        axes.add_patch(Rectangle((-0.5, -0.5), columns, rows, facecolor=_rgb(colours.WALL), linewidth=0))
        for cell in plan.cells_of(CANDLE, TABLE, BIN):
            axes.add_patch(_square(cell, _rgb(colours.FLOOR)))
        for cell, value in zip(plan.free_cells, values, strict=True):
            axes.add_patch(_square(cell, heat(norm(value))))
        _furnish(axes, plan)
        bar = figure.add_axes((0.03, 0.44 / height, 0.94, 0.09 / height))
        legend = figure.colorbar(mpl.cm.ScalarMappable(norm, heat), bar, orientation="horizontal")
        legend.outline.set_visible(False)
        ticks = [tick for tick in _ticks(top) if tick <= top]
        legend.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
        bar.tick_params(labelsize=9, pad=2)
        bar.set_xlabel(quantity, fontsize=9, color=text, labelpad=2)
    return figure


def as_bytes(figure: Figure, kind: str) -> bytes:
    """The file of a figure, "svg" or "png"."""
    file = io.BytesIO()
    with mpl.rc_context(_STYLE):
        figure.savefig(file, format=kind, dpi=200, metadata={"Date": None} if kind == "svg" else None)
    return file.getvalue()


def _figure() -> tuple[Figure, Axes]:
    figure = Figure((_WIDTH, _HEIGHT), layout="constrained", facecolor="white")
    return figure, figure.add_subplot()


def _legend(axes: Axes, keys: dict[str, Any]) -> None:
    """Explains the keys above the axes, at most three in a row, which Matplotlib fills column by column."""
    columns = min(3, len(keys))
    in_columns = [list(keys.items())[i::columns] for i in range(columns)]
    names, artists = zip(*(key for column in in_columns for key in column), strict=True)
    axes.figure.legend(
        artists, names, loc="outside upper left", ncols=columns, columnspacing=1, handlelength=1.2, handletextpad=0.5
    )


def _rgb(colour: Colour) -> tuple[float, float, float]:
    return tuple(part / 255 for part in colour)


def _ticks(top: float) -> np.ndarray:
    """Round numbers for a scale of square roots."""
    if top <= 0:
        return np.zeros(1)
    step = 10.0 ** np.floor(np.log10(top))
    step *= max(s for s in (1, 2, 5) if s * step <= top)
    return np.array([0.0, 0.1, 0.4, 1.0, 2.0]) * step


def _square(cell: Cell, colour: tuple) -> Rectangle:
    # Drawn a little larger, or viewers show seams between the cells.
    return Rectangle((cell[1] - 0.505, cell[0] - 0.505), 1.01, 1.01, facecolor=colour, linewidth=0)


def _furnish(axes: Axes, plan: FloorPlan) -> None:
    """Draws what stands in the house at the start, as the films' display does."""
    for row, column in plan.cells_of(STAIRWELL):
        axes.add_patch(_square((row, column), _rgb(colours.mix(colours.STAIRWELL, colours.GROUND, 0.6))))
        for tread in range(4):
            y = row - 0.5 + (tread + 0.5) / 4
            axes.plot((column - 0.5, column + 0.5), (y, y), color=_rgb(colours.STAIRWELL), lw=2, solid_capstyle="butt")
    for cells, colour in ((plan.tables, colours.TABLE), (plan.cells_of(BIN), colours.BIN)):
        for row, column in cells:
            box = FancyBboxPatch(
                (column - 0.26, row - 0.26), 0.52, 0.52, "round,pad=0.1", facecolor=_rgb(colour), linewidth=0
            )
            axes.add_patch(box)
    for table in plan.candle_tables:
        (y, x), r = plan.tables[table], 0.17
        y += 0.4 * r
        flame = [(x, y - 2.3 * r), (x + 0.95 * r, y - 0.3 * r), (x - 0.95 * r, y - 0.3 * r)]
        axes.add_patch(Polygon(flame, facecolor=_rgb(colours.CANDLE), linewidth=0))
        axes.add_patch(Circle((x, y), r, facecolor=_rgb(colours.CANDLE), linewidth=0))
        axes.add_patch(Circle((x, y + 0.1 * r), 0.45 * r, facecolor=_rgb((255, 236, 170)), linewidth=0))

"""Bars, and shares of the damage that are left."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import unit
from caregiver_mj.viz.figures.style import ALONE, FAINT, GUARDED, HEIGHT, INK, STYLE, WIDTH

_SERIES = ((colours.ROBOT, "o"), (colours.BIN, "s"), (colours.STAIRWELL, "^"), (colours.CANDLE, "v"))
_PUBLISHED = {"marker": "D", "color": "white", "markeredgecolor": INK, "markersize": 5.5, "linestyle": "none"}


@dataclasses.dataclass(frozen=True)
class Series:
    """A quantity for each novice or family; all arrays have that length, NaN where there is no number.

    Attributes:
        label: What it is called in the legend.
        mean: Means.
        low: Lower ends of their intervals.
        high: Upper ends, NaN also where an interval has none.
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
    """Grouped bars of every novice or family without and with the caregiver, in the form of the paper's figures.

    Args:
        novices: Their names.
        alone: Without the caregiver, with standard deviations.
        guarded: With it, likewise.
        quantity: The label of the axis.
        top: The greatest value there can be, if there is one.
    """
    with mpl.rc_context(STYLE):
        figure, axes = _figure()
        places, width = np.arange(len(novices)), 0.38
        keys = {}
        for series, colour, offset in ((alone, ALONE, -width / 2), (guarded, GUARDED, width / 2)):
            x = places + offset
            keys[series.label] = axes.bar(x, series.mean, 0.92 * width, color=unit(colour))
            keys["standard deviation"] = axes.errorbar(
                x, series.mean, series.sd, fmt="none", ecolor=FAINT, elinewidth=1, capsize=3
            )
            interval = axes.vlines(x, series.low, series.high, color=INK, linewidth=3.2)
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
    """Damage as a share of that without a caregiver, a marker with its interval for each novice or family."""
    with mpl.rc_context(STYLE):
        figure, axes = _figure()
        places = np.arange(len(novices))
        published = next((s.published for s in series if s.published is not None), np.full(len(novices), np.nan))
        count = len(series) + bool(np.isfinite(published).any())
        offsets = (np.arange(count) - (count - 1) / 2) * min(0.18, 0.7 / count)
        top = max(1.15, 1.05 * np.nanmax([1.0, *(np.nanmax([*s.high, *s.mean, 0]) for s in series)]))
        keys = {}
        for one, (colour, marker), offset in zip(series, itertools.cycle(_SERIES), offsets, strict=False):
            x = places + offset
            high = np.where(np.isnan(one.high) & ~np.isnan(one.low), top, one.high)  # it has no upper end
            axes.vlines(x, one.low, high, color=unit(colour), linewidth=2.4)
            keys[one.label] = axes.plot(
                x, one.mean, marker, color=unit(colour), markeredgecolor=INK, markeredgewidth=0.6, markersize=6.5
            )[0]
        if count > len(series):
            keys["published"] = axes.plot(places + offsets[-1], published, **_PUBLISHED)[0]
        axes.axhline(1.0, color=unit(ALONE), linewidth=1.6)
        axes.text(len(novices) - 0.52, 1.015, "no caregiver", ha="right", va="bottom", color=INK, fontsize=9)
        axes.set_xticks(places, novices)
        axes.set_xlim(-0.5, len(novices) - 0.5)
        axes.set_ylim(0, top)
        axes.set_ylabel("damage left")
        _legend(axes, keys)
    return figure


def _figure() -> tuple[Figure, Axes]:
    figure = Figure((WIDTH, HEIGHT), layout="constrained", facecolor="white")
    return figure, figure.add_subplot()


def _legend(axes: Axes, keys: dict[str, Any]) -> None:
    """Explains the keys above the axes, at most three in a row, which Matplotlib fills column by column."""
    columns = min(3, len(keys))
    in_columns = [list(keys.items())[i::columns] for i in range(columns)]
    names, artists = zip(*(key for column in in_columns for key in column), strict=True)
    axes.figure.legend(
        artists, names, loc="outside upper left", ncols=columns, columnspacing=1, handlelength=1.2, handletextpad=0.5
    )

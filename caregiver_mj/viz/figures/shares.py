"""Shares that are left with a caregiver of what there is without one."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import unit
from caregiver_mj.viz.figures.panels import explain, single
from caregiver_mj.viz.figures.series import Series
from caregiver_mj.viz.figures.style import ALONE, FLOOR_LINE, HEIGHT, INK, PUBLISHED, STYLE

_SERIES = ((colours.ROBOT, "o"), (colours.BIN, "s"), (colours.STAIRWELL, "^"), (colours.CANDLE, "v"))
_HIGHEST = 2.0  # share that an interval may take the axis to


def damage_left(novices: Sequence[str], series: Sequence[Series], floor: Series | None = None) -> Figure:
    """Damage as a share of that without a caregiver, a marker with its interval for each novice or family.

    Args:
        novices: Their names.
        series: A share each.
        floor: The share that remains with bare tables alone, as a line for each of them.
    """
    with mpl.rc_context(STYLE):
        figure, axes = single()
        tallest = max(np.nanmax([*s.high, *s.mean, 0]) for s in series)
        known = max(1.0, *(np.nanmax([*s.mean, 0]) for s in series))
        top = max(1.15, 1.05 * known, min(1.05 * tallest, _HIGHEST))
        keys = _markers(axes, series, top)
        if floor is not None:
            keys["floor"] = axes.hlines(
                floor.mean, np.arange(len(novices)) - 0.4, np.arange(len(novices)) + 0.4, **FLOOR_LINE
            )
        axes.axhline(1.0, color=unit(ALONE), linewidth=1.6)
        axes.text(len(novices) - 0.52, 1.015, "no caregiver", ha="right", va="bottom", color=INK, fontsize=9)
        _name(axes, novices, "damage left")
        axes.set_ylim(0, top)
        explain(figure, keys)
    return figure


def toys_kept(novices: Sequence[str], series: Sequence[Series], margin: float) -> Figure:
    """Toys as a share of those without a caregiver, likewise.

    Args:
        novices: Their names.
        series: A share each.
        margin: The share of toys that may be lost, below which a line is drawn.
    """
    with mpl.rc_context(STYLE):
        figure, axes = single(0.8 * HEIGHT)
        known = [mean for one in series for mean in one.mean if np.isfinite(mean)] or [1.0]
        bottom, top = max(0.0, min(0.85, min(known) - 0.1)), min(_HIGHEST, max(1.15, max(known) + 0.1))
        keys = _markers(axes, series, top, bottom)
        keys[f"{100 * margin:g} % lost"] = axes.axhline(1 - margin, **FLOOR_LINE)
        axes.axhline(1.0, color=unit(ALONE), linewidth=1.6)
        _name(axes, novices, "toys kept")
        axes.set_ylim(bottom, top)
        explain(figure, keys)
    return figure


def _markers(axes: Axes, series: Sequence[Series], top: float, bottom: float = 0.0) -> dict[str, Any]:
    """Draws means and intervals side by side; what to explain of them."""
    places = np.arange(len(series[0].mean))
    published = next((s.published for s in series if s.published is not None), np.full(len(places), np.nan))
    count = len(series) + bool(np.isfinite(published).any())
    offsets = (np.arange(count) - (count - 1) / 2) * min(0.18, 0.7 / count)
    keys: dict[str, Any] = {}
    for one, (colour, marker), offset in zip(series, itertools.cycle(_SERIES), offsets, strict=False):
        x, known = places + offset, np.isfinite(one.mean)
        low = np.where(known & np.isnan(one.low), bottom, one.low)  # it has no lower end
        high = np.where(known & np.isnan(one.high), top, one.high)
        axes.vlines(x, low, high, color=unit(colour), linewidth=2.4)
        keys[one.label] = axes.plot(
            x, one.mean, marker, color=unit(colour), markeredgecolor=INK, markeredgewidth=0.6, markersize=6.5
        )[0]
    if count > len(series):
        keys["published"] = axes.plot(places + offsets[-1], published, **PUBLISHED)[0]
    return keys


def _name(axes: Axes, novices: Sequence[str], quantity: str) -> None:
    axes.set_xticks(np.arange(len(novices)), novices)
    axes.set_xlim(-0.5, len(novices) - 0.5)
    axes.set_ylabel(quantity)

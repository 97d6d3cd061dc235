"""Bars as in the paper's figures 2 to 4."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from caregiver_mj.viz.colours import unit
from caregiver_mj.viz.figures.panels import explain, single
from caregiver_mj.viz.figures.series import Series
from caregiver_mj.viz.figures.style import ALONE, FAINT, GUARDED, INK, PUBLISHED, STYLE


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
        figure, axes = single()
        places, width = np.arange(len(novices)), 0.38
        keys: dict[str, Any] = {}
        for series, colour, offset in ((alone, ALONE, -width / 2), (guarded, GUARDED, width / 2)):
            x = places + offset
            keys[series.label] = axes.bar(x, series.mean, 0.92 * width, color=unit(colour))
            # No longer than the quantity can be small or great.
            ends = np.clip([series.mean - series.sd, series.mean + series.sd], 0.0, top)
            keys["standard deviation"] = axes.errorbar(
                x, series.mean, np.abs(ends - series.mean), fmt="none", ecolor=FAINT, elinewidth=1, capsize=3
            )
            interval = axes.vlines(x, series.low, series.high, color=INK, linewidth=3.2)
            if np.isfinite(series.low).any():
                keys["95 % interval"] = interval
            if series.published is not None and np.isfinite(series.published).any():
                keys["published"] = axes.plot(x + 0.25 * width, series.published, **PUBLISHED)[0]
        axes.set_xticks(places, novices)
        axes.set_ylabel(quantity)
        if top is not None:
            axes.set_ylim(0, 1.16 * top)
            axes.set_yticks(np.linspace(0, top, 5))
        order = [alone.label, guarded.label, "published", "standard deviation", "95 % interval"]
        explain(figure, {name: keys[name] for name in order if name in keys})
    return figure

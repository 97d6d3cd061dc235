"""Every house as a point."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from caregiver_mj.experiments.settings import FLOOR
from caregiver_mj.viz.colours import unit
from caregiver_mj.viz.figures.style import ALONE, FLOOR_LINE, GUARDED, INK, MUTED, STYLE, WIDTH, explain, panels

if TYPE_CHECKING:
    import pandas as pd  # only what is handed in is one

_ROW, _BARE_ROW = 0.2, 0.15  # inches for a caregiver, with points and without
_MOST = 2.0  # damage left that is drawn where it is; above that, at the edge
_MANY = 2000  # points that are drawn as an image, or the file would be too large
_SPREAD = 0.32  # of the points of a caregiver, to both sides
_GOLDEN = 0.618034  # multiples of which are spread evenly, however many there are


def houses(
    by_house: pd.DataFrame | None,
    means: pd.DataFrame,
    names: Mapping[str, str],
    *,
    caregiver: str = "paper",
    columns: int = 1,
) -> Figure:
    """Return the damage left in every house by every caregiver: a panel for each family, a row for each caregiver.

    Args:
        by_house: A row for each house, `caregiver` and `family`, with `damage_left`, NaN where there is no damage;
            None of a single house.
        means: A row for each `caregiver` and `family`, with `damage_left`, `damage_left_ci_low` and `_ci_high`; an
            end may be missing. Caregivers are drawn in its order.
        names: What families are called; others are left out.
        caregiver: The one that stands out.
        columns: Panels in a row.
    """
    caregivers = [name for name in dict.fromkeys(means["caregiver"]) if name not in ("none", FLOOR)]
    row = _ROW if by_house is not None else _BARE_ROW
    by_house = means.iloc[:0] if by_house is None else by_house
    limit = _limit(by_house[by_house["caregiver"].isin(caregivers)], means)
    width = WIDTH if columns == 1 else 1.2 + 1.75 * columns
    with mpl.rc_context({**STYLE, "axes.grid.axis": "x"}):
        figure, found = panels(names, columns, width, 0.42 + row * len(caregivers))
        keys: dict[str, Any] = {}
        for family, axes in found.items():
            points, middles = (table[table["family"] == family] for table in (by_house, means))
            keys |= _panel(axes, points, middles.set_index("caregiver"), caregivers, caregiver, limit)
            if FLOOR in set(middles["caregiver"]):
                level = float(middles.set_index("caregiver").loc[FLOOR, "damage_left"])
                keys["floor"] = axes.axvline(level, **FLOOR_LINE)
            keys["no caregiver"] = axes.axvline(1.0, color=unit(ALONE), linewidth=1.4, zorder=1)
            axes.set_yticks(range(len(caregivers)), caregivers)
            axes.set_ylim(len(caregivers) - 0.45, -0.55)
            axes.set_xlim(0, limit)
        figure.supxlabel("damage left", fontsize=9.5, color=INK)
        explain(figure, keys, most=3 if columns == 1 else 5)
    return figure


def _panel(
    axes: Axes, points: pd.DataFrame, means: pd.DataFrame, caregivers: list[str], main: str, limit: float
) -> dict[str, Any]:
    """Draw a family's points and means; return what to explain of them."""
    keys: dict[str, Any] = {}
    for row, name in enumerate(caregivers):
        colour = unit(GUARDED) if name == main else MUTED
        left = points.loc[points["caregiver"] == name, "damage_left"].dropna().to_numpy(float)
        y = row + _SPREAD * (2 * ((np.arange(len(left)) * _GOLDEN) % 1) - 1)
        inside = left <= limit
        many: dict[str, Any] = {"rasterized": len(left) * len(caregivers) > _MANY, "clip_on": False, "linewidths": 0}
        size = float(np.clip(400 / max(len(left), 1), 3, 9))
        drawn = axes.scatter(left[inside], y[inside], size, color=[colour], alpha=0.75, zorder=2, **many)
        axes.scatter(np.full((~inside).sum(), limit), y[~inside], 16, color=[colour], marker=">", zorder=2, **many)
        if name not in means.index:
            continue
        mean, low, high = means.loc[name, ["damage_left", "damage_left_ci_low", "damage_left_ci_high"]].astype(float)
        ends = 0.0 if np.isnan(low) else low, limit if np.isnan(high) else min(high, limit)
        interval = axes.hlines(row, *ends, color=INK, linewidth=2.2, zorder=4)
        middle = axes.plot(
            mean, row, "D", color="white", markeredgecolor=INK, markeredgewidth=1, markersize=4.6, zorder=5
        )[0]
        keys |= {"a house": drawn, "mean over houses": middle} if len(left) else {"mean": middle}
        keys["95 % interval"] = interval
    return keys


def _limit(points: pd.DataFrame, means: pd.DataFrame) -> float:
    """The right end of the axis: all means and nearly all houses are left of it."""
    left = points["damage_left"].dropna().to_numpy(float)
    middles = means.loc[means["caregiver"] != "none", ["damage_left", "damage_left_ci_high"]].to_numpy(float)
    wanted = [1.1, *1.03 * middles[np.isfinite(middles)], *([np.quantile(left, 0.97)] if len(left) else [])]
    return float(min(max(wanted), _MOST))

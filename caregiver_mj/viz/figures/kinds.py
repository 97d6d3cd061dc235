"""What is left of the damage, and of what."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import unit
from caregiver_mj.viz.figures.panels import explain, single
from caregiver_mj.viz.figures.style import FAINT, FLOOR_LINE, INK, STYLE

if TYPE_CHECKING:
    import pandas as pd  # only what is handed in is one

KINDS = {"damage_stairwell": "stairs", "damage_candle": "candles", "damage_table": "bare tables"}
_COLOURS = dict(zip(KINDS, (colours.STAIRWELL, colours.CANDLE, colours.TABLE), strict=True))
_WIDTH = 0.37  # of a bar; a pair of bars takes twice that


def kinds(means: pd.DataFrame, names: Mapping[str, str], *, caregiver: str = "paper", floor: str = "floor") -> Figure:
    """Stacked bars of the damage by what did it, without and with a caregiver, as shares of all damage without.

    Args:
        means: A row for each `caregiver` and `family`, with `damage_mean` and that of each of `KINDS`.
        names: What families are called; others are left out.
        caregiver: Who is set against `none`.
        floor: The one that is drawn as a line, where it is in `means`.
    """
    rows = means.set_index(["caregiver", "family"])
    with mpl.rc_context(STYLE):
        figure, axes = single()
        keys: dict[str, Any] = {}
        highest = 1.0
        for place, family in enumerate(names):
            whole = float(rows.loc[("none", family), "damage_mean"])
            for who, x in (("none", place - _WIDTH / 2), (caregiver, place + _WIDTH / 2)):
                row, bottom = rows.loc[(who, family)], 0.0
                for kind, name in KINDS.items():
                    share = float(row[f"{kind}_mean"]) / whole if whole else 0.0
                    drawn = axes.bar(x, share, 0.92 * _WIDTH, bottom, color=unit(_COLOURS[kind]))
                    keys.setdefault(name, drawn)
                    bottom += share
                highest = max(highest, bottom)
                axes.text(
                    x, bottom + 0.012, f"{row['damage_mean']:.1f}", ha="center", va="bottom", color=INK, fontsize=7.5
                )
            if (floor, family) in rows.index and whole:
                level = float(rows.loc[(floor, family), "damage_mean"]) / whole
                keys["floor"] = axes.hlines(level, place - _WIDTH, place + _WIDTH, **FLOOR_LINE)
        axes.set_xticks(np.arange(len(names)), list(names.values()))
        axes.set_ylim(0, 1.1 * highest)
        axes.set_ylabel("share of the damage without")
        axes.text(
            1.0, 1.0, f"left bar: none; right bar: {caregiver}", transform=axes.transAxes, ha="right", va="bottom",
            fontsize=8, color=FAINT,
        )  # fmt: skip
        explain(figure, keys, most=4)
    return figure

"""How long the children go on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import unit
from caregiver_mj.viz.figures.panels import explain, panels
from caregiver_mj.viz.figures.style import ALONE, FLOOR_LINE, GUARDED, INK, STYLE, WIDTH

if TYPE_CHECKING:
    import pandas as pd  # only what is handed in is one

_OTHERS = ((colours.BIN, (0, (5, 1.5))), (colours.STAIRWELL, (0, (2, 1))), (colours.CANDLE, (0, (5, 1, 1, 1))))


def survival(
    episodes: pd.DataFrame,
    names: Mapping[str, str],
    caregivers: Sequence[str],
    *,
    caregiver: str = "paper",
    floor: str = "floor",
    columns: int = 3,
) -> Figure:
    """The share of episodes that are not yet stopped, over time; a panel for each family.

    Args:
        episodes: A row an episode, with `caregiver`, `family`, `timesteps_to_threshold` and `stopped`.
        names: What families are called; others are left out.
        caregivers: Whose curves to draw, in their order; at most three beside `none`, `caregiver` and `floor`.
        caregiver: The one that stands out.
        floor: The one that is drawn as the floor is in other figures.
        columns: Panels in a row.
    """
    looks: dict[str, dict[str, Any]] = {
        "none": {"color": unit(ALONE), "linewidth": 1.8},
        caregiver: {"color": unit(GUARDED), "linewidth": 2.2},
        floor: dict(FLOOR_LINE),
    }
    others = [name for name in caregivers if name not in looks]
    for name, (colour, line) in zip(others, _OTHERS, strict=False):
        looks[name] = {"color": unit(colour), "linewidth": 1.4, "linestyle": line}
    time = np.arange(EPISODE_TIMESTEPS + 1)
    with mpl.rc_context({**STYLE, "axes.grid.axis": "both"}):
        figure, found = panels(names, columns, WIDTH if columns <= 3 else 1.75 * columns + 0.5, 1.3)
        keys: dict[str, Any] = {}
        for family, axes in found.items():
            for name in caregivers:
                chosen = episodes[(episodes["caregiver"] == name) & (episodes["family"] == family)]
                keys["alone" if name == "none" else name] = axes.plot(time, going(chosen, time), **looks[name])[0]
            axes.set(xlim=(0, EPISODE_TIMESTEPS), ylim=(0, 1.04), xticks=range(0, EPISODE_TIMESTEPS + 1, 100))
        figure.supxlabel("timesteps", fontsize=9.5, color=INK)
        figure.supylabel("share not yet stopped", fontsize=9.5, color=INK)
        explain(figure, keys, most=4)
    return figure


def going(episodes: pd.DataFrame, time: np.ndarray) -> np.ndarray:
    """The share of episodes that are not stopped at or before some timesteps, (timesteps,)."""
    stop = np.where(episodes["stopped"] > 0, episodes["timesteps_to_threshold"], np.inf)
    return (stop[:, None] > time).mean(axis=0)

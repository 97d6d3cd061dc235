"""The page's figure."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from caregiver_mj.studies.grid_to_house.phases import PARTS, PHASES
from caregiver_mj.studies.grid_to_house.results import EPSILONS, Results
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.style import INK, STYLE

_STYLE = STYLE | {"axes.grid": False, "axes.titlesize": 10, "axes.titlelocation": "left"}
_KINDS = {"stairwell": colours.STAIRWELL, "candle": colours.CANDLE, "table": colours.TABLE}
_PART_COLOURS = dict(
    zip(PARTS, (colours.ROBOT, colours.TODDLER, colours.DAMAGE, colours.STAIRWELL, colours.BIN), strict=True)
)
_GRID_COLOUR, _WHITE = (176, 184, 196), (255, 255, 255)
_LEGEND = {"loc": "upper left", "columnspacing": 1.2, "handlelength": 1.2, "handletextpad": 0.5}
_THICK, _FILLED = 0.4, 0.92  # of a bar: its share of the place, and how much of that it fills


def draw(results: Results) -> Figure:
    """Damage by kind in both worlds, and the phases' time beside the grid's."""
    with mpl.rc_context(_STYLE):
        figure = Figure((8.8, 4.0), layout="constrained", facecolor="white")
        damage, time = figure.subplots(1, 2, width_ratios=(0.8, 1))
        _draw_damage(damage, results)
        _draw_time(time, results)
    return figure


def _draw_damage(axes: Axes, results: Results) -> None:
    places = np.arange(len(EPSILONS))
    axes.set_title("Damage an episode with the caregiver")
    for name, world, offset in (("grid", results.grid, -_THICK / 2), ("house", results.house, _THICK / 2)):
        top = np.zeros(len(EPSILONS))
        for kind, colour in _KINDS.items():
            height = np.array([world[e][f"damage_{kind}"].mean() for e in EPSILONS])
            shown = colour if name == "house" else colours.mix(colour, _WHITE, 0.5)
            label = f"{kind}s" if name == "house" else None
            axes.bar(places + offset, height, _FILLED * _THICK, top, color=colours.unit(shown), label=label)
            top += height
        for place, height, epsilon in zip(places + offset, top, EPSILONS, strict=True):
            share = height / results.alone[epsilon][name == "house"].mean()
            axes.text(place, height + 0.2, f"{name}\n{share:.0%}", ha="center", va="bottom", color=INK)
    axes.set_xticks(places, [f"epsilon {epsilon:g}" for epsilon in EPSILONS])
    axes.set_xlabel("% of the damage without a caregiver", color=INK)
    axes.margins(y=0.16)
    axes.grid(axis="y")
    axes.legend(bbox_to_anchor=(-0.02, -0.15), ncols=3, **_LEGEND)


def _draw_time(axes: Axes, results: Results) -> None:
    axes.set_title("Mean seconds of a completed phase")
    height = 0.9 * _THICK
    for i, phase in enumerate(PHASES):
        own = results.done[results.done.phase == phase]
        above, below = i - height / 2, i + height / 2
        grid, clear = own.grid.mean(), own.clear.mean()
        colour = colours.unit(_GRID_COLOUR)
        axes.barh(above, grid, _FILLED * height, color=colour, label=None if i else "grid, shortest way")
        axes.text(grid + 0.1, above, f"{grid:.1f}", va="center", color=INK)
        left = 0.0
        for part, title in PARTS.items():
            mean, colour = own[part].mean(), colours.unit(_PART_COLOURS[part])
            axes.barh(below, mean, _FILLED * height, left=left, color=colour, label=None if i else title)
            left += mean
        axes.vlines(clear, below - height / 2, below + height / 2, color=INK, linewidth=1.8,
                    label=None if i else "drive in an empty house")  # fmt: skip
        axes.text(left + 0.1, below, f"{left:.1f}", va="center", color=INK)
    axes.set_yticks(range(len(PHASES)), PHASES)
    axes.invert_yaxis()
    axes.margins(x=0.08)
    axes.grid(axis="x")
    axes.legend(bbox_to_anchor=(-0.1, -0.08), ncols=3, **_LEGEND)

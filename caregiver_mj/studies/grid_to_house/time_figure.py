"""The figure of the robot's time."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from caregiver_mj.studies.grid_to_house.phases import PARTS, PHASES
from caregiver_mj.studies.grid_to_house.results import Results
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.style import INK, STYLE

_STYLE = STYLE | {"axes.grid": False, "axes.titlesize": 10, "axes.titlelocation": "left"}
_PART_COLOURS = dict(
    zip(PARTS, (colours.ROBOT, colours.TODDLER, colours.DAMAGE, colours.STAIRWELL, colours.BIN), strict=True)
)
_GRID_COLOUR = (176, 184, 196)
_LEGEND: dict[str, Any] = {"loc": "upper left", "columnspacing": 1.2, "handlelength": 1.2, "handletextpad": 0.5}
_HEIGHT, _FILLED = 0.36, 0.92  # of a bar: its share of the place, and how much of that it fills


def draw_time(results: Results) -> Figure:
    """The phases' time beside the grid's."""
    with mpl.rc_context(_STYLE):
        figure = Figure((6.4, 3.4), layout="constrained", facecolor="white")
        axes = figure.subplots()
        axes.set_title("Mean seconds of a completed phase")
        for i, phase in enumerate(PHASES):
            own = results.done[results.done.phase == phase]
            above, below = i - _HEIGHT / 2, i + _HEIGHT / 2
            grid, clear = own.grid.mean(), own.clear.mean()
            colour = colours.unit(_GRID_COLOUR)
            axes.barh(above, grid, _FILLED * _HEIGHT, color=colour, label=None if i else "grid, shortest way")
            axes.text(grid + 0.1, above, f"{grid:.1f}", va="center", color=INK)
            left = 0.0
            for part, title in PARTS.items():
                mean, colour = own[part].mean(), colours.unit(_PART_COLOURS[part])
                axes.barh(below, mean, _FILLED * _HEIGHT, left=left, color=colour, label=None if i else title)
                left += mean
            axes.vlines(clear, below - _HEIGHT / 2, below + _HEIGHT / 2, color=INK, linewidth=1.8,
                        label="" if i else "drive in an empty house")  # fmt: skip
            axes.text(left + 0.1, below, f"{left:.1f}", va="center", color=INK)
        axes.set_yticks(range(len(PHASES)), PHASES)
        axes.invert_yaxis()
        axes.margins(x=0.08)
        axes.grid(axis="x")
        axes.legend(bbox_to_anchor=(-0.1, -0.08), ncols=3, **_LEGEND)
    return figure

"""Several panels in a figure, and keys above them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from caregiver_mj.viz.figures.style import HEIGHT, INK, WIDTH

_LETTERS = 13.5  # of a legend, an inch
_HANDLE = 4  # letters that a key's handle takes


def single(height: float = HEIGHT) -> tuple[Figure, Axes]:
    """A figure with one panel, of a height in inches."""
    figure = Figure((WIDTH, height), layout="constrained", facecolor="white")
    return figure, figure.add_subplot()


def panels(titles: Mapping[str, str], columns: int, width: float, height: float) -> tuple[Figure, dict[str, Axes]]:
    """A figure with a panel for each of some keys, row by row, on the same axes.

    Args:
        titles: What stands over each panel.
        columns: How many in a row.
        width: Of the figure, inches.
        height: Of a row, inches.
    """
    columns = min(columns, len(titles))
    rows = math.ceil(len(titles) / columns)
    figure = Figure((width, height * rows + 0.55), layout="constrained", facecolor="white")
    grid = np.atleast_1d(figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)).ravel()
    size = 9.5 if width / columns > WIDTH / 3 else 8.8  # points, or titles side by side would touch
    found = dict(zip(titles, grid, strict=False))
    for key, axes in found.items():
        axes.set_title(titles[key], loc="left", fontsize=size, fontweight="bold", color=INK, pad=4)
    for spare, above in zip(grid[len(titles) :], grid[len(titles) - columns :], strict=False):
        spare.set_visible(False)
        above.tick_params(labelbottom=True)  # nothing stands below it
    return figure, found


def explain(figure: Figure, keys: Mapping[str, Any], most: int = 3) -> None:
    """Explains the keys above the axes, at most so many in a row, which Matplotlib fills column by column."""
    columns = min(most, len(keys))
    while columns > 1 and _letters(list(keys), columns) > _LETTERS * figure.get_figwidth():
        columns -= 1
    in_columns = [list(keys.items())[i::columns] for i in range(columns)]
    names, artists = zip(*(key for column in in_columns for key in column), strict=True)
    figure.legend(
        artists, names, loc="outside upper left", ncols=columns, columnspacing=1, handlelength=1.2, handletextpad=0.5
    )


def _letters(names: list[str], columns: int) -> int:
    """How wide a row of keys is: of each column the longest name, and its handle."""
    return sum(max(map(len, names[i::columns])) + _HANDLE for i in range(columns))

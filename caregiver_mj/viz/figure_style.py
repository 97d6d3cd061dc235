"""Style of all figures, with panels, legends, series and files."""

from __future__ import annotations

import dataclasses
import io
import math
import textwrap
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from caregiver_mj.viz import colours

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType


mpl.rcdefaults()  # not those of a matplotlibrc, perhaps a stranger's, in the working folder
ALONE, GUARDED = colours.DAMAGE, colours.ROBOT  # without and with the caregiver
WIDTH, HEIGHT = 4.2, 3.2  # inches
INK, FAINT, RULE = "#1b212b", "#6b7686", "#dfe3e8"
MUTED = "#8f99a8"  # colour of things that are not highlighted
PUBLISHED: dict[str, Any] = {"marker": "D", "color": "white", "mec": INK, "ms": 5.5, "linestyle": "none"}
# The bare-tables baseline.
REFERENCE_LINE: dict[str, Any] = {"color": INK, "linewidth": 1.4, "linestyle": (0, (3, 1.5)), "zorder": 3}
STYLE: dict[RcKeyType, Any] = {
    "font.size": 9.5,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "grid.color": RULE,
    "xtick.color": INK,
    "xtick.major.size": 0,
    "ytick.color": INK,
    "ytick.major.size": 0,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "svg.hashsalt": "caregiver_mj",  # equal figures are equal files
}
_LETTERS = 13.5  # characters per inch of a legend or title
_LABELS = 0.35  # inches beside a panel, for its labels and the next one's
_HANDLE = 4  # characters; width of a key's handle


def as_bytes(figure: Figure, kind: str) -> bytes:
    """Return the file of a figure, "svg" or "png"."""
    file = io.BytesIO()
    with mpl.rc_context(STYLE):
        figure.savefig(file, format=kind, dpi=200, metadata={"Date": None} if kind == "svg" else None)
    return file.getvalue()


def single(height: float = HEIGHT) -> tuple[Figure, Axes]:
    """Return a figure with one panel, of a height in inches."""
    figure = Figure((WIDTH, height), layout="constrained", facecolor="white")
    return figure, figure.add_subplot()


def panels(titles: Mapping[str, str], columns: int, width: float, height: float) -> tuple[Figure, dict[str, Axes]]:
    """Return a figure with a panel for each title, row by row, on common axes.

    `width` is that of the figure, `height` that of a row, in inches.
    """
    columns = min(columns, len(titles))
    rows = math.ceil(len(titles) / columns)
    figure = Figure((width, height * rows + 0.55), layout="constrained", facecolor="white")
    grid = np.atleast_1d(figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)).ravel()
    size = 9.5 if width / columns > WIDTH / 3 else 8.8  # points; smaller titles in narrow panels
    found = dict(zip(titles, grid, strict=False))
    for key, axes in found.items():
        tied = titles[key].replace(" %", "\N{NO-BREAK SPACE}%")
        title = textwrap.fill(tied, int(_LETTERS * (width / columns - _LABELS)), break_long_words=False)
        axes.set_title(title, loc="left", fontsize=size, fontweight="bold", color=INK, pad=4)
    for spare, above in zip(grid[len(titles) :], grid[len(titles) - columns :], strict=False):
        spare.set_visible(False)
        above.tick_params(labelbottom=True)  # the panel below is missing
    return figure, found


def explain(figure: Figure, keys: Mapping[str, Any], most: int = 3) -> Figure:
    """Return a figure with a legend above, of at most `most` keys in a row; Matplotlib fills it column by column."""

    def letters(columns: int) -> int:
        """Return the width in characters: the longest name of each column, and its handle."""
        return sum(max(map(len, list(keys)[i::columns])) + _HANDLE for i in range(columns))

    columns = min(most, len(keys))
    while columns > 1 and letters(columns) > _LETTERS * figure.get_figwidth():
        columns -= 1
    in_columns = [list(keys.items())[i::columns] for i in range(columns)]
    names, artists = zip(*(key for column in in_columns for key in column), strict=True)
    figure.legend(
        artists, names, loc="outside upper left", ncols=columns, columnspacing=1, handlelength=1.2, handletextpad=0.5
    )
    return figure


@dataclasses.dataclass(frozen=True)
class Series:
    """A quantity for each novice or family, (families,) each, NaN if undefined."""

    label: str  # name in the legend
    mean: np.ndarray  # means
    low: np.ndarray  # lower ends of their intervals
    high: np.ndarray  # upper ends, NaN also if unbounded
    sd: np.ndarray | None = None  # standard deviations, if they are shown
    published: np.ndarray | None = None  # the paper's means, if any

"""How all figures look, and how they become files."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
from matplotlib.figure import Figure

from caregiver_mj.viz import colours

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

ALONE, GUARDED = colours.DAMAGE, colours.ROBOT  # without and with the caregiver

WIDTH, HEIGHT = 4.2, 3.2  # inches
INK, FAINT, RULE = "#1b212b", "#6b7686", "#dfe3e8"
MUTED = "#8f99a8"  # of what does not stand out
PUBLISHED: dict[str, Any] = {
    "marker": "D",
    "color": "white",
    "markeredgecolor": INK,
    "markersize": 5.5,
    "linestyle": "none",
}
FLOOR_LINE: dict[str, Any] = {  # what remains with bare tables alone
    "color": INK,
    "linewidth": 1.4,
    "linestyle": (0, (3, 1.5)),
    "zorder": 3,
}
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
    "svg.hashsalt": "caregiver_mj",  # the same figure is the same file
}


def as_bytes(figure: Figure, kind: str) -> bytes:
    """The file of a figure, "svg" or "png"."""
    file = io.BytesIO()
    with mpl.rc_context(STYLE):
        figure.savefig(file, format=kind, dpi=200, metadata={"Date": None} if kind == "svg" else None)
    return file.getvalue()

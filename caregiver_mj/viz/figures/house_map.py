"""The house from above, with how often or how much of something in every cell."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import matplotlib.colors
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch, Polygon, Rectangle

from caregiver_mj.plans.cell_graph import BIN, CANDLE, TABLE, Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import Where
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import Colour, unit
from caregiver_mj.viz.figures.style import STYLE, WIDTH

# From nothing to most, on the dark ground of a map.
WENT = (colours.FLOOR, (52, 78, 118), (128, 138, 126), colours.TODDLER)
HURT = (colours.FLOOR, (116, 44, 42), colours.DAMAGE, (255, 226, 150))


def heat_map(plan: FloorPlan, values: np.ndarray, scale: Sequence[Colour], top: float, quantity: str) -> Figure:
    """Return the house from above, its free cells coloured by values, (free cells,), on a scale from zero to `top`."""
    rows, columns = plan.shape
    ground, text = unit(colours.GROUND), unit(colours.TEXT)
    heat = matplotlib.colors.LinearSegmentedColormap.from_list("heat", [unit(colour) for colour in scale])
    norm = matplotlib.colors.PowerNorm(0.5, 0, top or 1.0)  # square roots, or a few cells would outshine all others
    with mpl.rc_context({**STYLE, "axes.grid": False, "text.color": text, "xtick.color": text}):
        below = 0.62  # inches for the colour bar
        height = WIDTH * rows / columns + below
        figure = Figure((WIDTH, height), facecolor=ground)
        axes = figure.add_axes((0, below / height, 1, 1 - below / height))
        axes.set_axis_off()
        axes.set(xlim=(-0.5, columns - 0.5), ylim=(rows - 0.5, -0.5), aspect="equal")
        axes.add_patch(Rectangle((-0.5, -0.5), columns, rows, facecolor=unit(colours.WALL), linewidth=0))
        for cell in plan.cells_of(CANDLE, TABLE, BIN):
            axes.add_patch(_square(cell, unit(colours.FLOOR)))
        for cell, value in zip(plan.free_cells, values, strict=True):
            axes.add_patch(_square(cell, heat(norm(value))))
        _furnish(axes, plan)
        _add_colour_bar(
            figure.add_axes((0.03, 0.44 / height, 0.94, 0.09 / height)),
            mpl.cm.ScalarMappable(norm, heat),
            [tick for tick in _ticks(top) if tick <= top],
            quantity,
        )
    return figure


def _add_colour_bar(axes: Axes, scale: mpl.cm.ScalarMappable, ticks: Sequence[float], quantity: str) -> None:
    legend = axes.figure.colorbar(scale, axes, orientation="horizontal")
    legend.outline.set_visible(False)
    legend.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    axes.tick_params(labelsize=9, pad=2)
    axes.set_xlabel(quantity, fontsize=9, color=unit(colours.TEXT), labelpad=2)


def _ticks(top: float) -> np.ndarray:
    """Round numbers for a scale of square roots."""
    if top <= 0:
        return np.zeros(1)
    step = 10.0 ** np.floor(np.log10(top))
    step *= max(s for s in (1, 2, 5) if s * step <= top)
    return np.array([0.0, 0.1, 0.4, 1.0, 2.0]) * step


def _square(cell: Cell, colour: tuple[float, ...]) -> Rectangle:
    # Drawn a little larger, or viewers show seams between the cells.
    return Rectangle((cell[1] - 0.505, cell[0] - 0.505), 1.01, 1.01, facecolor=colour, linewidth=0)


def _furnish(axes: Axes, plan: FloorPlan) -> None:
    """Draw what stands in the house at the start, as the films' display does."""
    for hazard, (row, column) in zip(plan.hazards.at(Where.OPENING), plan.stairwells, strict=True):
        axes.add_patch(_square((row, column), unit(colours.mix(hazard.kind.colour, colours.GROUND, 0.6))))
        for tread in range(4):
            y = row - 0.5 + (tread + 0.5) / 4
            ends = (column - 0.5, column + 0.5)
            axes.plot(ends, (y, y), color=unit(hazard.kind.colour), lw=2, solid_capstyle="butt")
    for cells, colour in ((plan.tables, colours.TABLE), (plan.cells_of(BIN), colours.BIN)):
        for row, column in cells:
            box = FancyBboxPatch(
                (column - 0.26, row - 0.26), 0.52, 0.52, "round,pad=0.1", facecolor=unit(colour), linewidth=0
            )
            axes.add_patch(box)
    for hazard, cell in zip(plan.hazards.at(Where.FLOOR), plan.floor_cells, strict=True):
        y, x = plan.free_cells[cell]
        axes.add_patch(Circle((x, y), 0.16, facecolor=unit(hazard.kind.colour), linewidth=0))
    for hazard, table in zip(plan.hazards.at(Where.ON_TABLE), plan.candle_tables, strict=True):
        (y, x), r = plan.tables[table], 0.17
        y += 0.4 * r
        flame = [(x, y - 2.3 * r), (x + 0.95 * r, y - 0.3 * r), (x - 0.95 * r, y - 0.3 * r)]
        axes.add_patch(Polygon(flame, facecolor=unit(hazard.kind.colour), linewidth=0))
        axes.add_patch(Circle((x, y), r, facecolor=unit(hazard.kind.colour), linewidth=0))
        axes.add_patch(Circle((x, y + 0.1 * r), 0.45 * r, facecolor=unit(colours.FLAME), linewidth=0))

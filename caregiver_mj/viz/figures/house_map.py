"""Maps of the house, with a quantity in every cell."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import matplotlib.colors
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image, ImageDraw

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import Where
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import Colour, unit
from caregiver_mj.viz.figures.style import STYLE, WIDTH
from caregiver_mj.viz.hud.cards import FINE
from caregiver_mj.viz.hud.chart import GroundPlan

# Colour scales from zero, on the dark ground of a map.
WENT = (colours.FLOOR, (52, 78, 118), (128, 138, 126), colours.TODDLER)
HURT = (colours.FLOOR, (116, 44, 42), colours.DAMAGE, (255, 226, 150))
_ACROSS = 900  # pixels; greatest width


def heat_map(plan: FloorPlan, values: np.ndarray, scale: Sequence[Colour], top: float, quantity: str) -> Figure:
    """Return a map with free cells coloured by values, (free cells,), on a scale from 0 to `top`."""
    rows, columns = plan.shape
    heat = matplotlib.colors.LinearSegmentedColormap.from_list("heat", [unit(colour) for colour in scale])
    norm = matplotlib.colors.PowerNorm(0.5, 0, top or 1.0)  # square roots, because a few cells have much greater values
    text = unit(colours.TEXT)
    with mpl.rc_context({**STYLE, "axes.grid": False, "text.color": text, "xtick.color": text}):
        below = 0.62  # inches for the colour bar
        height = WIDTH * rows / columns + below
        figure = Figure((WIDTH, height), facecolor=unit(colours.GROUND))
        axes = figure.add_axes((0, below / height, 1, 1 - below / height))
        axes.set_axis_off()
        axes.imshow(_house(plan, heat(norm(values), bytes=True)), interpolation="none")
        _add_colour_bar(
            figure.add_axes((0.03, 0.44 / height, 0.94, 0.09 / height)),
            mpl.cm.ScalarMappable(norm, heat),
            [tick for tick in _ticks(top) if tick <= top],
            quantity,
        )
    return figure


def _house(plan: FloorPlan, shades: np.ndarray) -> Image.Image:
    """Return the house at the start in the style of the chart, with shades of its free cells, (cells, 4)."""
    rows, columns = plan.shape
    cell = max(1, _ACROSS // columns)
    ground = GroundPlan(plan, cell, pad=0)
    drawn = ground.draw(Image.new("RGB", (columns * cell, rows * cell)))
    canvas = ImageDraw.Draw(drawn)
    for place, shade in zip(plan.free_cells, shades.tolist(), strict=True):
        canvas.rectangle(ground.square(place), tuple(shade))
    for hazard, index in zip(plan.hazards.at(Where.FLOOR), plan.floor_cells, strict=True):
        ground.draw_disc(canvas, plan.position(plan.free_cells[index]), hazard.kind.colour)
    for hazard, table in zip(plan.hazards.at(Where.ON_TABLE), plan.candle_tables, strict=True):
        ground.draw_candle(canvas, plan.position(plan.tables[table]), hazard.kind.colour, halo=False)
    return drawn.reduce(FINE)


def _add_colour_bar(axes: Axes, scale: mpl.cm.ScalarMappable, ticks: Sequence[float], quantity: str) -> None:
    legend = axes.figure.colorbar(scale, axes, orientation="horizontal")
    legend.outline.set_visible(False)
    legend.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    axes.tick_params(labelsize=9, pad=2)
    axes.set_xlabel(quantity, fontsize=9, color=unit(colours.TEXT), labelpad=2)


def _ticks(top: float) -> np.ndarray:
    """Return round numbers for a scale of square roots."""
    if top <= 0:
        return np.zeros(1)
    step = 10.0 ** np.floor(np.log10(top))
    step *= max((s for s in (1, 2, 5) if s * step <= top), default=1)  # the logarithm may have been rounded up
    return np.array([0.0, 0.1, 0.4, 1.0, 2.0]) * step

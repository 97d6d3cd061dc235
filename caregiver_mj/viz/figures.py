"""Figures of the report and of studies, from arrays or tables.

They fit a column some 400 pixels wide, to be legible on a phone: bars as in the paper's figures 2 to 4, damage left by
house and by kind, toys kept, survival curves, and maps.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import matplotlib.colors
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image, ImageDraw

from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.experiments.spec import BARE_TABLES
from caregiver_mj.plans import hazards
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz import colours
from caregiver_mj.viz import figure_style as style
from caregiver_mj.viz.chart import FINE, GroundPlan
from caregiver_mj.viz.colours import Colour, unit
from caregiver_mj.viz.figure_style import ALONE, GUARDED, INK, STYLE, Series, explain, panels, single

if TYPE_CHECKING:
    import pandas as pd  # for annotations only

KINDS = {f"damage_{kind.name}": kind.at for kind in hazards.KINDS}
_OF_THE_PAPER = 3  # number of the paper's kinds, the first ones; others are omitted if they do no damage
_COLOURS = {f"damage_{kind.name}": kind.colour for kind in hazards.KINDS}
_SERIES = ((colours.ROBOT, "o"), (colours.BIN, "s"), (colours.STAIRWELL, "^"), (colours.CANDLE, "v"))
_OTHERS = ((colours.BIN, (0, (5, 1.5))), (colours.STAIRWELL, (0, (2, 1))), (colours.CANDLE, (0, (5, 1, 1, 1))))
_HIGHEST = 2.0  # share; greatest end of the axis due to an interval
_MOST = 2.0  # greatest share left on the axis of the houses; greater ones are drawn at its end
_WIDTH = 0.37  # width of a bar, where pairs have a distance of 1
_ROW, _BARE_ROW = 0.2, 0.15  # inches; height of a caregiver's row, with points and without
_MANY = 2000  # points; more are drawn as an image, to keep the file small
_SPREAD = 0.32  # rows; greatest offset of a point from its caregiver's line
_GOLDEN = 0.618034  # its multiples, modulo 1, are spread evenly


# -- Bars and shares by children -----------------------------------------------------------------------


@mpl.rc_context(STYLE)
def damage_left(novices: Sequence[str], series: Sequence[Series], bare_tables: Series | None = None) -> Figure:
    """Return the share of damage left, a marker with its interval for each novice or family.

    A line for each of them shows the share of bare tables only.
    """
    figure, axes = single()
    tallest = max(np.nanmax([*s.high, *s.mean, 0]) for s in series)
    known = max(1.0, *(np.nanmax([*s.mean, 0]) for s in series))
    axes.set(ylabel="damage left", ylim=(0, max(1.15, 1.05 * known, min(1.05 * tallest, _HIGHEST))))
    keys = _of_alone(axes, novices, series)
    if bare_tables is not None:
        places = np.arange(len(novices))
        keys["floor"] = axes.hlines(bare_tables.mean, places - 0.4, places + 0.4, **style.REFERENCE_LINE)
    axes.text(len(novices) - 0.52, 1.015, "no caregiver", ha="right", va="bottom", color=INK, fontsize=9)
    return explain(figure, keys)


@mpl.rc_context(STYLE)
def toys_kept(novices: Sequence[str], series: Sequence[Series], margin: float) -> Figure:
    """Return the same figure of toys kept, with a line at the margin of loss."""
    figure, axes = single(0.8 * style.HEIGHT)
    known = [mean for one in series for mean in one.mean if np.isfinite(mean)] or [1.0]
    bottom, top = max(0.0, min(0.85, min(known) - 0.1)), min(_HIGHEST, max(1.15, max(known) + 0.1))
    axes.set(ylabel="toys kept", ylim=(bottom, top))
    keys = _of_alone(axes, novices, series)
    keys[f"{100 * margin:g} % lost"] = axes.axhline(1 - margin, **style.REFERENCE_LINE)
    return explain(figure, keys)


def _of_alone(axes: Axes, novices: Sequence[str], series: Sequence[Series]) -> dict[str, Any]:
    """Draw means and intervals side by side, with a line at 1; return the legend's keys."""
    places, (bottom, top) = np.arange(len(novices)), axes.get_ylim()
    published = next((s.published for s in series if s.published is not None), np.full(len(places), np.nan))
    count = len(series) + bool(np.isfinite(published).any())
    offsets = (np.arange(count) - (count - 1) / 2) * min(0.18, 0.7 / count)
    keys: dict[str, Any] = {}
    for one, (colour, marker), offset in zip(series, itertools.cycle(_SERIES), offsets, strict=False):
        x, known = places + offset, np.isfinite(one.mean)
        low = np.where(known & np.isnan(one.low), bottom, one.low)  # it has no lower end
        high = np.where(known & np.isnan(one.high), top, one.high)
        axes.vlines(x, low, high, color=unit(colour), linewidth=2.4)
        (keys[one.label],) = axes.plot(x, one.mean, marker, color=unit(colour), mec=INK, mew=0.6, ms=6.5)
    if count > len(series):
        (keys["published"],) = axes.plot(places + offsets[-1], published, **style.PUBLISHED)
    axes.axhline(1.0, color=unit(ALONE), linewidth=1.6)
    axes.set_xticks(places, novices)
    axes.set_xlim(-0.5, len(novices) - 0.5)
    return keys


@mpl.rc_context(STYLE)
def bars(novices: Sequence[str], alone: Series, guarded: Series, quantity: str, top: float | None = None) -> Figure:
    """Return bars for each novice or family, without and with the caregiver, as in the paper's figures.

    Both series must have standard deviations. `top` is the greatest possible value, if there is one.
    """
    figure, axes = single()
    places, width = np.arange(len(novices)), 0.38
    keys: dict[str, Any] = {}
    for series, colour, offset in ((alone, ALONE, -width / 2), (guarded, GUARDED, width / 2)):
        x = places + offset
        keys[series.label] = axes.bar(x, series.mean, 0.92 * width, color=unit(colour))
        # Within the range of the quantity.
        ends = np.clip([series.mean - series.sd, series.mean + series.sd], 0.0, top)
        keys["standard deviation"] = axes.errorbar(
            x, series.mean, np.abs(ends - series.mean), fmt="none", ecolor=style.FAINT, elinewidth=1, capsize=3
        )
        interval = axes.vlines(x, series.low, series.high, color=INK, linewidth=3.2)
        if np.isfinite(series.low).any():
            keys["95 % interval"] = interval
        if series.published is not None and np.isfinite(series.published).any():
            (keys["published"],) = axes.plot(x + 0.25 * width, series.published, **style.PUBLISHED)
    axes.set_xticks(places, novices)
    axes.set_ylabel(quantity)
    if top is not None:
        axes.set(ylim=(0, 1.16 * top), yticks=np.linspace(0, top, 5))
    order = [alone.label, guarded.label, "published", "standard deviation", "95 % interval"]
    return explain(figure, {name: keys[name] for name in order if name in keys})


def kinds_in(means: pd.DataFrame) -> dict[str, str]:
    """Return the names of the kinds to show of a table of means, by column; rows of older versions may lack some."""
    damaging = [kind for kind in KINDS if f"{kind}_mean" in means and means[f"{kind}_mean"].any()]
    return {kind: name for i, (kind, name) in enumerate(KINDS.items()) if i < _OF_THE_PAPER or kind in damaging}


@mpl.rc_context(STYLE)
def kinds(means: pd.DataFrame, names: Mapping[str, str], *, caregiver: str = "paper") -> Figure:
    """Return stacked bars of damage by kind, without and with a caregiver, as shares of all damage without.

    Args:
        means: A row for each `caregiver` and `family`, with `damage_mean` and the mean of each of `KINDS`.
        names: Names of the families to show.
        caregiver: The caregiver.
    """
    rows = means.set_index(["caregiver", "family"])
    figure, axes = single()
    keys: dict[str, Any] = {}
    highest = 1.0
    for place, family in enumerate(names):
        whole = float(rows.loc[("none", family), "damage_mean"])
        for who, x in (("none", place - _WIDTH / 2), (caregiver, place + _WIDTH / 2)):
            row, bottom = rows.loc[(who, family)], 0.0
            for kind, name in kinds_in(means).items():
                share = float(row[f"{kind}_mean"]) / whole if whole else 0.0
                drawn = axes.bar(x, share, 0.92 * _WIDTH, bottom, color=unit(_COLOURS[kind]))
                keys.setdefault(name, drawn)
                bottom += share
            highest = max(highest, bottom)
            damage = f"{row['damage_mean']:.1f}"
            axes.text(x, bottom + 0.012, damage, ha="center", va="bottom", color=INK, fontsize=7.5)
        if (BARE_TABLES, family) in rows.index and whole:
            level = float(rows.loc[(BARE_TABLES, family), "damage_mean"]) / whole
            keys["floor"] = axes.hlines(level, place - _WIDTH, place + _WIDTH, **style.REFERENCE_LINE)
    axes.set_xticks(np.arange(len(names)), list(names.values()))
    axes.set(ylim=(0, 1.1 * highest), ylabel="share of the damage without")
    which = f"left bar: none; right bar: {caregiver}"
    axes.text(1, 1, which, transform=axes.transAxes, ha="right", va="bottom", fontsize=8, color=style.FAINT)
    return explain(figure, keys, most=4)


# -- Curves, and points of houses ------------------------------------------------------------------------


@mpl.rc_context({**STYLE, "axes.grid.axis": "both"})
def survival(
    episodes: pd.DataFrame, names: Mapping[str, str], caregivers: Sequence[str], *, caregiver: str = "paper"
) -> Figure:
    """Return the share of episodes that are not yet stopped, over time, in a panel for each family.

    Args:
        episodes: A row an episode, with `caregiver`, `family`, `timesteps_to_threshold` and `stopped`.
        names: Names of the families.
        caregivers: The caregivers to show: at most three beside `caregiver`, `none` and the bare-tables baseline.
        caregiver: The highlighted caregiver.
    """
    looks: dict[str, dict[str, Any]] = {
        "none": {"color": unit(ALONE), "linewidth": 1.8},
        caregiver: {"color": unit(GUARDED), "linewidth": 2.2},
        BARE_TABLES: dict(style.REFERENCE_LINE),
    }
    others = [name for name in caregivers if name not in looks]
    for name, (colour, line) in zip(others, _OTHERS, strict=False):
        looks[name] = {"color": unit(colour), "linewidth": 1.4, "linestyle": line}
    time = np.arange(EPISODE_TIMESTEPS + 1)
    figure, found = panels(names, 3, style.WIDTH, 1.3)
    keys: dict[str, Any] = {}
    for family, axes in found.items():
        for name in caregivers:
            chosen = episodes[(episodes["caregiver"] == name) & (episodes["family"] == family)]
            (keys["alone" if name == "none" else name],) = axes.plot(time, going(chosen, time), **looks[name])
        axes.set(xlim=(0, EPISODE_TIMESTEPS), ylim=(0, 1.04), xticks=range(0, EPISODE_TIMESTEPS + 1, 100))
    figure.supxlabel("timesteps", fontsize=9.5, color=INK)
    figure.supylabel("not yet stopped", fontsize=9.5, color=INK)
    return explain(figure, keys, most=4)


def going(episodes: pd.DataFrame, time: np.ndarray) -> np.ndarray:
    """Return the share of episodes that continue after each of some timesteps, (timesteps,)."""
    stop = np.where(episodes["stopped"] > 0, episodes["timesteps_to_threshold"], np.inf)
    return (stop[:, None] > time).mean(axis=0)


@mpl.rc_context({**STYLE, "axes.grid.axis": "x"})
def houses(
    by_house: pd.DataFrame, means: pd.DataFrame, names: Mapping[str, str], *, caregiver: str, columns: int = 1
) -> Figure:
    """Return the damage left in every house by every caregiver: a panel for each family, a row for each caregiver.

    Args:
        by_house: A row for each house, `caregiver` and `family`, with `damage_left`, NaN if undefined; or none.
        means: A row for each `caregiver`, in the order of the figure, and `family`, with `damage_left`,
            `damage_left_ci_low` and `_ci_high`, NaN if undefined.
        names: Names of the families to show.
        caregiver: The highlighted caregiver.
        columns: Number of panels side by side.
    """
    caregivers = [name for name in dict.fromkeys(means["caregiver"]) if name not in ("none", BARE_TABLES)]
    row = _ROW if len(by_house) else _BARE_ROW
    limit = _limit(by_house[by_house["caregiver"].isin(caregivers)], means)
    width = style.WIDTH if columns == 1 else 1.2 + 1.75 * columns
    figure, found = panels(names, columns, width, 0.42 + row * len(caregivers))
    keys: dict[str, Any] = {}
    for family, axes in found.items():
        points, middles = (table[table["family"] == family] for table in (by_house, means))
        keys |= _panel(axes, points, middles.set_index("caregiver"), caregivers, caregiver, limit)
        if BARE_TABLES in set(middles["caregiver"]):
            level = float(middles.set_index("caregiver").loc[BARE_TABLES, "damage_left"])
            keys["floor"] = axes.axvline(level, **style.REFERENCE_LINE)
        keys["no caregiver"] = axes.axvline(1.0, color=unit(ALONE), linewidth=1.4, zorder=1)
        axes.set_yticks(range(len(caregivers)), caregivers)
        axes.set(ylim=(len(caregivers) - 0.45, -0.55), xlim=(0, limit))
    figure.supxlabel("damage left", fontsize=9.5, color=INK)
    return explain(figure, keys, most=3 if columns == 1 else 5)


def _panel(
    axes: Axes, points: pd.DataFrame, means: pd.DataFrame, caregivers: list[str], main: str, limit: float
) -> dict[str, Any]:
    """Draw a family's points and means; return the legend's keys."""
    keys: dict[str, Any] = {}
    for row, name in enumerate(caregivers):
        colour = unit(GUARDED) if name == main else style.MUTED
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
        (middle,) = axes.plot(mean, row, "D", color="white", mec=INK, mew=1, ms=4.6, zorder=5)
        keys |= {"a house": drawn, "mean over houses": middle} if len(left) else {"mean": middle}
        keys["95 % interval"] = interval
    return keys


def _limit(points: pd.DataFrame, means: pd.DataFrame) -> float:
    """Return the right end of the axis, beyond all means and nearly all houses."""
    left = points["damage_left"].dropna().to_numpy(float)
    middles = means.loc[means["caregiver"] != "none", ["damage_left", "damage_left_ci_high"]].to_numpy(float)
    wanted = [1.1, *1.03 * middles[np.isfinite(middles)], *([np.quantile(left, 0.97)] if len(left) else [])]
    return float(min(max(wanted), _MOST))


# -- Maps of a house -----------------------------------------------------------------------------------

# Colour scales from zero, on the dark ground of a map.
WENT = (colours.FLOOR, (52, 78, 118), (128, 138, 126), colours.TODDLER)
HURT = (colours.FLOOR, (116, 44, 42), colours.DAMAGE, (255, 226, 150))
_ACROSS = 900  # pixels; greatest width
_TEXT = unit(colours.TEXT)


@mpl.rc_context({**STYLE, "axes.grid": False, "text.color": _TEXT, "xtick.color": _TEXT})
def heat_map(plan: FloorPlan, values: np.ndarray, scale: Sequence[Colour], top: float, quantity: str) -> Figure:
    """Return a map with free cells coloured by values, (free cells,), on a scale from 0 to `top`."""
    rows, columns = plan.shape
    heat = matplotlib.colors.LinearSegmentedColormap.from_list("heat", [unit(colour) for colour in scale])
    norm = matplotlib.colors.PowerNorm(0.5, 0, top or 1.0)  # square roots, because a few cells have much greater values
    below = 0.62  # inches for the colour bar
    height = style.WIDTH * rows / columns + below
    figure = Figure((style.WIDTH, height), facecolor=unit(colours.GROUND))
    axes = figure.add_axes((0, below / height, 1, 1 - below / height))
    axes.set_axis_off()
    axes.imshow(_house(plan, heat(norm(values), bytes=True)), interpolation="none")
    bar = figure.add_axes((0.03, 0.44 / height, 0.94, 0.09 / height))
    legend = figure.colorbar(mpl.cm.ScalarMappable(norm, heat), bar, orientation="horizontal")
    legend.outline.set_visible(False)
    ticks = [tick for tick in _ticks(top) if tick <= top]
    legend.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    bar.tick_params(labelsize=9, pad=2)
    bar.set_xlabel(quantity, fontsize=9, color=_TEXT, labelpad=2)
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
    for hazard, index in zip(plan.hazards.at(hazards.Where.FLOOR), plan.floor_cells, strict=True):
        ground.draw_disc(canvas, plan.position(plan.free_cells[index]), hazard.kind.colour)
    for hazard, table in zip(plan.hazards.at(hazards.Where.ON_TABLE), plan.candle_tables, strict=True):
        ground.draw_candle(canvas, plan.position(plan.tables[table]), hazard.kind.colour, halo=False)
    return drawn.reduce(FINE)


def _ticks(top: float) -> np.ndarray:
    """Return round numbers for a scale of square roots."""
    if top <= 0:
        return np.zeros(1)
    step = 10.0 ** np.floor(np.log10(top))
    step *= max((s for s in (1, 2, 5) if s * step <= top), default=1)  # the logarithm may have been rounded up
    return np.array([0.0, 0.1, 0.4, 1.0, 2.0]) * step

"""The page's figure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from caregiver_mj.experiments import two_level
from caregiver_mj.studies.generalisation.measure import (
    ALIKE,
    CHANGES,
    CHILDREN,
    FAMILIES,
    NONE,
    RULE,
    Found,
    foresight,
)
from caregiver_mj.studies.generalisation.priors import HOW, WHOSE
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.style import INK, MUTED, STYLE

_COLOURS = [colours.unit(colour) for colour in (colours.ROBOT, colours.BIN, colours.CANDLE, colours.STAIRWELL)]


def draw(found: Sequence[Found]) -> Figure:
    """How well P(safe) tells as time goes on; what that is worth with two children; and children that change."""
    with mpl.rc_context(STYLE):
        figure = Figure((11.0, 3.4), layout="constrained")
        telling, two, changing = figure.subplots(1, 3)
        _telling(telling, found)
        _two(two, found)
        _changing(changing, found)
    return figure


def _telling(axes: Axes, found: Sequence[Found]) -> None:
    for whose, colour in zip(WHOSE, _COLOURS, strict=False):
        for how, line in zip(HOW, ("-", ":"), strict=True):
            courses = np.mean([one.telling[whose, how].course for one in found], axis=0)
            label = f"{whose}, {how}"
            axes.plot(np.arange(1, len(courses) + 1), courses, line, color=colour, label=label)
    axes.set_title("telling epsilon below .5 from above", fontsize=10)
    axes.set_xlabel("timesteps watched")
    axes.set_ylabel("area under the curve, mean over houses")
    axes.legend(fontsize=7.5, title="experts", title_fontsize=7.5, loc="center right")


def _two(axes: Axes, found: Sequence[Found]) -> None:
    for i, (whose, colour) in enumerate(zip(WHOSE, _COLOURS, strict=False)):
        differences = two_level.of_difference([one.two[whose] for one in found], [one.two[ALIKE] for one in found])
        place = np.arange(len(FAMILIES)) + (i - 1) * 0.18
        _bars(axes, place, differences, color=colour, label=whose)
    axes.axhline(0, color=INK, linewidth=0.8)
    axes.set_xticks(range(len(FAMILIES)), [family.replace(",", " and ") for family in FAMILIES])
    axes.set_title("two children: damage, less that without P(safe)", fontsize=10)
    axes.legend(fontsize=7.5, title="experts (draw)", title_fontsize=7.5)


def _changing(axes: Axes, found: Sequence[Found]) -> None:
    alone = [one.changing[NONE] for one in found]
    names = [RULE, *map(foresight, CHANGES)]
    places = np.arange(len(names))
    shades = [MUTED, _COLOURS[0], _COLOURS[1], INK, _COLOURS[2]]
    left = [two_level.of_ratio([one.changing[name] for one in found], alone) for name in names]
    for i, (child, shade) in enumerate(zip(CHILDREN, shades, strict=True)):
        estimate = np.array([[part[i] for part in one] for one in left]).T
        _bars(axes, places + (i - 2) * 0.13, estimate, color=shade, label=child)
    axes.set_xticks(places, ["rule", *(f"{change:g}" for change in CHANGES)])
    axes.set_xlabel("the rule; foresight, by its change")
    axes.set_title("children that change: damage left", fontsize=10)
    axes.set_ylim(bottom=0)
    axes.legend(fontsize=7.5, ncols=2)


def _bars(axes: Axes, place: np.ndarray, estimate: Iterable[np.ndarray], **options: Any) -> None:
    value, low, high = (np.asarray(part, float) for part in estimate)
    axes.errorbar(place, value, [value - low, high - value], fmt="o", markersize=4, linewidth=1, **options)

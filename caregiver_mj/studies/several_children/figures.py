"""The page's figure."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from caregiver_mj.studies.several_children.measure import CAREGIVERS, FAMILIES


def draw(found: list[dict[str, Any]]) -> Figure:
    """Damage left by each caregiver: a panel for each world and house, a group of bars for each family."""
    panels = list(dict.fromkeys((row["world"], row["house"]) for row in found))
    names = [name for name in CAREGIVERS["grid"] if name != "none"]
    figure = Figure(figsize=(4.2 * len(panels), 3.6), layout="constrained")
    for axes, (world, house) in zip(
        figure.subplots(1, len(panels), sharey=True, squeeze=False)[0], panels, strict=True
    ):
        for i, name in enumerate(names):
            part = [r for r in found if (r["world"], r["house"], r["caregiver"]) == (world, house, name)]
            if not part:
                continue
            left, low, high = np.array([row["left"] for row in part]).T
            place = np.arange(len(part)) + (i - (len(names) - 1) / 2) * 0.16
            axes.bar(
                place,
                left,
                0.15,
                label=name,
                color=f"C{i}",
                yerr=[left - low, high - left],
                error_kw={"linewidth": 0.8},
            )
        axes.set_xticks(range(len(FAMILIES)), [f"epsilon {family.replace(',', ' and ')}" for family in FAMILIES])
        axes.set_title(f"{world} '{house}'", fontsize=10)
        axes.spines[["top", "right"]].set_visible(False)
    figure.axes[0].set_ylabel("share of the damage that is left")
    figure.axes[0].legend(fontsize=8, frameon=False, ncols=2)
    figure.axes[0].set_ylim(top=1.0)
    return figure

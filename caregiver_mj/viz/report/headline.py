"""The result of a run in a few numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.experiments.samples import Sample
from caregiver_mj.recording.record import DAMAGE_THRESHOLD
from caregiver_mj.viz.report import published
from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.words import TITLES, number

_FACTS = {
    "timesteps_to_threshold": f"until damage is above {DAMAGE_THRESHOLD:g}",
    "cells_visited": "until then",
    "toys_reached": f"in {EPISODE_TIMESTEPS} timesteps",
}
_DEEDS = ("moves_blocked", "moves_blocked_stairwell", "moves_blocked_free", "interventions_done")


def headline(run: Run) -> dict[str, Any]:
    """What the page begins with: `avoided`, the share of all families' damage that the caregiver avoids, and more."""
    # Families of the same episode share their chance, so it is episodes that are drawn again, all families together.
    damage = run.episodes.groupby(["caregiver", "house", "episode"])["damage"].sum().reset_index()
    ours, theirs = (Sample(damage[damage.caregiver == name]) for name in (run.caregiver, "none"))
    left, low, high = ours.estimators.of_ratio(ours.values(["damage"]), theirs.values(["damage"])).column(0)
    alone, guarded = (run.mean(caregiver, "damage") for caregiver in ("none", run.caregiver))
    guarded_episodes = run.episodes[run.episodes.caregiver == run.caregiver]
    mishaps = {column: int(guarded_episodes[column].sum()) for column in ("strikes", "candles_dropped")}
    return {
        "avoided": f"{number(100 * (1 - left), 0)} %" if np.isfinite(left) else None,
        "interval": f"{number(100 * (1 - high))} to {number(100 * (1 - low))} %" if np.isfinite(high) else None,
        "left": f"{number(left, 2)} [{number(low, 2)}, {number(high, 2)}]" if np.isfinite(high) else None,
        "open": bool(np.isinf(high)),
        "paper": _avoided_in_paper(run),
        "damage": {"alone": alone, "guarded": guarded, "most": max(alone, guarded) or 1.0},
        "facts": [
            (f"{TITLES[column]} {when}", number(run.mean("none", column)), number(run.mean(run.caregiver, column)))
            for column, when in _FACTS.items()
        ],
        "deeds": {c: number(run.mean(run.caregiver, c)) for c in _DEEDS if c in run.episodes},
        "mishaps": mishaps if run.settings.world == "house" else None,
        "guarded_episodes": len(guarded_episodes),
    }


def _avoided_in_paper(run: Run) -> str | None:
    """The same share in the paper, if it has all these novices."""
    means = [published.means(run, "damage_normalised", family) for family in run.families]
    known = [pair for pair in means if pair is not None]
    if len(known) < len(means):
        return None
    alone, guarded = np.sum(known, axis=0)
    return f"{100 * (1 - guarded / alone):.0f} %"

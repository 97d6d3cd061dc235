"""What the numbers of the page say, in words, and the numbers as text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.studies.documents import fill
from caregiver_mj.studies.learning_child.life import KINDS
from caregiver_mj.studies.learning_child.measure import NONE, Grown, Houses

FIRST = 5  # episodes alone that are looked at by themselves


def words(grown: Grown) -> str:
    """What protection has come to, a line for each caregiver."""
    start, end = grown.childhood, grown.childhood + grown.after
    lines = []
    for name in grown.guards:
        parts = []
        for kind in KINDS:
            spared = two_level.of_ratio(
                grown.mean(name, "damage", kind, 0, start), grown.mean(NONE, "damage", kind, 0, start)
            )
            after = against(*(grown.mean(who, "damage", kind, start, start + FIRST) for who in (name, NONE)))
            life = against(*([one * end for one in grown.mean(who, "damage", kind, 0, end)] for who in (name, NONE)))
            parts.append(
                f"the {kind} child takes {interval(spared, 2)} of the damage in childhood; then, alone, "
                f"{verdict(after)} than one that always was ({interval(after, 2, '+')} an episode in the first "
                f"{FIRST}); over the whole life {verdict(life)} ({interval(life, 0, '+')})"
            )
        lines.append(fill(f"- With `{name}` {'; '.join(parts)}.", "  "))
    return "\n".join(lines)


def verdict(estimate: Estimate) -> str:
    """What a difference of damage says."""
    if estimate.low > 0:
        return "more damage"
    return "less damage" if estimate.high < 0 else "neither detectably more nor less damage"


def against(ours: Houses, theirs: Houses) -> Estimate:
    """The mean difference, over houses."""
    return two_level.of_difference(ours, theirs)


def number(houses: Sequence[np.ndarray], digits: int) -> str:
    """The mean over houses, as text."""
    return f"{np.nanmean([np.mean(one) for one in houses]):.{digits}f}"


def interval(estimate: Estimate, digits: int, sign: str = "") -> str:
    """An estimate and its interval, as text."""
    value, low, high = (f"{round(float(end), digits) + 0.0:{sign}.{digits}f}" for end in estimate)  # + 0.0: no -0.0
    return value if low == high else f"{value} ({low} to {high})"

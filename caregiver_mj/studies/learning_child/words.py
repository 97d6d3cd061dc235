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
ENOUGH = 8  # houses for the page not to warn of their number


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
            known = against(*(grown.mean(who, "known", kind, start - 1, start) for who in (name, NONE)))
            fewer = "fewer" if known.high < 0 else "more" if known.low > 0 else "not detectably fewer"
            parts.append(
                f"the {kind} child takes {interval(spared, 2)} of the damage in childhood; left alone, it shuns "
                f"{fewer} of the dangerous moves than one that always was ({interval(known, 2, '+')}), and takes "
                f"{verdict(after)} in the first {FIRST} episodes ({interval(after, 2, '+')} an episode); over the "
                f"whole life {verdict(life)} ({interval(life, 0, '+')})"
            )
        lines.append(fill(f"- With `{name}` {'; '.join(parts)}.", "  "))
    if grown.houses < ENOUGH:
        lines.append(
            fill(f"- These are {grown.houses} houses: so few that the intervals are wide, and tell little.", "  ")
        )
    return "\n".join(lines)


def verdict(estimate: Estimate[float]) -> str:
    """What a difference of damage says."""
    if estimate.low > 0:
        return "more damage"
    return "less damage" if estimate.high < 0 else "neither detectably more nor less damage"


def against(ours: Houses, theirs: Houses) -> Estimate[float]:
    """The mean difference, over houses."""
    return two_level.of_difference(ours, theirs)


def number(houses: Sequence[np.ndarray], digits: int) -> str:
    """The mean over houses, as text."""
    return f"{np.nanmean([np.mean(one) for one in houses]):.{digits}f}"


def interval(estimate: Estimate[float], digits: int, sign: str = "") -> str:
    """An estimate and its interval, as text."""
    value, low, high = (f"{round(float(end), digits) + 0.0:{sign}.{digits}f}" for end in estimate)  # + 0.0: no -0.0
    return value if low == high else f"{value} ({low} to {high})"

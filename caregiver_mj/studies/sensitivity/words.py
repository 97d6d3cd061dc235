"""The page's sentences with figures in them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.studies.documents import fill
from caregiver_mj.studies.sensitivity.conditions import LINEAR, NEAREST, NONE, PAPER, STILL, WEIGHTED, WEIGHTS
from caregiver_mj.studies.sensitivity.results import Results
from caregiver_mj.studies.sensitivity.same_rule import first_apart
from caregiver_mj.studies.sensitivity.same_rule_table import plans_apart


def listed(items: Sequence[str]) -> str:
    """Some things in a sentence."""
    return " and ".join([", ".join(items[:-1]), items[-1]] if len(items) > 1 else items)


def side(difference: Estimate[float]) -> int:
    """On which side of zero the whole interval is: 1, -1, or 0 for neither, as where nothing bounds it."""
    if not np.isfinite(difference).all():
        return 0
    return int(difference.low > 0) - int(difference.high < 0)


def verdict(differences: Sequence[Estimate[float]]) -> str:
    """At which epsilons a difference is above or below zero with its whole interval, in words."""
    if all(one.value == one.low == one.high == 0 for one in differences):
        return "the same in every episode"
    parts = []
    for what, found in (
        ("more", [e for e, one in zip(EPSILONS, differences, strict=True) if side(one) > 0]),
        ("less", [e for e, one in zip(EPSILONS, differences, strict=True) if side(one) < 0]),
    ):
        if found:
            parts.append(f"{what} at epsilon {listed([f'{epsilon:g}' for epsilon in found])}")
    if not all(map(side, differences)):
        parts.append(f"no difference seen at {'the others' if parts else 'any epsilon'}")
    return ", ".join(parts)


def weights(results: Results) -> str:
    """Where `paper` does worse or better than `nearest`, for each set of weights."""
    lines = []
    for name, one in WEIGHTED.items():
        told = (f"on {p} {verdict(results.difference(p, one, NEAREST, name))}" for p in results.places)
        lines.append(fill(f"- **{name}**: `paper` leaves, beside `nearest`, {'; '.join(told)}.", "  "))
    return "\n".join(lines)


def dear_stairs(results: Results) -> str:
    """What becomes of falls and bumps when the rule takes a fall to cost 20."""
    dearest = WEIGHTS[-1]
    told = []
    for place in results.places:
        ours, theirs = (results.collisions(place, one) for one in (WEIGHTED[dearest], NEAREST))
        falls, bumps = (ours - theirs)[:2]
        told.append(f"on {place} {falls:+.2f} falls and {bumps:+.2f} bumps at candles")
    return f"At {dearest} the rule has, beside `nearest`, {'; '.join(told)} an episode."


def readings(results: Results) -> str:
    """How much more the linear reading leaves."""
    told = []
    for place in results.places:
        ours, theirs = (np.mean([one.value for one in results.left(place, c)]) for c in (LINEAR, PAPER))
        told.append(f"{ours / theirs:.2f} times on {place}")
    return f"Averaged over the epsilons the linear reading leaves {listed(told)} what the inverse one leaves."


def thresholds(results: Results) -> str:
    """How many episodes the reading of the threshold concerns."""
    told = (
        f"{results.other_stops(place, NONE):.0%} unassisted and {results.other_stops(place, PAPER):.0%} assisted "
        f"episodes on {place}"
        for place in results.places
    )
    return f"It changes when {listed(list(told))} end."


def yields(results: Results) -> str:
    """What making room is worth."""
    told = (f"on {p} {verdict(results.difference(p, STILL, PAPER))}" for p in results.places)
    toys = (f"on {p} {verdict(results.toys_difference(p, STILL, PAPER))}" for p in results.places)
    return f"Damage of `paper-still` beside `paper`: {'; '.join(told)}. Toys: {'; '.join(toys)}."


def apart(results: Results) -> str:
    """On which plans the two rules ever differ, and on how many that shows in the damage."""
    houses, found = sum(len(place.houses) for place in results.places), plans_apart(results)
    sides = [side(results.mean_difference(one.name, PAPER, NEAREST)) for one in found]
    return (
        f"At the start or later they differ on {len(found)} of the {houses} plans. On {sides.count(1)} of them "
        f"the interval of the damage is above zero, on {sides.count(-1)} below; one in twenty would leave zero out by "
        "chance."
    )


def distances(stairwell: float, candle: float, count: int = 6) -> str:
    """The nearest distances at which the rules differ."""
    found = first_apart(stairwell, candle, 12)[:count]
    return ", ".join(f"{c} and {s}" for c, s in found)

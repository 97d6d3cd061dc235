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


def verdict(differences: Sequence[Estimate]) -> str:
    """At which epsilons a difference is above or below zero with its whole interval, in words."""
    if all(one.value == one.low == one.high == 0 for one in differences):
        return "the same in every episode"
    parts = []
    for what, found in (
        ("more", [e for e, one in zip(EPSILONS, differences, strict=True) if one.low > 0]),
        ("less", [e for e, one in zip(EPSILONS, differences, strict=True) if one.high < 0]),
    ):
        if found:
            parts.append(f"{what} at epsilon {listed([f'{epsilon:g}' for epsilon in found])}")
    rest = len(EPSILONS) - sum(one.low > 0 or one.high < 0 for one in differences)
    if rest:
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
        told.append(
            f"on {place} {_change(ours[0], theirs[0])} falls and {_change(ours[1], theirs[1])} bumps at candles"
        )
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
    """On which plans the two rules ever differ."""
    houses = sum(len(place.houses) for place in results.places)
    return f"They ever differ on {len(plans_apart(results))} of the {houses} plans:"


def distances(stairwell: float, candle: float, count: int = 6) -> str:
    """The nearest distances at which the rules differ."""
    found = first_apart(stairwell, candle, 12)[:count]
    return ", ".join(f"{c} and {s}" for c, s in found)


def _change(ours: float, theirs: float) -> str:
    return f"{ours - theirs:+.2f}"

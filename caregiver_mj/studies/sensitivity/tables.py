"""The page's tables of what was measured in the grid."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.studies.documents import table
from caregiver_mj.studies.sensitivity.conditions import LINEAR, NEAREST, NONE, PAPER, SPEEDS, STILL, WEIGHTED
from caregiver_mj.studies.sensitivity.results import Results
from caregiver_mj.viz.report.published import PUBLISHED

AT = tuple(f"at {epsilon:g}" for epsilon in EPSILONS)
READINGS = {"above": "above 15", "at": "at least 15"}


def interval(estimate: Estimate[float], sign: str = "") -> str:
    """An estimate with its interval; alone if the samples are all the same, with a dash if they bound nothing."""
    mean, low, high = (f"{round(value, 2) + 0.0:{sign}.2f}" for value in estimate)  # + 0.0: no -0.00
    if estimate.low == estimate.high:
        return mean
    return f"{mean} ({low} to {high})" if np.isfinite(estimate).all() else f"{mean} (–)"


def cells(estimates: Iterable[Estimate[float]], sign: str = "") -> list[str]:
    """Some estimates, each with its interval."""
    return [interval(estimate, sign) for estimate in estimates]


def weights_left(results: Results) -> str:
    """What is left of the damage under each set of weights."""
    rows = []
    for place in results.places:
        for weights, condition in WEIGHTED.items():
            for name, one in (("`paper`", condition), ("`nearest`", NEAREST)):
                rows.append((str(place), weights, name, *cells(results.left(place, one, weights))))
    return table(("plan", "damage", "caregiver", *AT), rows)


def weights_difference(results: Results) -> str:
    """Damage of `paper` less that of `nearest`."""
    rows = []
    for place in results.places:
        for weights, one in WEIGHTED.items():
            rows.append((str(place), weights, *cells(results.difference(place, one, NEAREST, weights), "+")))
    return table(("plan", "damage", *AT), rows)


def weights_collisions(results: Results) -> str:
    """What the damage consists of."""
    conditions = {"`nearest`": NEAREST} | {f"`paper`, {weights}": one for weights, one in WEIGHTED.items()}
    rows = []
    for place in results.places:
        for name, one in conditions.items():
            rows.append((str(place), name, *(f"{count:.2f}" for count in results.collisions(place, one))))
    return table(("plan", "caregiver", "falls down stairs", "bumps at candles", "bumps at bare tables"), rows)


def reach(results: Results) -> str:
    """Damage left by both readings of P(reach), and their difference."""
    rows = []
    for place in results.places:
        rows.append((str(place), "left, inverse", *cells(results.left(place, PAPER))))
        rows.append((str(place), "left, linear", *cells(results.left(place, LINEAR))))
        rows.append((str(place), "linear less inverse", *cells(results.difference(place, LINEAR, PAPER), "+")))
    return table(("plan", "P(reach)", *AT), rows)


def stops(results: Results) -> str:
    """Mean timestep in which an interaction ends, by both readings of the threshold."""
    rows = []
    for place in results.places:
        for one in (NONE, PAPER):
            for reading, title in READINGS.items():
                told = (f"{mean:.1f}" for mean in results.stops(place, one, reading))
                rows.append((str(place), f"`{one.caregiver}`", title, *told))
    published = PUBLISHED["timesteps_to_threshold"]
    for assisted, one in enumerate((NONE, PAPER)):
        told = (f"{published[epsilon][assisted]:.1f}" for epsilon in EPSILONS)
        rows.append(("the paper's own", f"`{one.caregiver}`", "Table II", *told))
    return table(("plan", "caregiver", "ends", *AT), rows)


def speeds(results: Results) -> str:
    """Damage left by the number of actions."""
    rows = []
    for place in results.places:
        for actions, one in SPEEDS.items():
            rows.append((str(place), str(actions), *cells(results.left(place, one))))
    return table(("plan", "actions", *AT), rows)


def yielding(results: Results) -> str:
    """Damage left with and without making room, and what that changes."""
    rows = []
    for place in results.places:
        for one in (PAPER, STILL):
            rows.append((str(place), f"`{one.caregiver}`: left", *cells(results.left(place, one))))
        damage, toys = results.difference(place, STILL, PAPER), results.toys_difference(place, STILL, PAPER)
        rows.append((str(place), "damage, still less yielding", *cells(damage, "+")))
        rows.append((str(place), "toys, still less yielding", *cells(toys, "+")))
    return table(("plan", "", *AT), rows)

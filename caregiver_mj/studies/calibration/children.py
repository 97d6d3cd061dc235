"""The children that are predicted: novices as the belief takes everybody for one, and all others that there are."""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.child_model import EPSILONS
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.children.family import CHILDREN, NOVICE
from caregiver_mj.plans.hazards import NOTHING

MODELLED = tuple(f"{epsilon:g}" for epsilon in reversed(EPSILONS))  # epsilons that the belief reckons with
BETWEEN = ("0.875", "0.625", "0.375", "0.15")
TOGETHER = "novices"  # those of `MODELLED`, each as often
_SHARES = (0.75, 0.25)  # epsilons of other children
_WITHOUT = {"expert": "expert:0", "adversary": "adversary:0"}  # those that epsilon does nothing to
COMPANY = ("adversary", "seeker", "avoider")  # what they do depends on where a robot is


def families() -> tuple[str, ...]:
    """All children, as `Family.parse` takes them: novices, the most random first, then every other behaviour."""
    novices = sorted((*MODELLED, *BETWEEN), key=float, reverse=True)
    others: list[str] = []
    for name in CHILDREN:
        if name != NOVICE:
            others += [_WITHOUT[name]] if name in _WITHOUT else [f"{name}:{share:g}" for share in _SHARES]
    return (*novices, *others)


def has_company(family: str) -> bool:
    """Whether a child is watched beside a robot that stands still, and not alone."""
    return family.rpartition(":")[0] in COMPANY


def title(family: str) -> str:
    """What a child is called."""
    if family == TOGETHER:
        return "the five novices together"
    name, _, epsilon = family.rpartition(":")
    if name in _WITHOUT:
        return name
    return f"{name or NOVICE} {float(epsilon):g}"


class Bystander(Caregiver):
    """Stands where it stood at first, for children that look for it, or go round it."""

    yields = False

    def choose(self, percept: Percept) -> np.ndarray:
        return np.full(len(percept.child_cell), NOTHING)

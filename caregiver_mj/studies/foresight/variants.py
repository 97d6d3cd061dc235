"""Foresight with something changed."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.caregivers.foresight.reckoning import SOUND, Reckoning
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.plans.floor_plan import FloorPlan

PRICES = (0.0, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
BESIDE = ("paper", "nearest", "guard", "childproof", "knows-goal", "clairvoyant")  # on the frontier
FLOOR = "floor"


class UniformBelief(ForesightCaregiver):
    """Sees where the child is, but learns nothing from its moves."""

    def watch(self, percept: Percept) -> None:
        """Takes nothing in."""


def _foresight(**options: Any) -> Callable[[FloorPlan], Caregiver]:
    return functools.partial(ForesightCaregiver, **options)


def _reckoning(**options: Any) -> Callable[[FloorPlan], Caregiver]:
    return _foresight(reckoning=Reckoning(**options))


# By what is changed, then by how; the first of each is the caregiver as it is.
ABLATIONS: dict[str, dict[str, Callable[[FloorPlan], Caregiver] | str]] = {
    "belief": {
        "Bayes filter": _foresight(),
        "told bin and epsilon": "knows-goal",
        "uniform": UniformBelief,
        "epsilon never changes": _foresight(change=0.0),
        "epsilon changes often (.02)": _foresight(change=0.02),
    },
    "horizon (discount a timestep)": {
        f"{SOUND.discount:g}": _foresight(),
        **{f"{discount:g}": _reckoning(discount=discount) for discount in (0.9, 0.95, 0.97, 0.993)},
    },
    "later relocations": {
        "8 rounds": _foresight(),
        **{f"{rounds} round{'s' * (rounds != 1)}": _reckoning(rounds=rounds) for rounds in (0, 1, 2, 4)},
    },
    "hysteresis (share of the damage of doing nothing)": {
        ".004": _foresight(),
        **{f"{share:g}".lstrip("0") or "0": _foresight(hysteresis=share) for share in (0.0, 0.001, 0.016, 0.1)},
    },
    "the child in the way": {"an obstacle": _foresight(), "not there": _reckoning(obstacle=False)},
    "table": {"chosen": _foresight(), "the farthest one": _foresight(chooses_table=False)},
    "price of a denied move (damage)": {
        f"{SOUND.price:g}": _foresight(),
        **{f"{value:g}": _reckoning(price=value) for value in PRICES if value != SOUND.price},
    },
}


def variants() -> dict[str, Callable[[FloorPlan], Caregiver] | str]:
    """All of them by name, each once, and the other caregivers of the frontier; a text is a caregiver's name."""
    found: dict[str, Callable[[FloorPlan], Caregiver] | str] = {"none": "none", FLOOR: FLOOR, "foresight": "foresight"}
    found |= {name: name for name in BESIDE}
    for what, ways in ABLATIONS.items():
        for how, make in list(ways.items())[1:]:
            if not isinstance(make, str):
                found[f"{what}: {how}"] = make
    return found


def key_of(what: str, how: str) -> str:
    """Under what name `variants` has a way."""
    make = ABLATIONS[what][how]
    if how == next(iter(ABLATIONS[what])):
        return "foresight"
    return make if isinstance(make, str) else f"{what}: {how}"


def made(name: str, plan: FloorPlan) -> Caregiver | None:
    """Makes the caregiver of a variant for a house; None for `none`."""
    make = variants()[name]
    return make_caregiver(make, plan) if isinstance(make, str) else make(plan)

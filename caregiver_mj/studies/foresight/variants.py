"""Foresight with something changed."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.foresight import HYSTERESIS, ForesightCaregiver
from caregiver_mj.caregivers.foresight.value_table import OBJECTIVE, Objective
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.plans.floor_plan import FloorPlan

PRICE = "price of a denied move towards a toy (damage)"
PRICES = (0.0, 0.3, 0.75, 1.5, 3.0, 6.0)
BESIDE = ("paper", "nearest", "guard", "childproof", "knows-goal", "clairvoyant")  # on the frontier
FLOOR = "floor"


class UniformBelief(ForesightCaregiver):
    """Sees where the child is, but learns nothing from its moves."""

    def watch(self, percept: Percept) -> None:
        """Takes nothing in."""


def _foresight(**options: Any) -> Callable[[FloorPlan], Caregiver]:
    return functools.partial(ForesightCaregiver, **options)


def _objective(**options: Any) -> Callable[[FloorPlan], Caregiver]:
    return _foresight(objective=Objective(**options))


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
        f"{OBJECTIVE.discount:g}": _foresight(),
        **{f"{discount:g}": _objective(discount=discount) for discount in (0.9, 0.95, 0.97, 0.993)},
    },
    "sweeps of value iteration": {
        f"{OBJECTIVE.sweeps}": _foresight(),
        **{f"{sweeps}": _objective(sweeps=sweeps) for sweeps in (10, 25, 50)},
    },
    "hysteresis (share of the damage to come)": {
        f"{HYSTERESIS:g}": _foresight(),
        **{f"{share:g}": _foresight(hysteresis=share) for share in (0.0, 0.001, 0.02, 0.1) if share != HYSTERESIS},
    },
    PRICE: {
        f"{OBJECTIVE.price:g}": _foresight(),
        **{f"{value:g}": _objective(price=value) for value in PRICES if value != OBJECTIVE.price},
    },
    "price of a denied random move (damage)": {
        f"{OBJECTIVE.random_price:g}": _foresight(),
        **{
            f"{value:g}": _objective(random_price=value)
            for value in (0.0, 0.1, 0.2, 0.6, 1.5)
            if value != OBJECTIVE.random_price
        },
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

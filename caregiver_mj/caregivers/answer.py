"""What a caregiver answers with, looked at before a world carries it out: it may be anybody's."""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.errors import CaregiverError
from caregiver_mj.interventions.intervention import RELOCATE, Interventions
from caregiver_mj.interventions.registry import VERBS
from caregiver_mj.plans.hazards import NOTHING, HazardKind, Hazards


def answer(caregiver: Caregiver, percept: Percept) -> Interventions:
    """What a caregiver decides.

    Raises:
        CaregiverError: It is nothing that could be done in B worlds of its house.
    """
    given, batch, who = caregiver.decide(percept), len(percept.child_cell), f"{type(caregiver).__name__}.decide"
    if not isinstance(given, Interventions) or np.shape(given.verb) != (batch,):
        raise CaregiverError(f"{who} must answer with Interventions for {batch} worlds, not {given!r}")
    _check(f"{who}: hazard", given.hazard, batch, len(caregiver.plan.hazards))
    _check_kinds(who, caregiver.plan.hazards, given)
    moved = np.where(
        np.asarray(given.verb) == RELOCATE, given.destination, NOTHING
    )  # other verbs mean other things by it
    _check(f"{who}: destination", moved, batch, len(caregiver.plan.tables))
    return given


def _check_kinds(who: str, hazards: Hazards, given: Interventions) -> None:
    """Raises CaregiverError unless stairwells are blocked, and candles relocated."""
    for name, verb in VERBS.items():
        if verb.about is None:
            continue
        numbers = np.asarray(given.hazard)[np.asarray(given.verb) == name]
        is_right = hazards.is_stairwell(numbers) if verb.about == HazardKind.STAIRWELL else hazards.is_candle(numbers)
        if not is_right.all():
            right = [number for number, hazard in enumerate(hazards) if hazard.kind == verb.about]
            wrong = int(numbers[~is_right][0])
            raise CaregiverError(
                f"{who}: '{name}' is for a {verb.about}, of which there are {right or 'none'}, not for hazard {wrong}"
            )


def _check(what: str, numbers: np.ndarray, batch: int, count: int) -> None:
    """Raises CaregiverError unless these are numbers (B,) of so many things, or NOTHING."""
    numbers = np.asarray(numbers)
    if numbers.shape != (batch,) or not np.issubdtype(numbers.dtype, np.integer):
        raise CaregiverError(f"{what} must be {batch} integers, not {numbers!r}")
    if ((numbers < NOTHING) | (numbers >= count)).any():
        raise CaregiverError(f"{what} must be -1 to {count - 1}, not {numbers}")

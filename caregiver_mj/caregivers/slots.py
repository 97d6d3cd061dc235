"""Places for hazards in arrays of one size, so that one policy can act in houses with different hazards."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral

import numpy as np
from numpy.typing import ArrayLike

from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

_MOST = 1_000  # of a kind: each takes memory in every observation


class Slots:
    """So many places for stairwells, then so many for candles; those that a house has no hazard for stay empty.

    Attributes:
        of_hazard: Slot of each hazard, (hazards,).
        hazard: Hazard in each slot, or NOTHING, (slots,).
    """

    def __init__(self, plan: FloorPlan, slots: tuple[int, int] | None = None):
        """Lays the places out.

        Args:
            plan: The house.
            slots: How many places for stairwells and for candles; as many as the house has if None.

        Raises:
            CaregiverError: They are no two numbers, or more than 1,000 of a kind, or the house has more.
        """
        stairwells, candles = plan.hazards.stairwells, plan.hazards.candles
        places = (stairwells, candles) if slots is None else slots
        if not (isinstance(places, Sequence) and len(places) == 2 and all(isinstance(n, Integral) for n in places)):
            raise CaregiverError(f"slots must be numbers of stairwells and candles, such as (4, 6), not {slots!r}")
        if slots is not None and max(slots) > _MOST:
            raise CaregiverError(f"slots are {_MOST:,} of a kind at most, not {slots}")
        if places[0] < stairwells or places[1] < candles:
            raise CaregiverError(
                f"slots {slots} are too few for house '{plan.name}', which needs {(stairwells, candles)}"
            )
        self.of_hazard = np.concatenate([np.arange(stairwells), places[0] + np.arange(candles)])
        self.hazard = np.full(sum(places), NOTHING)
        self.hazard[self.of_hazard] = np.arange(len(plan.hazards))

    def __len__(self) -> int:
        return len(self.hazard)

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Values of hazards (..., hazards) as values of slots (..., slots), 0 in those that are empty."""
        spread = np.zeros((*values.shape[:-1], len(self)), np.float32)
        spread[..., self.of_hazard] = values
        return spread

    def targets(self, actions: ArrayLike, batch: int) -> np.ndarray:
        """The hazards that B actions (B,) are about: NOTHING for 0 and for an empty slot, else what is in the slot.

        Raises:
            CaregiverError: They are of another shape, or out of range.
        """
        actions = np.asarray(actions)
        if actions.shape != (batch,):
            raise CaregiverError(f"actions must be {batch} integers, one for each episode, not {actions.tolist()!r}")
        if not np.issubdtype(actions.dtype, np.integer) or ((actions < 0) | (actions > len(self))).any():
            raise CaregiverError(f"an action is an integer from 0 to {len(self)}, not {actions.tolist()!r}")
        return np.concatenate([[NOTHING], self.hazard])[actions]

    def actions(self, hazards: np.ndarray) -> np.ndarray:
        """The reverse, (B,)."""
        return np.concatenate([self.of_hazard + 1, [0]])[hazards]  # the last one is for NOTHING

"""Where the grid's episodes are: in one house, or over a set of them."""

from __future__ import annotations

import dataclasses

from caregiver_mj.errors import FloorPlanError
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import house_set


@dataclasses.dataclass(frozen=True)
class Place:
    """A house, or several.

    Attributes:
        name: Its name.
        houses: The names of its houses.
        episodes: Episodes in each of them.
    """

    name: str
    houses: tuple[str, ...]
    episodes: int

    @classmethod
    def of(cls, name: str, episodes: int, episodes_in_sets: int) -> Place:
        """The place of a name.

        Args:
            name: Of a floor plan, or of a set of houses such as `train-20`.
            episodes: How many in a single house.
            episodes_in_sets: How many in each house of a set.

        Raises:
            CaregiverError: There is no such place.
        """
        try:
            houses = tuple(plan.name for plan in house_set(name))
        except FloorPlanError:
            FloorPlan.load(name)
            return cls(name, (name,), episodes)
        return cls(name, houses, episodes_in_sets)

    def __str__(self) -> str:
        """What it is called in tables."""
        return f"`{self.name}`"

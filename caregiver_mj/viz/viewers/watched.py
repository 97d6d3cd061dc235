"""Which episode is watched."""

from __future__ import annotations

import dataclasses
import shlex

from caregiver_mj.children.family import Family
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.robot.embodiment import DEFAULT
from caregiver_mj.viz.episode import Episode


@dataclasses.dataclass(frozen=True)
class Watched:
    """An episode of a run, the same as `evaluate` has with this seed.

    Attributes:
        house: Name or file of the floor plan.
        family: The children.
        caregiver: Name of the caregiver, or of a policy; without a robot for "none".
        seed: Seed of the run.
        number: Number of the episode in the run.
        damage: What collisions cost.
        embodiment: Name of the robot.
    """

    house: str = "paper"
    family: Family = dataclasses.field(default_factory=Family)
    caregiver: str = "foresight"
    seed: int = 0
    number: int = 0
    damage: DamageWeights = DamageWeights()
    embodiment: str = DEFAULT

    def plan(self) -> FloorPlan:
        """Reads the floor plan.

        Raises:
            CaregiverError: There is none, or it is not valid.
        """
        return FloorPlan.load(self.house, damage=self.damage)

    def begin(self) -> Episode:
        """Begins the episode.

        Raises:
            CaregiverError: There can be no such episode.
        """
        episode = Episode.load(
            house=self.plan(),
            children=self.family,
            seed=self.seed,
            number=self.number,
            caregiver=self.caregiver,
            embodiment=self.embodiment,
        )
        episode.foresees = True  # where the caregiver foresees anything: not every one does
        return episode

    def options(self) -> str:
        """The options that say the same on the command line."""
        said = {
            "house": self.house,
            "epsilon": str(self.family),
            "caregiver": self.caregiver,
            "seed": self.seed,
            "episode": self.number,
            "damage": self.damage,
            "embodiment": self.embodiment,
        }
        ever = {"damage": DamageWeights(), "embodiment": DEFAULT}
        told = ((name, value) for name, value in said.items() if ever.get(name) != value)
        return shlex.join(str(word) for name, value in told for word in (f"--{name}", value))

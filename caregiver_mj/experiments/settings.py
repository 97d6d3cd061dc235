"""What to evaluate: everything that the results depend on, and the work in pieces."""

from __future__ import annotations

import dataclasses
from typing import Any

from caregiver_mj.caregivers.registry import CAREGIVERS
from caregiver_mj.children.family import Family, Who
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.versions import versions
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.robot.embodiment import DEFAULT

WORLDS = ("house", "grid")
EPSILONS = (1.0, 0.75, 0.5, 0.25, 0.05)  # the paper's five novices
GRID_BLOCK = 1000  # episodes at once: enough to be fast, and a few seconds' work to lose


@dataclasses.dataclass(frozen=True)
class Settings:
    """What to evaluate.

    Attributes:
        plan: The house, with what a collision costs.
        world: "house", the physical one, or "grid".
        caregivers: Names of caregivers.
        families: The children; each may be given as `Family.of` takes it, such as by an epsilon.
        episodes: Episodes for each caregiver and family.
        seed: Seed of the episodes, and of what is random in the caregivers.
        embodiment: Name of the robot in the house.
    """

    plan: FloorPlan
    world: str = "house"
    caregivers: tuple[str, ...] = ("none", "paper")
    families: tuple[Who, ...] = EPSILONS
    episodes: int = 20
    seed: int = 0
    embodiment: str = DEFAULT

    def __post_init__(self) -> None:
        object.__setattr__(self, "families", tuple(map(Family.of, self.families)))

    @classmethod
    def of_record(cls, record: dict[str, Any]) -> Settings:
        """The settings of a run, from what `record` has made of them."""
        damage = DamageWeights.parse(record["damage"])
        return cls(
            plan=FloorPlan.parse("\n".join(record["plan"]), record["house"], record["cell_size"], damage),
            world=record["world"],
            caregivers=tuple(record["caregivers"]),
            families=tuple(map(Family.parse, record["families"])),
            episodes=record["episodes"],
            seed=record["seed"],
            embodiment=record["embodiment"],
        )

    def check(self) -> None:
        """Raises CaregiverError unless this can be run."""
        if self.world not in WORLDS:
            raise CaregiverError(f"no world '{self.world}': there are {', '.join(WORLDS)}")
        if self.world == "house":
            from caregiver_mj.robot.embodiments import find_embodiment  # here, for the grid does without MuJoCo

            find_embodiment(self.embodiment)
        for name in self.caregivers:
            if name not in CAREGIVERS:
                raise CaregiverError(f"no caregiver '{name}': there are {', '.join(CAREGIVERS)}")
            caregiver = CAREGIVERS.get(name)  # one that comes from another package may fail to load
            if self.world == "house" and caregiver is not None and not caregiver.in_house:
                raise CaregiverError(f"caregiver '{name}' acts in the grid only: the robot cannot do all that it wants")
        for family in self.families:
            family.check()
        names = tuple(map(str, self.families))
        for what, values in (("caregivers", self.caregivers), ("epsilons", names)):
            if not values or len(set(values)) < len(values):
                raise CaregiverError(f"{what} must be one or more, each of them once, not {values}")
        if self.episodes < 1:
            raise CaregiverError(f"episodes must be at least 1, not {self.episodes}")
        if self.seed < 0:
            raise CaregiverError(f"the seed must not be negative: {self.seed}")

    def record(self) -> dict[str, Any]:
        """The settings and versions as JSON, to tell whether two runs can be one."""
        return {
            "world": self.world,
            "house": self.plan.name,
            "plan": list(self.plan.rows),
            "cell_size": self.plan.cell_size,
            "damage": str(self.plan.damage),
            "caregivers": list(self.caregivers),
            "families": list(map(str, self.families)),
            "epsilons": [family.epsilon for family in self.families],
            "episodes": self.episodes,
            "seed": self.seed,
            "embodiment": self.embodiment,
            "versions": versions(),
        }

    def blocks(self, grid_block: int = GRID_BLOCK) -> list[Block]:
        """The work in pieces, each of which is done as a whole: so many episodes in the grid, one in the house."""
        size = grid_block if self.world == "grid" else 1
        return [
            Block(caregiver, family, first, min(first + size, self.episodes))
            for family in self.families
            for caregiver in self.caregivers
            for first in range(0, self.episodes, size)
        ]


@dataclasses.dataclass(frozen=True)
class Block:
    """Episodes [first, end) of one caregiver and one family."""

    caregiver: str
    family: Family
    first: int
    end: int

    def __len__(self) -> int:
        return self.end - self.first

    def __str__(self) -> str:
        """Says which, in messages and file names."""
        episodes = f"{self.first:06d}" + (f"-{self.end - 1:06d}" if len(self) > 1 else "")
        return f"{self.caregiver}_epsilon_{self.family}_episode_{episodes}"

"""What a data set says of itself."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class About:
    """What a data set says of itself.

    Attributes:
        task: What was to be done, in a sentence.
        robot: Name of the robot; nothing where there is none.
        policy: Who acted.
        rate: Steps a second of simulated time.
        actions: Names of the values of an action.
        hazards: What the numbers of the hazards mean.
        version: Of this package.
    """

    task: str
    robot: str
    policy: str
    rate: float
    actions: tuple[str, ...]
    hazards: tuple[str, ...]
    version: str

    @property
    def description(self) -> str:
        """All of that in a few sentences."""
        hazards = ", ".join(f"{number} {name}" for number, name in enumerate(self.hazards))
        robot = f" Robot {self.robot}." if self.robot else ""
        return (
            f"{self.task} Recorded by caregiver_mj {self.version} from {self.policy}, {self.rate:g} steps a second."
            f"{robot} Cost is damage to the children and 1 for every strike; an intervention is the hazard protected "
            f"from, -1 for none: {hazards}."
        )

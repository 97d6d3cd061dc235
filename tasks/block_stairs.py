"""Block stairs: stand in the stairwell that is asked for, past the children."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.rendering import rewards
from caregiver_mj.interventions.verb import BLOCK, Intervention
from caregiver_mj.plans.hazards import STAIRWELL, Where
from caregiver_mj.tasks.base import OBSERVED, CareTask, Observed

_FAR = 3.0  # m; distance from the landing at which the reward is 0.1


class BlockStairs(CareTask):
    """Stand in a stairwell that is drawn at the start of an episode.

    Attributes:
        goal_stairwell: Index of the stairwell.
    """

    needs = STAIRWELL
    needs_robot = True
    time_limit = 60.0  # s
    observed: ClassVar[Mapping[str, Observed]] = {
        **OBSERVED,
        "goal_stairwell": Observed("(stairwells,)", "", "the stairwell that is asked for, one-hot", "share"),
        "base_to_goal": Observed("(2,)", "m", "the way that is left for the base", "way"),
    }

    goal_stairwell = 0
    _landing = np.zeros(2)

    def _check_house(self) -> None:
        width = 2 * self.embodiment.footprint
        if self.plan.cell_size < width:
            raise CaregiverError(
                f"block_stairs must have cells of at least {width:g} m, as wide as the robot, got "
                f"{self.plan.cell_size:g} m in floor plan '{self.plan.name}'"
            )

    def initialize_episode(self, physics: Physics) -> None:
        super().initialize_episode(physics)
        self.goal_stairwell = int(self.random.randint(len(self.plan.landings)))
        self._landing = self.plan.position(self.plan.landings[self.goal_stairwell])

    def get_observation(self, physics: Physics) -> dict[str, np.ndarray]:
        """Return the common observation, and the goal."""
        observation = super().get_observation(physics)
        observation["goal_stairwell"] = np.eye(len(self.plan.landings))[self.goal_stairwell]
        observation["base_to_goal"] = self._landing - observation["base_position"][:2]
        return observation

    def orders(self, observation: Mapping[str, np.ndarray]) -> Intervention:
        return Intervention(BLOCK, self.plan.hazards.number(Where.OPENING, int(observation["goal_stairwell"].argmax())))

    def get_reward(self, physics: Physics) -> float:
        """Return 1 while the whole base is in the landing's cell; it decreases with the distance."""
        inside = self.plan.cell_size / 2 - self.embodiment.footprint
        distance = float(np.abs(self._landing - physics.base_position()[:2]).max())
        return float(rewards.tolerance(distance, bounds=(0, inside), margin=_FAR))

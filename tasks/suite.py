"""The tasks, by what the robot is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.rendering import rewards
from caregiver_mj.interventions.verb import BLOCK, RELOCATE, Intervention
from caregiver_mj.plans import layout
from caregiver_mj.plans.hazards import CANDLE, STAIRWELL, Where
from caregiver_mj.tasks.base import OBSERVED, CareTask, Observed

_NEAR, _FAR = 0.10, 3.0  # m; distances from a goal at which the reward for nearness is 1 (of a candle), and 0.1


class Supervise(CareTask):
    """Keep the children from harm for a whole episode, by any means that the robot has."""

    def get_reward(self, physics: Physics) -> float:
        """Return 1 minus the children's damage in the present novice timestep, as a share of the worst collision."""
        harm = self.children.harm
        return 1.0 - harm / self.plan.damage.worst if harm else 1.0


class RelocateCandle(CareTask):
    """Take the candle that is asked for to the table that is asked for, past the children.

    Both are drawn at the start of an episode; the table is bare.

    Attributes:
        goal_candle: Index of the candle.
        goal_table: Index of the table.
    """

    needs = CANDLE
    needs_robot = True
    time_limit = 60.0  # s
    observed: ClassVar[Mapping[str, Observed]] = {
        **OBSERVED,
        "goal_candle": Observed("(candles,)", "", "the candle that is asked for, one-hot", "share"),
        "goal_table": Observed("(tables,)", "", "the table that it shall go to, one-hot", "share"),
        "candle_to_goal": Observed("(3,)", "m", "the way that is left for the candle", "way"),
    }

    goal_candle = goal_table = 0
    _goal = np.zeros(3)

    def initialize_episode(self, physics: Physics) -> None:
        super().initialize_episode(physics)
        bare = sorted(set(range(len(self.plan.tables))) - set(self.candles.starting_tables))
        self.goal_candle = int(self.random.randint(len(self.plan.candle_tables)))
        self.goal_table = int(self.random.choice(bare))
        self._goal = np.array([*self.table_positions[self.goal_table], self.table_heights[self.goal_table]])

    def get_observation(self, physics: Physics) -> dict[str, np.ndarray]:
        """Return the common observation, and the goal."""
        observation = super().get_observation(physics)
        observation["goal_candle"] = np.eye(len(self.plan.candle_tables))[self.goal_candle]
        observation["goal_table"] = np.eye(len(self.plan.tables))[self.goal_table]
        observation["candle_to_goal"] = self._goal - observation["candle_position"][self.goal_candle]
        return observation

    def orders(self, observation: Mapping[str, np.ndarray]) -> Intervention:
        candle, table = (int(observation[f"goal_{what}"].argmax()) for what in ("candle", "table"))
        return Intervention(RELOCATE, self.plan.hazards.number(Where.ON_TABLE, candle), table)

    def get_reward(self, physics: Physics) -> float:
        """Return 0.5 for nearness of the upright candle to the table, and 0.5 if it stands there, released."""
        offset = self._goal - physics.candle_poses()[self.goal_candle, :3]
        upright = max(0.0, float(physics.candle_upright()[self.goal_candle]))
        near = rewards.tolerance(float(np.linalg.norm(offset)), bounds=(0, _NEAR), margin=_FAR)
        return 0.5 * float(near) * upright + 0.5 * self.is_placed(physics)

    def is_placed(self, physics: Physics) -> bool:
        """Return whether the candle stands on the table, released."""
        offset = self._goal - physics.candle_poses()[self.goal_candle, :3]
        on_table = np.abs(offset[:2]).max() < layout.TABLE_HALF_SIZE and abs(offset[2]) < 0.01
        return bool(on_table and self.is_standing(physics, self.goal_candle) and not physics.is_gripping())


class BlockStairs(CareTask):
    """Stand in the stairwell that is asked for, past the children.

    It is drawn at the start of an episode.

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

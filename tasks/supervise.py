"""Supervise: keep the children from harm for a whole episode, by whatever the robot can do about the house."""

from __future__ import annotations

from caregiver_mj.house.physics import Physics
from caregiver_mj.tasks import base


class Supervise(base.CareTask):
    """The whole job: 200 novice timesteps, reward 1 for every control timestep without harm."""

    def get_reward(self, physics: Physics) -> float:
        """Return 1 minus the children's damage in the present novice timestep, as a share of the worst collision."""
        harm = self.children.harm
        return 1.0 - harm / self.plan.damage.worst if harm else 1.0

"""Who may act in the house, by name: the caregivers, and policies of one's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from caregiver_mj.caregivers.registry import find_caregiver, is_caregiver
from caregiver_mj.policy.own import OwnPolicy
from caregiver_mj.policy.policy import CaregiverPolicy

if TYPE_CHECKING:  # dm_control must not be imported before caregiver_mj.house.rendering
    from dm_control.rl import control


def make_policy(env: control.Environment, name: str, seed: int = 0) -> CaregiverPolicy | OwnPolicy:
    """Makes the policy of a name for an environment.

    Args:
        env: An environment of this package, with the robot in it.
        name: As of `find_caregiver`, but not "none".
        seed: Seed of a caregiver; what it draws in an episode depends on the episode's seed as well.

    Raises:
        CaregiverError: There is none of that name, it does not act, or there is no robot in the environment.
    """
    found = find_caregiver(name)
    if found is None or is_caregiver(found):
        return CaregiverPolicy(env, name, seed)
    return OwnPolicy(name, found, env)

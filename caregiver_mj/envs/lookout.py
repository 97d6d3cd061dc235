"""What a lookout sees and is told, as Gymnasium's spaces."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from caregiver_mj.caregivers.target_observation import Lookout
from caregiver_mj.errors import check_kind


def observation_space(lookout: Lookout) -> spaces.Space[Any]:
    """The space of the observations of one world: a dictionary, or a plain box where they are flat.

    Raises:
        CaregiverError: It is not said by a bool whether they are.
    """
    check_kind("flat", lookout.flat, bool)
    keys = spaces.Dict({key: spaces.Box(0, 1, shape, np.float32) for key, shape in lookout.shapes.items()})
    return spaces.flatten_space(keys) if lookout.flat else keys


def action_space(lookout: Lookout) -> spaces.Discrete:
    """The space of what it is told."""
    return spaces.Discrete(lookout.actions)

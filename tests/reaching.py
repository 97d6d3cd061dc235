"""Ways of the arm to what lies about."""

import numpy as np

from caregiver_mj.robot.kinematics import Arm
from caregiver_mj.robot.reach import ReachPath, retrieval_paths


def first_way(arm: Arm, point: np.ndarray, rotation: np.ndarray, lift: float = 0.0) -> ReachPath | None:
    """The first that is found, by any of the guesses; None if there is none."""
    return next(filter(None, retrieval_paths(arm, point, rotation, lift)), None)

"""A child that does what a test says."""

import numpy as np

from caregiver_mj.children.behaviour import ChildPercept
from caregiver_mj.children.novice import Novice
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

NORTH, EAST, SOUTH, WEST, STAY = 0, 1, 2, 3, NOTHING


class Scripted(Novice):
    """Makes the same move over and over, which a test may change: north, say, or STAY. With None it is the novice."""

    def __init__(self, plan: FloorPlan, move: int | None = STAY, epsilon: float = 0.0):
        super().__init__(plan, epsilon)
        self.move = move
        self.seen: list[ChildPercept] = []  # all that it was shown

    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        self.seen.append(sight)
        return super().act(sight, draws) if self.move is None else np.full(len(sight.cell), self.move)

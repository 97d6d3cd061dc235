"""What the grid shows to caregivers and children of one's own: they can look at it, and not rewrite the world."""

import numpy as np
import pytest

from caregiver_mj.caregivers import Caregiver
from caregiver_mj.caregivers.caregiver import PrivilegedCaregiver
from caregiver_mj.children.novice import Novice
from caregiver_mj.grid.world import run_episodes
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

TINY = FloorPlan.parse("######\n#B.S.#\n#....#\n#C..T#\n######", "tiny")
SEEN = ("child_cell", "previous_cell", "previous_action", "caregiver_cell", "candle_table", "holding", "time_left")


class Writing(Caregiver, PrivilegedCaregiver):
    def __init__(self, plan, part):
        super().__init__(plan)
        self.part = part

    def hear(self, truth):
        if self.part == "goal":
            truth.goal[...] = 0

    def choose(self, percept):
        if self.part != "goal":
            getattr(percept, self.part)[...] = 0
        return np.full(len(percept.child_cell), NOTHING)


@pytest.mark.parametrize("part", [*SEEN, "under_way", "goal"])
def test_a_caregiver_cannot_write_into_the_world(part):
    with pytest.raises(ValueError, match="read-only"):
        run_episodes(TINY, 0.5, Writing(TINY, part), [0])


class Scribbling(Novice):
    part = ""

    def reconsider(self, goal, draw):
        if self.part == "wish":
            goal[...] = 0
        return goal

    def act(self, sight, draws):
        if self.part == "draws":
            draws[...] = 0
        elif self.part not in ("", "wish"):
            getattr(sight, self.part)[...] = 0
        return super().act(sight, draws)


@pytest.mark.parametrize("part", ["cell", "goal", "caregiver_cell", "bumped", "draws", "wish"])
def test_a_child_cannot_write_into_the_world(part):
    child = Scribbling(TINY, 0.5)
    run_episodes(TINY, child, None, [0])
    child.part = part
    with pytest.raises(ValueError, match="read-only"):
        run_episodes(TINY, child, None, [0])

"""What children of other packages answer is looked at, in either world."""

import re

import numpy as np
import pytest

import caregiver_mj
from caregiver_mj.children.behaviour import Behaviour
from caregiver_mj.errors import CaregiverError
from caregiver_mj.grid.world import run_episodes
from caregiver_mj.plans.floor_plan import FloorPlan

TINY = FloorPlan.parse("######\n#B.S.#\n#....#\n#C..T#\n######", "tiny")


class K9(Behaviour):
    """Answers what it is told to, given how many there are."""

    def __init__(self, answer):
        super().__init__(TINY, 0.5)
        self.answer = answer

    def act(self, sight, draws):
        return self.answer(len(sight.cell))


class Heir(K9):
    """Has no `act` of its own."""


def in_the_grid(child):
    run_episodes(TINY, child, None, [0])


def in_the_house(child):
    env = caregiver_mj.load("supervise", TINY, child, 0, {"robot": False}, visuals=False)
    env.reset()
    env.step(np.zeros(env.action_spec().shape))


@pytest.mark.parametrize("call", [in_the_grid, in_the_house])
@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda batch: np.full(batch, 99), "[99]"),
        (lambda batch: np.full(batch, -2), "[-2]"),
        (np.ones, "[1.0]"),
        (lambda batch: np.ones((batch, 2), int), "[[1, 1]]"),
        (lambda batch: None, "None"),
    ],
)
def test_moves_that_there_are_not(call, answer, words):
    message = f"Heir.act must answer with 1 integers, -1 to 3, got {words}"
    with pytest.raises(CaregiverError, match=f"^{re.escape(message)}$"):
        call(Heir(answer))

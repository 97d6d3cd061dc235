"""What children of other packages answer is looked at, in either world."""

import re

import numpy as np
import pytest

from caregiver_mj import CaregiverError, FloorPlan, load
from caregiver_mj.children.behaviour import Behaviour
from caregiver_mj.grid.world import run_episodes

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
    env = load("supervise", TINY, child, 0, {"robot": False}, visuals=False)
    env.reset()
    env.step(np.zeros(env.action_spec().shape))


@pytest.mark.parametrize("call", [in_the_grid, in_the_house])
@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda batch: np.full(batch, 99), "99 among them"),
        (lambda batch: np.full(batch, -2), "-2 among them"),
        (np.ones, "[1.0]"),
        (lambda batch: np.ones((batch, 2), int), "[[1, 1]]"),
        (lambda batch: None, "None"),
    ],
)
def test_moves_that_there_are_not(call, answer, words):
    message = f"Heir.act must answer with 1 integers, -1 to 3, got {words}"
    with pytest.raises(CaregiverError, match=f"^{re.escape(message)}$"):
        call(Heir(answer))


class Undecided(K9):
    """Moves as it may, and answers all else as it is told to."""

    def __init__(self, method, answer):
        super().__init__(lambda batch: np.zeros(batch, int))
        self.method, self.answer_of = method, answer

    def _asked(self, method, batch, usual):
        return self.answer_of(batch) if method == self.method else usual

    def epsilons(self, batch):
        return self._asked("epsilons", batch, super().epsilons(batch))

    def reconsider(self, goal, draw):
        return self._asked("reconsider", len(goal), super().reconsider(goal, draw))

    def next_bin(self, draw):
        return self._asked("next_bin", len(draw), super().next_bin(draw))


@pytest.mark.parametrize("call", [in_the_grid, in_the_house])
@pytest.mark.parametrize("method", ["reconsider", "next_bin"])
@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda batch: np.full(batch, 1), "1 among them"),  # there is one bin
        (lambda batch: np.full(batch, -1), "-1 among them"),
        (lambda batch: np.full(batch, np.nan), "[nan]"),
        (lambda batch: 0, "0"),
    ],
)
def test_bins_that_there_are_not(call, method, answer, words):
    call(Undecided(None, answer))
    message = f"Undecided.{method} must answer with 1 integers, 0 to 0, got {words}"
    with pytest.raises(CaregiverError, match=f"^{re.escape(message)}$"):
        call(Undecided(method, answer))


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda batch: np.full(batch, 2.0), "2.0 among them"),
        (lambda batch: np.full(batch, np.nan), "nan among them"),
        (lambda batch: 0.5, "0.5"),
        (lambda batch: None, "None"),
    ],
)
def test_shares_of_random_moves_that_are_none(answer, words):
    message = f"Undecided.epsilons must answer with 2 numbers, 0 to 1, got {words}"
    with pytest.raises(CaregiverError, match=f"^{re.escape(message)}$"):
        Undecided("epsilons", answer).epsilons(2)
    np.testing.assert_array_equal(Undecided("epsilons", lambda batch: np.ones(batch, int)).epsilons(2), [1, 1])

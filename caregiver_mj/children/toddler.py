"""The toddler: a child that walks in short bouts with stops between them, calibrated to measurements.

Measurements at free play, from the sources' abstracts or introductions:

- Half of the walking bouts of 13-month-olds and 41 % of those of 19-month-olds have three steps or fewer. The
  probability to go on does not depend on the length so far, except that 13-month-olds stop more often in the first
  three steps. Most bouts end in the middle of the floor, at no recognisable goal. (Cole, Robinson and Adolph 2016,
  "Bouts of steps: The organization of infant exploration", Developmental Psychobiology 58.)
- 12- to 19-month-olds make 2,368 steps an hour (Adolph et al. 2012, "How do you learn to walk? Thousands of steps and
  dozens of falls per day", Psychological Science 23) and travel 7.7 American football fields (quoted from there by
  Hoch, O'Grady and Adolph 2018, "It's the journey, not the destination", Developmental Science).
- At home infants of 13 to 23 months stay at an object for 9.8 s in the median (Herzberg et al. 2022, "Infant exuberant
  object play at home", Child Development 93); with toys in the room they walk as much as without (Hoch, O'Grady and
  Adolph 2019, as above).
- Many steps are made in place; to a destination they lead straight (Hoch, Rachwani and Adolph 2019, "Where infants go",
  Child Development 91); most other bouts are curved, with steps in all directions ("The cost of simplifying complex
  developmental phenomena: a new perspective on learning to walk", PMC5911424).

Assumptions, as the full texts were not available: a longer bout of a 13-month-old continues like a 19-month-old's,
pauses and stays at a toy are geometric, and a bout without a goal turns at random. To walk as much with toys as
without, a toddler pauses less after the bouts that follow its time at a toy.
"""

from __future__ import annotations

import numpy as np

from caregiver_mj.children.behaviour import ChildPercept
from caregiver_mj.children.novice import Novice
from caregiver_mj.children.random_stream import pick
from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.plans.cell_graph import ACTIONS, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

SHORT_BOUT = 3  # steps
SHARE_OF_SHORT_BOUTS = 0.5  # share of bouts, at 13 months
SHARE_OF_SHORT_BOUTS_AT_19_MONTHS = 0.41
STEPS_AN_HOUR = 2368.0
METRES_AN_HOUR = 7.7 * 91.44  # a football field has 100 yards
DWELL = 9.8  # s at a toy, median

STEP_LENGTH = METRES_AN_HOUR / STEPS_AN_HOUR  # 0.297 m
SHARE_OF_TIME_WALKING = METRES_AN_HOUR / 3600.0 / WALKING_SPEED  # 0.44, at the paper's speed of 1.6 km/h

# Probability of stopping after one of the first three steps, and after a later one.
STOP_EARLY = 1.0 - (1.0 - SHARE_OF_SHORT_BOUTS) ** (1.0 / SHORT_BOUT)  # 0.21
STOP_LATER = 1.0 - (1.0 - SHARE_OF_SHORT_BOUTS_AT_19_MONTHS) ** (1.0 / SHORT_BOUT)  # 0.16


class Toddler(Novice):
    """Walks in bouts with stops between them.

    The cells of a bout follow from its steps, on average: a cell of 0.75 m takes two and a half steps, and one bout in
    six stays within its cell. With probability epsilon a bout has no goal and random moves; else it follows a shortest
    path to the bin, where it ends and the child plays. Most bouts of real toddlers have no goal: epsilon is above 0.5.
    """

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self._moves_a_step = STEP_LENGTH / plan.cell_size
        moves = mean_bout() * self._moves_a_step
        self._pause = max(1.0, moves * (1.0 / SHARE_OF_TIME_WALKING - 1.0))  # timesteps; mean
        self._done_playing = 1.0 - 0.5 ** (plan.cell_size / WALKING_SPEED / DWELL)  # probability in a timestep
        self.reset(1)

    def reset(self, batch: int) -> None:
        self._moves_left = np.zeros(batch, int)
        self._has_goal, self._plays = np.zeros((2, batch), bool)
        self._behind = np.zeros(batch)  # timesteps of rest beyond those without toys

    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        rests = self._moves_left == 0
        count, actions = self.ways(sight)
        greedy = actions[np.arange(len(count)), pick(draws[:, 1], count)]
        action = np.where(self._has_goal, greedy, pick(draws[:, 1], len(ACTIONS)))
        # A resting child reaches no bin, so all three draws are available for the next bout.
        hurries = ~self._plays & (self._behind > 0.0)
        likely = np.where(self._plays, self._done_playing, np.where(hurries, 1.0, 1.0 / self._pause))
        sets_out = rests & (draws[:, 0] < likely)
        self._behind += (rests & (self._plays | hurries)) - self._pause * (sets_out & (self._plays | hurries))
        rounding = draws[:, 0] / likely  # uniform in [0, 1) if it sets out
        moves = np.floor(bout_steps(draws[:, 1]) * self._moves_a_step + rounding).astype(int)
        self._has_goal = np.where(sets_out, draws[:, 2] >= self.epsilons(len(draws)), self._has_goal)
        _, target, number = self.plan.graph.moves
        arrives = ~rests & (target[sight.cell, action] == Target.BIN) & (number[sight.cell, action] == sight.goal)
        self._plays = (self._plays & ~sets_out) | arrives
        left = np.where(sets_out, moves, np.maximum(self._moves_left - 1, 0))
        self._behind += arrives * left * (1.0 / SHARE_OF_TIME_WALKING - 1.0)  # rest that belongs to moves not made
        self._moves_left = left * ~arrives
        return np.where(rests, NOTHING, action)


def bout_steps(draw: np.ndarray) -> np.ndarray:
    """Return the number of steps of bouts, from uniform draws in [0, 1), any shape."""
    longer = 1.0 - draw  # share of bouts at least as long
    early = np.ceil(np.log(longer) / np.log(1.0 - STOP_EARLY))
    later = np.ceil(np.log(longer / (1.0 - SHARE_OF_SHORT_BOUTS)) / np.log(1.0 - STOP_LATER))
    steps = np.where(longer > 1.0 - SHARE_OF_SHORT_BOUTS, early, SHORT_BOUT + later)
    return np.maximum(steps, 1.0).astype(int)


def mean_bout() -> float:
    """Return the mean steps of a bout: the sum over n of the share of bouts with more than n steps."""
    at_first = sum((1.0 - STOP_EARLY) ** step for step in range(SHORT_BOUT))
    return at_first + (1.0 - SHARE_OF_SHORT_BOUTS) / STOP_LATER

"""The learned caregiver: its options and features in a small house by hand, and its network."""

import dataclasses

import numpy as np
from worlds import percept

from caregiver_mj.caregivers import learned
from caregiver_mj.caregivers.learned import LearnedCaregiver, layers
from caregiver_mj.interventions.verb import BLOCK, DO_NOTHING, RELOCATE, STAND_ASIDE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

# As in test_caregiver: cells 0 to 4, the landing is cell 5. Tables: 0 bare, 1 with the candle, 2 bare.
CORRIDOR = FloorPlan.parse("#########\n#S.....B#\n##T#C#T##\n#########")


def test_options_by_hand():
    caregiver = LearnedCaregiver(CORRIDOR)
    assert caregiver.hazard.tolist() == [0, 1, 1, 1, NOTHING, NOTHING]
    assert caregiver.table.tolist() == [NOTHING, 0, 1, 2, NOTHING, NOTHING]
    orders = caregiver.take(np.array([0, 3, 4, 5]))
    assert orders.verb.tolist() == [BLOCK, RELOCATE, STAND_ASIDE, DO_NOTHING]
    assert orders.destination.tolist() == [NOTHING, 2, NOTHING, NOTHING]
    # Table 1 is where the candle is.
    assert caregiver.can_be(percept(CORRIDOR, 4, 0)).tolist() == [[True, True, False, True, True, True]]
    shut = percept(CORRIDOR, 4, 0, out_of_reach=np.array([[True, False]]), shut=np.array([[True]]))
    assert caregiver.can_be(shut).tolist() == [[False, True, False, True, True, True]]


def test_it_thinks_better_of_it_when_the_child_has_moved_or_it_is_done(monkeypatch):
    caregiver, asked = LearnedCaregiver(CORRIDOR), []
    best = iter([3, 0, 5])
    monkeypatch.setattr(caregiver, "scores", lambda percept, worlds: asked.append(0) or np.eye(6)[[next(best)]] * 9.0)
    assert caregiver.decide(percept(CORRIDOR, 4, 0)).destination == 2
    assert caregiver.decide(percept(CORRIDOR, 4, 1)).destination == 2
    assert len(asked) == 1
    assert caregiver.decide(percept(CORRIDOR, 4, 1, 2)).verb == BLOCK  # it is on table 2 now
    caregiver.watch(percept(CORRIDOR, 3, 1, 2))
    held = dataclasses.replace(percept(CORRIDOR, 3, 1, 2), holding=np.array([0]))
    assert caregiver.decide(held).verb == BLOCK  # until the hand is empty
    assert len(asked) == 2
    assert caregiver.decide(percept(CORRIDOR, 3, 1, 2)).verb == DO_NOTHING


def test_it_does_not_think_better_of_it_for_a_trifle(monkeypatch):
    caregiver = LearnedCaregiver(CORRIDOR)
    scores = iter([[0, 0, 0, 1.0, 0, 0], [1.4, 0, 0, 1.0, 0, 0], [1.6, 0, 0, 1.0, 0, 0]])
    monkeypatch.setattr(caregiver, "scores", lambda percept, worlds: np.array([next(scores)]))
    verbs = []
    for _ in range(3):
        caregiver.watch(percept(CORRIDOR, 3, 0))
        verbs += caregiver.decide(percept(CORRIDOR, 3, 0)).verb.tolist()
    assert verbs == [RELOCATE, RELOCATE, BLOCK]


def test_what_is_to_be_expected_without_candles():
    values, possible = learned._without_candles(CORRIDOR, LearnedCaregiver(CORRIDOR).pace)
    assert values.shape == (1, 1, 5 * 6, len(possible))
    values = values[0, 0].reshape(5, 6, -1).mean(axis=2)
    assert (values[:, 5] <= values.min(axis=1) + 0.01).all()  # on the landing nobody falls
    assert values[0, 4] > values[4, 4]  # the farther from the stairwell the better


def test_the_network_by_hand():
    net = {"mean": np.array([1.0]), "spread": np.array([2.0]), "w1": np.eye(1), "b1": np.zeros(1), "skip": np.zeros(1)}
    net |= {"w2": np.eye(1), "u2": 10 * np.eye(1), "b2": np.zeros(1), "w3": np.ones(1), "v1": np.eye(1)}
    net |= {"mean_world": np.zeros(1), "spread_world": np.ones(1)}
    # (3 - 1) / 2 = 1 and (5 - 1) / 2 = 2, on an average 1.5; -1 is cut off by the rectifier, and 99 at 6.
    rows, counts = np.array([[3.0], [5.0], [-1.0], [99.0]]), np.array([2, 2])
    assert layers(net, rows, np.zeros((2, 1)), counts)[-1].tolist() == [16, 17, 30, 36]
    # One more of each in the first world, and with the first feature itself on top.
    assert layers(net | {"skip": np.ones(1)}, rows, np.array([[1.0], [0.0]]), counts)[-1].tolist() == [28, 30, 29, 42]


def test_a_house_too_large_for_that_planner_does_without(monkeypatch):
    monkeypatch.setattr(learned, "candles_at_a_time", lambda plan: -1)
    learned._without_candles.cache_clear()
    features = LearnedCaregiver(CORRIDOR).features(percept(CORRIDOR, 0, 1), np.array([0]))
    learned._without_candles.cache_clear()
    assert all(np.isfinite(some).all() for some in features)

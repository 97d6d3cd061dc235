"""The ledger, with episodes worked by hand."""

import numpy as np

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import KINDS
from caregiver_mj.recording.ledger import BLOCKED, MET, Ledger

PLAN = FloorPlan.parse("#####\n#B..#\n#...#\n#T.S#\n#####", "small")  # six free cells
FREE = 6
STAIRS, CANDLE, TABLE = np.eye(3, len(KINDS)) * [[5], [4], [1]]
NONE = np.zeros(len(KINDS))
STAIRWELL, FREE_CELL, NOT = [True, False], [False, True], [False, False]  # what a child is denied


def ledger(*starts, timesteps=10) -> Ledger:
    return Ledger(PLAN, np.array(starts), timesteps)


def book(ledger, begun, ended, harm, toys=None, blocked=None) -> None:
    begun, ended, harm = np.array(begun), np.array(ended), np.array(harm)
    nothing = np.zeros(begun.shape, bool)
    unhindered = np.zeros((*begun.shape, len(BLOCKED)), bool)
    ledger.book(begun, ended, harm, nothing if toys is None else toys, unhindered if blocked is None else blocked)


def test_what_the_caregiver_denies_and_for_how_long():
    one = ledger([0, 1])
    denied = [[FREE_CELL, NOT], [STAIRWELL, FREE_CELL], [NOT, FREE_CELL], [FREE_CELL, FREE_CELL], [NOT, NOT]]
    for blocked in denied:
        book(one, [[0, 1]], [[0, 1]], [[NONE, NONE]], blocked=np.array([blocked]))
    assert one.moves_blocked.tolist() == [[[1, 2], [0, 3]]]
    assert one.longest_blocked.tolist() == [[2, 3]]  # on end, of each child by itself
    outcome = one.outcome()
    names = ("moves_blocked", "moves_blocked_stairwell", "moves_blocked_free", "longest_blocked")
    assert [outcome[name] for name in names] == [6, 1, 5, 3]
    assert outcome["timesteps_to_threshold"] == 10  # it is not reached: the length of an episode


def test_children_count_together_and_each():
    two = ledger([0, 5])
    book(two, [[0, 5]], [[1, 5]], [[NONE, STAIRS]], toys=np.array([[True, False]]))
    both, blocked = np.array([[True, True]]), np.array([[FREE_CELL, STAIRWELL]])
    book(two, [[1, 5]], [[1, 4]], [[CANDLE, TABLE]], both, blocked)
    book(two, [[1, 4]], [[0, 1]], [[STAIRS + TABLE, NONE]])
    outcome = two.outcome()
    assert (outcome["damage"], outcome["damage_by_child"]) == (16.0, [10.0, 6.0])
    assert (outcome["damage_stairwell"], outcome["damage_candle"], outcome["damage_table"]) == (10.0, 4.0, 2.0)
    assert outcome["timesteps_to_threshold"] == 3  # of all damage together
    assert outcome["cells_visited"] == 4  # 0, 1, 4 and 5, by whomever
    assert (outcome["toys_reached"], outcome["toys_by_child"]) == (3, [2.0, 1.0])
    assert outcome["moves_blocked"] == 2
    assert two.visits.tolist() == [[1, 3, 0, 0, 1, 1]]  # where their timesteps ended
    assert two.damage_at.tolist() == [[0, 10, 0, 0, 0, 6]]


def test_other_events_are_booked_by_whoever_sees_them_and_totals_are_the_outcomes():
    two = ledger([0], [1])
    two.intervene(np.array([0, 3]), np.array([0, 2]))
    two.drop(4)
    names = ("interventions", "interventions_done", "candles_dropped")
    assert [two.outcome()[name] for name in names] == [0, 0, 4]
    assert [two.outcomes()[1][name] for name in names] == [3, 2, 4]
    two = ledger([0, 1], [2, 3])
    book(two, [[0, 1], [2, 3]], [[1, 1], [2, 2]], [[STAIRS, NONE], [TABLE, CANDLE]])
    for name, values in two.totals().items():
        assert values.tolist() == [two.outcomes()[i][name] for i in range(2)], name


def test_how_a_move_met_the_caregiver_is_added_up():
    one = ledger([2, 4])
    for met in ([[True, True, False], [False, False, True]], [[True, False, False], [False, False, True]]):
        harm, nothing = np.zeros((1, 2, len(KINDS))), np.zeros((1, 2), bool)
        denied = np.zeros((1, 2, len(BLOCKED)), bool)
        one.book(np.array([[2, 4]]), np.array([[2, 4]]), harm, nothing, denied, np.array([met]))
    totals = one.totals()
    assert [totals[f"moves_{how}"].item() for how in MET] == [2, 1, 2]

"""Hazards and their damage: exact values by hand, and the two ways of numbering against each other."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, DamageWeights, Hazard, HazardKind, Hazards

#: Two stairwells and three candles: hazards 0 and 1, and 2 to 4.
FIVE = Hazards(2, 3)

COUNTS = st.integers(0, 6)
HAZARDS = st.builds(Hazards, COUNTS, COUNTS)


# -- Damage --------------------------------------------------------------------------------------


def test_damage_is_that_of_the_paper():
    weights = DamageWeights()
    assert (weights.stairwell, weights.candle, weights.table) == (5.0, 4.0, 1.0)
    assert weights.worst == 5.0
    assert DamageWeights(1, 2, 7).worst == 7


def test_damage_is_read_as_it_is_written():
    assert DamageWeights.parse("2:3.5:0") == DamageWeights(2.0, 3.5, 0.0)
    assert str(DamageWeights(2.0, 3.5, 0.0)) == "2:3.5:0"
    assert str(DamageWeights()) == "5:4:1"


@given(st.tuples(*[st.integers(0, 10**4).map(lambda n: n / 100)] * 3))
def test_damage_survives_writing_and_reading(values):
    assert DamageWeights.parse(str(DamageWeights(*values))) == DamageWeights(*values)


@pytest.mark.parametrize("text", ["", "5", "5:4", "5:4:1:0", "5:4:x", "5 4 1"])
def test_damage_that_is_not_three_numbers_is_refused(text):
    with pytest.raises(CaregiverError, match=rf"^damage must be STAIRWELL:CANDLE:TABLE, such as 5:4:1, got '{text}'$"):
        DamageWeights.parse(text)


@pytest.mark.parametrize(("kind", "value"), [("stairwell", -1.0), ("candle", float("nan")), ("table", float("inf"))])
def test_damage_is_finite_and_not_negative(kind, value):
    with pytest.raises(CaregiverError, match=rf"^the damage of a {kind} must be a number of at least 0, got {value}$"):
        DamageWeights(**{kind: value})


# -- The table -----------------------------------------------------------------------------------


def test_stairwells_come_first_then_candles():
    assert list(FIVE) == [
        Hazard(HazardKind.STAIRWELL, 0, 5.0),
        Hazard(HazardKind.STAIRWELL, 1, 5.0),
        Hazard(HazardKind.CANDLE, 0, 4.0),
        Hazard(HazardKind.CANDLE, 1, 4.0),
        Hazard(HazardKind.CANDLE, 2, 4.0),
    ]
    assert FIVE.damage.tolist() == [5, 5, 4, 4, 4]
    assert [hazard.label for hazard in FIVE] == ["S1", "S2", "C1", "C2", "C3"]
    assert [str(hazard) for hazard in FIVE] == ["stairwell 1", "stairwell 2", "candle 1", "candle 2", "candle 3"]


@pytest.mark.parametrize("number", [NOTHING, 5])
def test_there_is_no_hazard_beyond_the_table(number):
    with pytest.raises(IndexError, match=f"no hazard {number}: there are 5"):
        FIVE[number]


def test_a_plan_has_its_own_hazards_and_damage():
    plan = FloorPlan.parse("######\n#B.SC#\n#....#\n#...T#\n######", damage=DamageWeights(9, 2, 1))
    assert [(str(hazard), hazard.damage) for hazard in plan.hazards] == [("stairwell 1", 9), ("candle 1", 2)]
    assert len(FloorPlan.parse("####\n#.B#\n####").hazards) == 0


# -- Numbers -------------------------------------------------------------------------------------


def test_numbers_by_hand():
    assert [FIVE.of_stairwell(i) for i in (NOTHING, 0, 1)] == [NOTHING, 0, 1]
    assert [FIVE.of_candle(i) for i in (NOTHING, 0, 2)] == [NOTHING, 2, 4]
    assert [FIVE.stairwell(n) for n in range(-1, 5)] == [NOTHING, 0, 1, NOTHING, NOTHING, NOTHING]
    assert [FIVE.candle(n) for n in range(-1, 5)] == [NOTHING, NOTHING, NOTHING, 0, 1, 2]
    assert [bool(FIVE.is_stairwell(n)) for n in range(-1, 5)] == [False, True, True, False, False, False]
    assert [bool(FIVE.is_candle(n)) for n in range(-1, 5)] == [False, False, False, True, True, True]


@pytest.mark.parametrize(
    ("method", "index", "words"),
    [
        ("of_stairwell", 7, r"the number of a stairwell must be from 0 to 1, or NOTHING \(-1\), got 7"),
        ("of_stairwell", 2, "from 0 to 1, .* got 2"),
        ("of_stairwell", -2, "from 0 to 1, .* got -2"),
        ("of_stairwell", np.array([[0, NOTHING], [1, 3]]), "from 0 to 1, .* got 3"),
        ("of_candle", 3, r"the number of a candle must be from 0 to 2, or NOTHING \(-1\), got 3"),
        ("of_candle", np.array([0, -5]), "got -5"),
    ],
)
def test_there_is_no_number_of_what_there_is_not(method, index, words):
    with pytest.raises(CaregiverError, match=words):
        getattr(FIVE, method)(index)


def test_a_house_without_any_has_no_number_of_one():
    bare = Hazards(0, 0)
    assert (bare.of_stairwell(NOTHING), bare.of_candle(NOTHING)) == (NOTHING, NOTHING)
    assert bare.of_candle(np.array([], int)).tolist() == []
    with pytest.raises(CaregiverError, match=r"stairwell must be NOTHING \(-1\), for there is none, got 0"):
        bare.of_stairwell(0)


def test_a_single_number_stays_a_plain_one():
    for number in (FIVE.of_stairwell(np.int64(1)), FIVE.of_candle(1), FIVE.stairwell(1), FIVE.candle(3)):
        assert type(number) is int


@given(HAZARDS, st.lists(st.lists(st.integers(-1, 11), min_size=2, max_size=2), min_size=1, max_size=4))
def test_arrays_are_treated_number_by_number(hazards, rows):
    numbers = np.array(rows).clip(max=len(hazards) - 1)
    for method in (hazards.stairwell, hazards.candle, hazards.is_stairwell, hazards.is_candle):
        assert method(numbers).tolist() == [[method(int(n)) for n in row] for row in numbers]
    for method, count in ((hazards.of_stairwell, hazards.stairwells), (hazards.of_candle, hazards.candles)):
        indices = numbers.clip(max=count - 1)
        assert method(indices).tolist() == [[method(int(i)) for i in row] for row in indices]


@given(HAZARDS)
def test_every_hazard_has_a_number_and_an_index_that_lead_to_each_other(hazards):
    for number, hazard in enumerate(hazards):
        assert hazards[number] == hazard
        if hazard.kind is HazardKind.STAIRWELL:
            assert (hazards.stairwell(number), hazards.candle(number)) == (hazard.index, NOTHING)
            assert hazards.of_stairwell(hazard.index) == number
        else:
            assert (hazards.stairwell(number), hazards.candle(number)) == (NOTHING, hazard.index)
            assert hazards.of_candle(hazard.index) == number
        assert hazards.is_stairwell(number) != hazards.is_candle(number)


@given(HAZARDS, st.integers(1, 3))
def test_what_is_joined_can_be_split_again(hazards, worlds):
    values = np.arange(worlds * len(hazards)).reshape(worlds, len(hazards))
    stairwells, candles = hazards.split(values)
    assert stairwells.shape == (worlds, hazards.stairwells)
    assert candles.shape == (worlds, hazards.candles)
    assert (hazards.join(stairwells, candles) == values).all()

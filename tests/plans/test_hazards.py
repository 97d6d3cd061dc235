"""Hazards and their damage: exact values by hand, and the two ways of numbering against each other."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from caregiver_mj import CaregiverError, FloorPlan
from caregiver_mj.plans import hazards
from caregiver_mj.plans.hazards import BATTERY, CANDLE, NOTHING, STAIRWELL, DamageWeights, Hazard, Hazards, Where

#: Two stairwells and three candles: hazards 0 and 1, and 2 to 4.
FIVE = Hazards((STAIRWELL,) * 2 + (CANDLE,) * 3)
COUNTS = st.integers(0, 6)
PLACES = Where.OPENING, Where.ON_TABLE, Where.FLOOR
HAZARDS = st.builds(
    lambda stairs, candles, batteries: Hazards((STAIRWELL,) * stairs + (CANDLE,) * candles + (BATTERY,) * batteries),
    *[COUNTS] * 3,
)


def test_damage_is_that_of_the_paper():
    weights = DamageWeights()
    assert weights.items() >= {"stairwell": 5.0, "candle": 4.0, "table": 1.0}.items()
    assert (weights.worst, DamageWeights(1, 2, 7).worst) == (5.0, 7)


def test_damage_is_read_as_it_is_written():
    assert DamageWeights.of("2:3.5:0") == DamageWeights(2.0, 3.5, 0.0)
    assert (str(DamageWeights(2.0, 3.5, 0.0)), str(DamageWeights())) == ("2:3.5:0", "5:4:1")


def test_damage_is_said_by_name_and_what_is_not_said_is_that_of_the_paper():
    dear = DamageWeights(20, 4, 1)
    assert dear == DamageWeights(stairwell=20) == DamageWeights.of("stairwell=20")
    assert dear == DamageWeights.of({"stairwell": 20})
    assert DamageWeights.of(" table=0 , candle=.5") == DamageWeights.of("5:.5:0")
    assert FloorPlan.load("paper", damage="stairwell=20") == FloorPlan.load("paper", damage=dear)
    assert hash(DamageWeights.of("20:4:1")) == hash(dear)


def test_openings_with_a_fence_are_the_last_ones_wherever_their_kind_stands(monkeypatch):
    window = dataclasses.replace(STAIRWELL, name="window", symbol="W", model="window")
    monkeypatch.setattr(hazards, "KINDS", (*hazards.KINDS, window))
    assert hazards.kinds_at(Where.OPENING) == (STAIRWELL, window, hazards.GATE)


@pytest.mark.parametrize("taken", [{"symbol": "S"}, {"name": "stairwell"}])
def test_a_kind_takes_no_place_of_another_but_may_come_twice(taken):
    window = dataclasses.replace(STAIRWELL, **{"name": "window", "symbol": "W"} | taken)
    with pytest.raises(CaregiverError, match=f"must be its own, got '{next(iter(taken.values()))}' for .* stairwell$"):
        hazards.distinct(*hazards.KINDS, window)
    assert hazards.distinct(*hazards.KINDS, dataclasses.replace(STAIRWELL)) == hazards.KINDS


def test_stairwells_come_first_then_candles():
    assert list(FIVE) == [*(Hazard(STAIRWELL, i, 5.0) for i in range(2)), *(Hazard(CANDLE, i, 4.0) for i in range(3))]
    assert (FIVE.worst(Where.OPENING), FIVE.worst(Where.ON_TABLE), Hazards(()).worst(Where.OPENING)) == (5.0, 4.0, 0.0)
    assert FIVE.damage.tolist() == [5, 5, 4, 4, 4]
    assert [hazard.label for hazard in FIVE] == ["S1", "S2", "C1", "C2", "C3"]
    assert [str(hazard) for hazard in FIVE] == ["stairwell 1", "stairwell 2", "candle 1", "candle 2", "candle 3"]


@pytest.mark.parametrize(
    ("where", "index", "words"),
    [
        (Where.OPENING, np.array([[0, NOTHING], [1, 7]]), "a stairwell or gate must be from 0 to 1, .* got 7"),
        (Where.OPENING, -2, "from 0 to 1, .* got -2"),
        (Where.ON_TABLE, 3, r"a candle or mug.* must be from 0 to 2, or NOTHING \(-1\), got 3"),
    ],
)
def test_there_is_no_number_of_what_there_is_not(where, index, words):
    with pytest.raises(CaregiverError, match=words):
        FIVE.number(where, index)


@given(HAZARDS)
def test_every_hazard_has_a_number_and_an_index_that_lead_to_each_other(hazards):
    for number, hazard in enumerate(hazards):
        assert hazards[number] == hazard  # noqa: PLR1736 that is what is tested
        for where in PLACES:
            is_there = hazard.kind.where is where
            assert hazards.among(where, number) == (hazard.index if is_there else NOTHING)
            assert hazards.are_at(where, number) == is_there
            assert hazards.number(where, hazards.among(where, number)) == (number if is_there else NOTHING)
            assert (hazard in hazards.at(where)) == is_there


@given(HAZARDS, st.integers(1, 3))
def test_what_is_joined_can_be_split_again(hazards, worlds):
    values = np.arange(worlds * len(hazards)).reshape(worlds, len(hazards))
    stairwells, candles, batteries = hazards.split(values)
    assert stairwells.shape == (worlds, len(hazards.at(Where.OPENING)))
    assert candles.shape == (worlds, len(hazards.at(Where.ON_TABLE)))
    assert batteries.shape == (worlds, len(hazards.at(Where.FLOOR)))
    assert (hazards.join(stairwells, candles, batteries) == values).all()

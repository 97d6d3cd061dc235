"""The ablations: other destinations of candles, and tables as they are printed."""

import numpy as np

from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.children.tape import EPISODE_TIMESTEPS, Tape
from caregiver_mj.plans.floor_plan import FloorPlan
from studies.ablations import (
    LeastExposedTable,
    NearestTable,
    Study,
    Variant,
    safety_table,
    thresholds_table,
    variants_table,
)

# The candle's table, then the others from left to right; a bin beside the last one, so that children go there.
CORRIDOR = FloorPlan.parse("###########\n#.........#\n#.C.T...TB#\n###########", "corridor")


def percept(child):
    one = np.array([[CORRIDOR.cell_index[child]]])
    return Percept(one, one, np.array([[-1]]), one[0], np.array([[0]]), np.array([-1]))


def test_nearest_table_is_the_nearest_on_foot_wherever_the_child_is():
    caregiver = NearestTable(CORRIDOR)
    for child in ((1, 1), (1, 9)):
        assert caregiver.destination(percept(child), np.array([0])).tolist() == [1]


def test_least_exposed_table_is_bumped_into_most_rarely():
    caregiver = LeastExposedTable(CORRIDOR)
    assert caregiver.exposure.shape == (3,)
    assert (caregiver.exposure > 0).all()
    destination = int(caregiver.destination(percept((1, 1)), np.array([0]))[0])
    assert destination == 1 + int(caregiver.exposure[1:].argmin())
    worth = caregiver.worth_protecting(percept((1, 1)))
    assert worth.tolist() == [[bool(caregiver.exposure[0] > caregiver.exposure[1:].min())]]


def study(timesteps=EPISODE_TIMESTEPS):
    tapes = [Tape.draw_family(np.random.RandomState(seed), 1, timesteps) for seed in range(4)]
    return Study(FloorPlan.load("paper"), tapes)


def cells(text):
    return [line.strip("| ").split(" | ") for line in text.splitlines()]


def test_tables_have_a_row_a_variant():
    few = {"default": {}, "hyperprior 3": {"hyperprior": 3.0}}
    made = {name: Variant(options=options) for name, options in few.items()} | {"one action": Variant(actions=1)}
    short = study(timesteps=100)
    rows = cells(variants_table(short, made))
    assert [row[0] for row in rows] == ["variant", "---", *made]
    assert {len(row) for row in rows} == {9}
    assert [row[-1] for row in rows[2:4]] == ["100%", "100%"]  # P(safe) changes no choice
    assert rows[2][1:] == rows[3][1:]
    assert rows[4][1:] != rows[2][1:]

    rows = cells(thresholds_table(short, few))
    assert [row[0] for row in rows[2:]] == [f"threshold {t}" for t in ("0", "0.1", "0.5", "1", "0.5, hyperprior 3")]
    assert {len(row) for row in rows} == {7}

    rows = cells(safety_table(study(), few))  # after up to 200 timesteps
    assert [row[0] for row in rows[2:]] == list(few)
    probabilities = np.array([row[1:] for row in rows[2:]], float)
    assert probabilities.shape == (2, 10)
    assert ((probabilities >= 0) & (probabilities <= 1)).all()
    assert (probabilities[:, 6] > probabilities[:, 0]).all()  # a careful novice looks safer than a careless one

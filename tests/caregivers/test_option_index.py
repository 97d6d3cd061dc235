import numpy as np

from caregiver_mj.caregivers.foresight.option_index import OptionIndex
from caregiver_mj.plans.hazards import NOTHING

# 0 and 1 stairwells, 2 aside, 3 stay, 4 candle, 5 and 6 things on the floor, 7 lookout, 8 to 10 cells
INDEX = OptionIndex(stairwells=2, candles=1, things=2, lookouts=1, cells=3)


def test_options_follow_each_other_without_a_gap():
    assert (INDEX.stairs, INDEX.aside, INDEX.stay) == (slice(0, 2), 2, 3)
    assert (INDEX.relocations, INDEX.pick_ups) == (slice(4, 5), slice(5, 7))
    assert (INDEX.looks, INDEX.waits, len(INDEX)) == (slice(7, 8), slice(8, 11), 11)


def test_hazards_are_numbered_without_the_options_about_none():
    hazards = [0, 1, NOTHING, NOTHING, 2, 3, 4, *4 * [NOTHING]]
    assert INDEX.hazard(np.arange(11)).tolist() == hazards


def test_values_of_hazards_are_put_where_their_options_are():
    values = INDEX.of_hazards(np.array([[1.0, 2.0, 3.0, 4.0, 5.0]]), others=-9.0)
    assert values.tolist() == [[1.0, 2.0, -9.0, -9.0, 3.0, 4.0, 5.0, *4 * [-9.0]]]


def test_options_are_numbered_among_their_kind():
    options = np.array([4, 5, 6, 7])
    assert OptionIndex.among(INDEX.pick_ups, options).tolist() == [NOTHING, 0, 1, NOTHING]

"""The study of relocations: what is measured of one, and what disturbs it."""

import math

import pytest

from caregiver_mj.robot.embodiments import find_embodiment
from studies.relocations import LIFTED, Conditions, Moment, relocate, times

GRASP = find_embodiment().grasp
REST = Moment(time=0.0, x=0.0, y=0.0, speed=0.0, fingers=GRASP.open, height=0.0, reach=0.0, held=False)


def course(*changes):
    """Moments a second apart, each the one before with something changed."""
    moments = [REST]
    for i, change in enumerate(changes, 1):
        moments.append(moments[-1]._replace(time=float(i), **change))
    return moments


TAKES = (
    {"x": 1.0, "speed": 1.0},  # 1: it drives
    {"x": 2.0, "speed": 0.0},  # 2: it has arrived
    {},  # 3
    {"fingers": GRASP.closed, "held": True},  # 4: it grasps
    {"height": LIFTED + 0.01, "reach": 1.0},  # 5: the candle is up
)
PUTS = (
    {"x": 3.0, "speed": 1.0},  # 6
    {"x": 4.0, "speed": 0.0, "height": 0.0},  # 7: there
    {"fingers": GRASP.open, "held": False},  # 8: let go
    {"reach": 0.7},  # 9
    {"reach": 0.6},  # 10: clear
)


def test_times_from_arriving_to_what_happens():
    assert times(course(*TAKES, *PUTS), GRASP) == (3.0, 3.0)
    # What does not happen has no time.
    assert times(course(*TAKES), GRASP) == pytest.approx((3.0, math.nan), nan_ok=True)
    assert times(course(*TAKES[:3]), GRASP) == pytest.approx((math.nan, math.nan), nan_ok=True)


def test_a_candle_that_is_knocked_over_counts_as_dropped():
    result = relocate(Conditions(knock=True), 3)
    assert result["drops"] > 0
    assert result["tipped"] > 0
    assert math.isnan(result["lifting"])


@pytest.mark.parametrize(
    ("conditions", "seed"),
    [
        (Conditions(white=0.01, white_base=0.003, white_child=0.02, dropout=0.1), 0),
        (Conditions(delay=0.06), 0),
        (Conditions(table_height=(0.75,)), 1),
        (Conditions(table_height=(0.45,)), 1),
    ],
)
def test_a_relocation_under_conditions_knocks_nothing_over(conditions, seed):
    result = relocate(conditions, seed)
    assert result | {"failure": "", "tipped": 0, "drops": 0, "strikes": 0} == result

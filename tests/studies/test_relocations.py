"""The study of relocations: what is measured of one, what disturbs it, and what is printed of many."""

import json
import math

import numpy as np
import pandas as pd
import pytest
from printed import printed

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.tasks import load
from studies.relocations import LIFTED, Barred, Conditions, Moment, relocate, report, times
from study import main

GRASP = find_embodiment().grasp
REST = Moment(time=0.0, x=0.0, y=0.0, speed=0.0, fingers=GRASP.open, height=0.0, reach=0.0, held=False)


# -- What is measured ----------------------------------------------------------------------------


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


# -- One, and many -------------------------------------------------------------------------------


@pytest.mark.parametrize(("table", "barred"), [(1, 0.0), (0, 0.04)])
def test_a_child_in_the_only_way_is_told(table, barred):
    plan = FloorPlan.parse("########\n#T....C#\n##B#####\n########", "corridor")
    env = load("relocate_candle", plan, random=0, visuals=False)
    env.reset()
    env.physics.set_robot(np.array([*plan.position((1, 5)), 0.0]))
    env.task.children[0].put((1, 3))
    env.physics.set_toddler(env.task.children[0].walk)
    found = Barred(env.physics, plan, (table, 1), 0.02)
    for _ in range(2):
        found.look()
    assert found.seconds == barred


def test_a_candle_that_is_knocked_over_counts_as_dropped():
    result = relocate(Conditions(knock=True), 3)
    assert result["drops"] > 0
    assert result["tipped"] > 0
    assert math.isnan(result["lifting"])


def relocation(seed, **others):
    values = {
        "house": "paper", "seed": seed, "strikes": 0, "drops": 0, "failure": "", "tipped": 0, "tilt": 0.1,
        "error": 0.001, "lifting": 0.4, "clearing": 0.5, "seconds": 12.0, "barred": 2.5, "touches": (),
    }  # fmt: skip
    return values | others


def rows(*relocations):
    return pd.DataFrame(relocations)


def test_report_tells_what_went_well_and_names_what_went_wrong():
    text = printed(report, rows(relocation(0), relocation(1, house="apartment", lifting=0.6)))
    lines = {line[:30].strip(): line[30:].split() for line in text.splitlines()}
    assert lines["done"] == ["1/1", "1/1", "2/2", "all", "200/200"]
    assert lines["arrived to lifted, s: worst"][:3] == ["0.40", "0.60", "0.60"]
    assert "touched nothing but candles" in text
    # Report names what went wrong.
    bad = relocation(5, failure="candle lost", drops=1, lifting=math.nan, touches=(("robot/hand", "wall"),))
    text = printed(report, rows(relocation(2, clearing=1.7), bad))
    assert "paper, seed 2: clearing took 1.70 s" in text
    assert "touched in 1: robot/hand and wall (paper 5)" in text
    assert "paper, seed 5: candle lost; a child stood in the only way for 2.5 s\n" in text
    assert "paper, seed 5: 1 drops\n" in text


def test_command(tmp_path, capsys):
    path = tmp_path / "relocations.json"
    command = "relocations --count 1 --first 3 --jobs 1 --noise 0.001 --delay 0.02 --house paper house-1 --json"
    main([*command.split(), str(path)])
    assert "1/1" in capsys.readouterr().out
    assert [(row["house"], row["seed"], row["failure"]) for row in json.loads(path.read_text())] == [("house-1", 3, "")]


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

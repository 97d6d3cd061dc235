"""The study of relocations: what is measured of one, what disturbs it, and what is printed of many."""

import dataclasses
import json
import math

import dm_env
import numpy as np
import pytest
from printed import printed

from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.studies.houses import HOUSES, load_house
from caregiver_mj.studies.relocations.command import main
from caregiver_mj.studies.relocations.course import LIFTED, Moment, times
from caregiver_mj.studies.relocations.eyes import Eyes
from caregiver_mj.studies.relocations.relocation import Conditions, Relocation, relocate
from caregiver_mj.studies.relocations.report import report

GRASP = find_embodiment().grasp
REST = Moment(time=0.0, x=0.0, y=0.0, speed=0.0, fingers=GRASP.open, height=0.6, reach=0.0, held=False)


def test_houses_are_known_by_their_names():
    assert HOUSES[:2] == ("paper", "apartment")
    assert load_house(HOUSES[2]).shape == (14, 13)
    assert load_house(HOUSES[2]) is load_house(HOUSES[2])
    for name in HOUSES:
        plan = load_house(name)
        assert len(plan.candle_tables) > 0
        assert len(plan.tables) > len(plan.candle_tables)


# -- What is measured ----------------------------------------------------------------------------


def course(*changes):
    """Moments a second apart, each the one before with something changed."""
    moments = [REST]
    for i, change in enumerate(changes, 1):
        moments.append(dataclasses.replace(moments[-1], time=float(i), **change))
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
    {"x": 4.0, "speed": 0.0, "height": 0.6},  # 7: there
    {"fingers": GRASP.open, "held": False},  # 8: let go
    {"reach": 0.7},  # 9
    {"reach": 0.6},  # 10: clear
)


def test_times_from_arriving():
    assert times(course(*TAKES, *PUTS), GRASP) == (3.0, 3.0)


def test_what_does_not_happen_has_no_time():
    assert times(course(*TAKES), GRASP) == pytest.approx((3.0, math.nan), nan_ok=True)
    assert times(course(*TAKES[:3]), GRASP) == pytest.approx((math.nan, math.nan), nan_ok=True)


# -- What disturbs it ----------------------------------------------------------------------------


def seen(heights, fingers=0.036, sigma=0.01, yaw=0.0):
    """Where the candles seem to be, by sight of one moment after the other."""
    shown = []
    eyes = Eyes(lambda timestep: shown.append(timestep.observation["candle_position"]), sigma, seed=0)
    for height, width in zip(heights, np.broadcast_to(fingers, len(heights)), strict=True):
        positions = np.array([[0.0, 0.0, height], [1.0, 0.0, 0.6]])
        observation = {
            "candle_position": positions,
            "finger_position": np.array([width, width]),
            "base_position": np.array([0.0, 0.0, yaw]),
        }
        eyes(dm_env.transition(0.0, observation))
        assert (observation["candle_position"] == positions).all()
        shown[-1] = shown[-1] - positions
    return shown


def test_an_error_lasts_as_long_as_a_sighting():
    first, second, lifted, down = seen([0.6, 0.6, 0.8, 0.6])
    assert (first == second).all()
    assert (first != lifted).any(axis=1).tolist() == [True, False]
    assert (lifted != down).any(axis=1).tolist() == [True, False]
    assert 0.0 < np.abs(first).max() < 0.05


def test_a_hand_that_opens_again_looks_again():
    closed, opened = seen([0.6, 0.6, 0.6], fingers=[0.036, 0.012, 0.036])[1:]
    assert (closed != opened).all()


def test_in_the_hand_the_error_turns_with_the_robot():
    ahead, left = seen([0.8])[0], seen([0.8], yaw=math.pi / 2)[0]
    assert left[0] == pytest.approx([-ahead[0, 1], ahead[0, 0], ahead[0, 2]])
    assert left[1] == pytest.approx(ahead[1])


def test_the_robot_is_named_only_if_asked_for():
    assert "embodiment" not in Conditions().task_kwargs()
    assert Conditions(embodiment="other").task_kwargs()["embodiment"] == "other"


# -- One, and many -------------------------------------------------------------------------------


def test_a_relocation():
    result = relocate(Conditions(), 3)
    assert (result.house, result.seed, result.failure, result.touches) == ("paper", 3, "", ())
    assert (result.strikes, result.drops) == (0, 0)
    assert result.error < 0.005
    assert result.tilt < 1.0
    assert 0.1 < result.lifting < 1.5
    assert 0.1 < result.clearing < 1.5


def test_a_candle_that_is_knocked_over_counts_as_dropped():
    result = relocate(Conditions(knock=True), 3)
    assert result.drops > 0
    assert math.isnan(result.lifting)


def relocation(seed, **others):
    values = {
        "house": "paper", "seed": seed, "strikes": 0, "drops": 0, "failure": "", "tilt": 0.1, "error": 0.001,
        "lifting": 0.4, "clearing": 0.5, "seconds": 12.0, "touches": (),
    }  # fmt: skip
    return Relocation(**values | others)


def test_report_of_good_ones():
    text = printed(report, [relocation(0), relocation(1, house="apartment", lifting=0.6)])
    rows = {line[:30].strip(): line[30:].split() for line in text.splitlines()}
    assert rows["done"] == ["1/1", "1/1", "2/2", "all", "200/200"]
    assert rows["arrived to lifted, s: worst"][:3] == ["0.40", "0.60", "0.60"]
    assert "touched nothing but candles" in text


def test_report_names_what_went_wrong():
    bad = relocation(5, failure="candle lost", drops=1, lifting=math.nan, touches=(("robot/hand", "wall"),))
    text = printed(report, [relocation(2, clearing=1.7), bad])
    assert "paper, seed 2: clearing took 1.70 s" in text
    assert "touched in 1: robot/hand and wall (paper 5)" in text
    assert "paper, seed 5: candle lost\n" in text
    assert "paper, seed 5: 1 drops\n" in text


def test_command(tmp_path, capsys):
    path = tmp_path / "relocations.json"
    main(["--count", "1", "--first", "3", "--jobs", "1", "--noise", "0.001", "--json", str(path)])
    assert "1/1" in capsys.readouterr().out
    assert [row["seed"] for row in json.loads(path.read_text())] == [3]

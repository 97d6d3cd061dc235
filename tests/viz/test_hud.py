"""What the head-up display draws, read back from its pixels."""

import dataclasses

import numpy as np
import pytest

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz import hud

PLAN = FloorPlan.parse("#######\n#S...C#\n#..T..#\n#B...C#\n#######", "small")  # hazards S1, C1, C2
_ROWS = ["#" + "C." * 20 + ".#", "#" + "." * 41 + "#"] * 2
FORTY = FloorPlan.parse("\n".join(["#" * 43, *_ROWS, "#BT" + "." * 39 + "#", "#" * 43]), "forty")
SIZES = [(1280, 720), (320, 240)]
DARK = (16, 20, 28)  # the cards' own colour, so that their transparency does not show


def frame(width=1280, height=720):
    return np.full((height, width, 3), DARK, np.uint8)


def candles(plan):
    return np.array([[*plan.position(plan.tables[t]), 0.6] for t in plan.candle_tables]).reshape(-1, 3)


def state(plan=PLAN, child=None, **changes):
    """A moment with one child; `child` has what is to be special about that."""
    middle = {"position": plan.position((2, 2)), "safe": 0.5}
    basis = hud.HudState(
        plan=plan,
        timestep=50,
        family="0.5",
        children=(hud.ChildState(**middle | (child or {})),),
        candles=candles(plan),
        robot=np.array([*plan.position((3, 3)), 0.0]),
        danger=np.array([0.2, 0.4, 0.8]),
        target=2,
        mark=("candle", 1),
        intervention="carry candle 2 to table 1",
    )
    return dataclasses.replace(basis, **changes)


def changed(first, second):
    """Mask of the pixels in which two pictures differ."""
    return (first != second).any(axis=2)


def spread(mask):
    """Left, top, right, bottom of a mask's true pixels."""
    rows, columns = np.nonzero(mask)
    return columns.min(), rows.min(), columns.max(), rows.max()


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_draws_on_a_copy_and_leaves_the_middle_alone(width, height):
    blank = np.random.default_rng(0).integers(0, 255, (height, width, 3), np.uint8)
    before = blank.copy()
    drawn = hud.draw(blank, state())
    assert drawn.shape == blank.shape
    assert drawn.dtype == np.uint8
    np.testing.assert_array_equal(blank, before)
    top = hud.strip_top(width, height)
    middle = np.s_[height // 2 : top, width // 3 :]
    np.testing.assert_array_equal(drawn[middle], blank[middle])
    assert changed(drawn, blank)[top:].mean() > 0.8
    assert changed(drawn, blank)[: height // 5, : width // 8].mean() > 0.8


def test_bars_are_as_high_as_the_danger_and_in_the_order_of_the_hazards():
    def bar(danger):
        return spread(changed(*(hud.draw(frame(), state(danger=np.array(d), target=-1)) for d in (danger, [0.0] * 3))))

    def height(danger):
        _, top, _, bottom = bar(danger)
        return bottom - top + 1

    assert height([1.0, 0.0, 0.0]) > 30
    assert height([0.0, 0.5, 0.0]) == pytest.approx(height([1.0, 0.0, 0.0]) / 2, abs=1)
    # Beyond the usual the scale adapts: the greatest bar is full, the others keep their proportion to it.
    assert height([0.0, 2.0, 4.0]) == height([1.0, 0.0, 0.0])
    first, second, third = (bar(danger)[0] for danger in np.eye(3))
    assert first < second < third


@pytest.mark.parametrize(("width", "height"), SIZES)
@pytest.mark.parametrize(
    ("plan", "danger"),
    [(PLAN, None), (PLAN, np.empty(0)), (PLAN, np.array([5.0, 0.0, 0.0])), (FORTY, np.linspace(0, 2, 40))],
    ids=["none", "0", "3", "40"],
)
def test_any_number_of_hazards_fits(width, height, plan, danger):
    drawn = hud.draw(frame(width, height), state(plan, danger=danger, target=0))
    strip = changed(drawn, frame(width, height))[hud.strip_top(width, height) :]
    assert strip.any()
    assert not strip[:, -width // 100 :].any()  # nothing runs out of the card

"""What the head-up display draws, read back from its pixels."""

import dataclasses

import numpy as np
import pytest

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz import colours, hud

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


def toddler(picture):
    """Column and row of the toddler on the plan."""
    yellow = np.abs(picture[: 720 // 2, : 1280 // 3].astype(int) - colours.TODDLER).max(axis=2) < 40
    return np.median(np.argwhere(yellow), axis=0)[::-1]  # flames have a few such pixels too


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


@pytest.mark.parametrize(("name", "low", "high"), [("safe", 0.25, 0.75), ("timestep", 50, 150)])
def test_gauges_fill_in_proportion(name, low, high):
    def left_part(value):
        shown = state(child={"safe": value}) if name == "safe" else state(timestep=value)
        return hud.draw(frame(), shown)[hud.strip_top(1280, 720) :, :260]

    def filled(value):
        drawn, empty = left_part(value), left_part(0)
        rows = changed(drawn, empty).sum(axis=1)
        return rows.max()  # a row of the gauge is longer than any of the number's

    assert filled(high) == pytest.approx(3 * filled(low), abs=6)


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


@pytest.mark.parametrize(
    ("mark", "middle"),
    [
        (("cell", PLAN.stairwells[0]), PLAN.position(PLAN.stairwells[0])),
        (("candle", 1), PLAN.position(PLAN.tables[2])),
        (("cell", (2, 2)), PLAN.position((2, 2))),
    ],
    ids=["stairwell", "candle", "any cell"],
)
def test_the_plan_points_at_what_the_verb_says(mark, middle):
    drawn, plain = (hud.draw(frame(), state(robot=None, mark=m, target=-1)) for m in (mark, None))
    left, top, right, bottom = spread(changed(drawn, plain))
    # Where that is, by what is known to be there: the child, drawn at the same place.
    there = hud.draw(frame(), state(child={"position": middle}, robot=None, mark=None, target=-1))
    np.testing.assert_allclose(((left + right) / 2, (top + bottom) / 2), toddler(there), atol=(right - left) / 4)


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


def strip(**changes):
    """The card along the lower edge."""
    return hud.draw(frame(), state(**changes))[hud.strip_top(1280, 720) :]


def test_who_estimates_nothing_gets_no_empty_gauge_and_no_empty_bars():
    shown = strip(danger=None, child={"safe": None})
    card = shown[60, 5]  # where there is never anything
    middle, lower_left = shown[:, 280:900], shown[60:, :260]
    for part in (middle, lower_left):
        assert (np.abs(part[5:-15].astype(int) - card) < 4).all()


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (640, 360)])
def test_only_kinds_that_have_done_damage_are_named_and_none_is_cut_off(width, height):
    def drawn(**damages):
        shown = state(damage=sum(damages.values()), damages={"stairs": 0.0, "candles": 0.0, "tables": 0.0} | damages)
        return hud.draw(frame(width, height), shown)

    nothing = hud.draw(frame(width, height), state(damage=0.0, damages=None))
    np.testing.assert_array_equal(drawn(), nothing)
    both, one = drawn(stairs=5.0, candles=4.0), drawn(stairs=9.0)
    left, _, right, _ = spread(changed(both, one))
    assert left > 0.75 * width
    assert right < width - width // 100


def test_a_long_name_leaves_room_for_the_children():
    """What is written at the right is the same, whatever stands to its left."""
    long, short = (dataclasses.replace(PLAN, name=name) for name in ("house-6-13x9-rooms2-stairwells2-candles2", "h"))
    pictures = [hud.draw(frame(), state(plan)) for plan in (long, short)]
    *_, right, _ = spread(changed(*pictures))
    right_half = changed(hud.draw(frame(), state(short, family="1")), pictures[1])
    assert right < spread(right_half)[0]


# -- Several children --------------------------------------------------------------------------------

CELLS = [(1, 2), (2, 4), (3, 3), (2, 1)]


def family(count):
    """A moment with up to four children, 20 to 80 % safe."""
    each = [hud.ChildState(PLAN.position(cell), safe=0.2 + 0.2 * i) for i, cell in enumerate(CELLS[:count])]
    return hud.draw(frame(), state(family=",".join(["0.5"] * count), children=tuple(each), robot=None, mark=None))


def where(picture, colour):
    """The middle of a colour, as column and row."""
    return np.median(np.argwhere(np.abs(picture.astype(int) - colour).max(axis=2) < 30), axis=0)[::-1]


@pytest.mark.parametrize("count", [2, 4])
def test_every_child_has_a_dot_of_its_own_colour_in_its_place(count):
    chart = family(count)[:360, :320]
    metres = np.array([PLAN.position(cell) for cell in CELLS[:count]])
    places = np.array([where(chart, colours.of_child(i)) for i in range(count)])
    pixels, along = places - places[0], (metres - metres[0]) * (1, -1)
    scale = pixels[1, 0] / along[1, 0]
    np.testing.assert_allclose(pixels, along * scale, atol=0.2 * scale * PLAN.cell_size)


def test_gauges_fill_in_proportion_to_each_childs_safety():
    def gauges(picture):
        """Pixels of the lower gauge's row, of each child's colour."""
        strip = picture[hud.strip_top(1280, 720) :, :260]
        rows = np.flatnonzero((strip == (56, 64, 78)).all(axis=2).sum(axis=1) > 10)
        return [int((strip[rows[-1]] == colours.of_child(i)).all(axis=1).sum()) for i in range(4)]

    first, second, *others = gauges(family(2))
    assert second == pytest.approx(2 * first, abs=3)
    assert first > 10
    assert others == [0, 0]
    four = gauges(family(4))
    assert four == pytest.approx([i * four[0] for i in (1, 2, 3, 4)], abs=5)

"""What the display shows of several children."""

import numpy as np
import pytest

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz import colours, hud

PLAN = FloorPlan.parse("#######\n#S...C#\n#..T..#\n#B...C#\n#######", "small")
CELLS = [(1, 2), (2, 4), (3, 3), (2, 1)]
DARK = (16, 20, 28)


def frame(width=1280, height=720):
    return np.full((height, width, 3), DARK, np.uint8)


def state(count, **changes):
    children = [
        hud.ChildState(PLAN.position(cell), safe=0.2 + 0.2 * i, damage=float(i)) for i, cell in enumerate(CELLS)
    ]
    values = {
        "family": ",".join(["0.5"] * count),
        "children": tuple(children[:count]),
        "damage": sum(child.damage for child in children[:count]),
        "danger": np.array([0.2, 0.4, 0.8]),
    }
    candles = np.array([[*PLAN.position(PLAN.tables[t]), 0.6] for t in PLAN.candle_tables])
    return hud.HudState(plan=PLAN, timestep=50, candles=candles, **values | changes)


def near(picture, colour):
    return np.abs(picture.astype(int) - colour).max(axis=2) < 30


def where(picture, colour):
    """The middle of a colour, as column and row."""
    return np.median(np.argwhere(near(picture, colour)), axis=0)[::-1]


@pytest.mark.parametrize("count", [2, 4])
def test_every_child_has_a_dot_of_its_own_colour_in_its_place(count):
    chart = hud.draw(frame(), state(count))[:360, :320]
    first = where(chart, colours.of_child(0))
    metres = np.array([PLAN.position(cell) for cell in CELLS[:count]])
    pixels = np.array([where(chart, colours.of_child(i)) for i in range(count)]) - first
    along = (metres - metres[0]) * (1, -1)
    scale = pixels[1, 0] / along[1, 0]
    np.testing.assert_allclose(pixels, along * scale, atol=0.2 * scale * PLAN.cell_size)


def gauges(picture):
    """Pixels of the lower gauge's row, of each child's colour."""
    strip = picture[hud.strip_top(1280, 720) :, :260]
    rows = np.flatnonzero((strip == (56, 64, 78)).all(axis=2).sum(axis=1) > 10)
    lower = strip[rows[-1]]
    return [int((lower == colours.of_child(i)).all(axis=1).sum()) for i in range(4)]


def test_gauges_fill_in_proportion_to_each_childs_safety():
    first, second, *others = gauges(hud.draw(frame(), state(2)))  # 0.2 and 0.4
    assert second == pytest.approx(2 * first, abs=3)
    assert first > 10
    assert others == [0, 0]
    four = gauges(hud.draw(frame(), state(4)))  # 0.2 to 0.8
    assert four == pytest.approx([i * four[0] for i in (1, 2, 3, 4)], abs=5)

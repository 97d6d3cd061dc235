"""Floor plans: what is refused and why, what loads, and what stands where."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from random_plans import plan_texts

from caregiver_mj.errors import FloorPlanError
from caregiver_mj.plans.floor_plan import FloorPlan, house_names

SMALL = """\
######
#....#
#.CS.#
#.TB.#
#T...#
######
"""


# What is wrong, the plan, where (line and column), what the message says.
MALFORMED = [
    ("empty", "\n  \n", (1, 1), "the plan must not be empty"),
    ("unknown character", "####\n#.x#\n####", (2, 3), "'x' is none of # (wall), . (free cell), S (stairwell)"),
    ("short row", "#####\n#.B\n#####", (2, 4), "the row has 3 cells, but most have 5"),
    ("blank line inside", "####\n#.B#\n\n####", (3, 1), "the row has 0 cells, but most have 4"),
    ("door in the north wall", "##.#\n#.B#\n####", (1, 3), "the border must be all wall (#), and here is a free cell"),
    ("no free cell", "####\n#BT#\n####", (1, 1), "the plan has no free cell (.)"),
    ("joined by a landing only", "#####\n#.S.#\n#B#B#\n#####", (2, 4), "this free cell is not connected to the one"),
    ("unreachable stairwell", "#####\n#.#S#\n#B###\n#####", (2, 4), "this stairwell (S) cannot be reached"),
    ("gate behind an inner wall", "######\n#B...#\n#.G..#\n#....#\n######", (3, 3), "open gate (G) has no way in"),
    ("gate behind a table", "######\n#.G.B#\n#.T..#\n#....#\n######", (2, 3), "open gate (G) has no way in"),
    ("things only", "####\n#oB#\n####", (1, 1), "the plan has no free cell"),
    ("thing in a corner", "#####\n#.B##\n###o#\n#####", (3, 4), "this free cell is not connected"),
    ("diagonal only", "#####\n#.B##\n##T##\n#####", (3, 3), "this bare table (T) cannot be reached"),
]


@pytest.mark.parametrize(
    ("text", "place", "problem"), [row[1:] for row in MALFORMED], ids=[row[0] for row in MALFORMED]
)
def test_malformed_plans_are_refused_with_line_and_column(text, place, problem):
    with pytest.raises(FloorPlanError) as error:
        FloorPlan.parse(text, "attic")
    message = str(error.value)
    assert message.startswith(f"floor plan 'attic' line {place[0]}, column {place[1]}: ")
    assert problem in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("row", "line", "problem"),
    [
        (0, "#" * 12, "line 1, column 13: the row has 12 cells, but most have 13"),
        (0, "my own house", "line 1, column 1: 'm' is none of .*, and 9 more in this line"),
        (4, "#" * 13, "is not connected to the one at line 2, column 2, nor are [0-9]+ more$"),
    ],
)
def test_one_bad_line_is_one_problem(row, line, problem):
    rows = list(FloorPlan.load("paper").rows)
    assert {len(cells) for cells in rows} == {13}
    rows[row] = line
    with pytest.raises(FloorPlanError, match=problem) as error:
        FloorPlan.parse("\n".join(rows))
    assert len(error.value.problems) == len(error.value.excerpts) == 1
    again = pickle.loads(pickle.dumps(error.value))  # as from a worker process
    assert (str(again), again.excerpts) == (str(error.value), error.value.excerpts)


def test_lines_are_counted_from_the_top_of_the_file_and_blanks_do_not_matter():
    with pytest.raises(FloorPlanError, match="line 4, column 2: 'x'"):
        FloorPlan.parse("\n\n####\n#xB#\n####\n")
    assert FloorPlan.parse("\r\n\n####  \r\n#.B#\t\r\n####\r\n\n").rows == ("####", "#.B#", "####")


def test_the_paper_house_has_the_objects_its_description_names():
    plan = FloorPlan.load("paper")
    counts = [len(objects) for objects in (plan.stairwells, plan.candle_tables, plan.tables, plan.bins)]
    assert counts == [3, 4, 8, 4]
    assert "paper" in house_names()
    assert all(FloorPlan.load(name).name == name for name in house_names())


def test_load_reads_a_file_and_calls_it_by_its_stem(tmp_path):
    file = tmp_path / "attic.txt"
    file.write_text(SMALL)
    plan = FloorPlan.load(file, cell_size=0.8)
    assert (plan.name, plan.cell_size, "\n".join(plan.rows) + "\n") == ("attic", 0.8, SMALL)


def test_a_missing_file_is_named_together_with_the_houses_there_are(tmp_path):
    with pytest.raises(FloorPlanError, match=r"no floor plan '.*nowhere.txt': neither a file nor one of .*paper"):
        FloorPlan.load(tmp_path / "nowhere.txt")


@pytest.mark.parametrize("content", [b"\xff\xfe\x00#", None], ids=["not text", "a folder"])
def test_an_unreadable_file_is_an_error_of_ours(tmp_path, content):
    path = tmp_path / "house"
    path.mkdir() if content is None else path.write_bytes(content)
    with pytest.raises(FloorPlanError, match="cannot be read" if content is None else "must be UTF-8"):
        FloorPlan.load(path)


def test_positions_are_metres_from_the_middle_east_and_north():
    plan = FloorPlan.parse("#####\n#B.T#\n#...#\n#####", cell_size=0.5)  # 4 rows, 5 columns
    # Column 3 is 1 cell east of the middle column 2; row 1 is half a cell north of the middle, 1.5 rows down.
    np.testing.assert_allclose(plan.position((1, 3)), [1 * 0.5, 0.5 * 0.5])
    np.testing.assert_allclose(plan.position((2, 1)), [-1 * 0.5, -0.5 * 0.5])


@settings(max_examples=60, deadline=None)
@given(plan_texts())
def test_random_plans_round_trip(text):
    plan = FloorPlan.parse(text)
    assert "\n".join(plan.rows) == text
    for cell in ((r, c) for r in range(plan.shape[0]) for c in range(plan.shape[1])):
        assert plan[cell] == text.splitlines()[cell[0]][cell[1]]
        assert plan.cell_at(plan.position(cell)) == cell
    kinds = {".": plan.free_cells, "S": plan.stairwells, "B": plan.bins}
    for kind, cells in kinds.items():
        assert len(cells) == text.count(kind)
    assert len(plan.tables) == text.count("C") + text.count("T")
    assert all(plan[plan.tables[i]] == "C" for i in plan.candle_tables)

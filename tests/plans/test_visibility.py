"""What is seen from where, drawn by hand, and what must hold in any house."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from caregiver_mj import FloorPlan
from caregiver_mj.plans.visibility import ALL_ROUND, Sight, lookouts, visibility

# Two rooms, a door between them, and a stairwell at the left.
HOUSE = FloorPlan.parse("############\n##....#....#\n#S.........#\n##....#...B#\n############", "two rooms")


def seen(plan, sight, cell, heading=ALL_ROUND):
    rows = [list(row.replace(".", " ")) for row in plan.rows]
    for number in np.flatnonzero(visibility(plan, Sight.of(sight)).seen[plan.cell_index[cell], heading]):
        row, column = plan.free_cells[number]
        rows[row][column] = "+"
    return ["".join(row) for row in rows]


def test_walls_hide_what_is_behind_them():
    assert seen(HOUSE, "walls", (1, 2)) == [
        "############",
        "##++++#    #",
        "#S+++++++++#",
        "##++++# ++B#",
        "############",
    ]


def test_a_camera_sees_to_where_it_is_turned():
    east, west = 1, 3
    assert seen(HOUSE, "camera", (2, 5), east)[2] == "#S   ++++++#"  # 5 m are six cells
    assert seen(HOUSE, "camera", (2, 5), west) == [
        "############",
        "##+++ #    #",
        "#S++++     #",
        "##+++ #   B#",
        "############",
    ]


def test_cameras_on_the_ceiling_hang_where_most_is_seen():
    one = visibility(HOUSE, Sight.of("rooms:1"))
    everything = visibility(HOUSE, Sight.of("walls")).seen[: len(HOUSE.free_cells), ALL_ROUND]
    assert everything[one.ceiling[0]].sum() == everything.sum(axis=1).max()
    assert visibility(HOUSE, Sight.of("rooms:9")).seen.all()


@settings(max_examples=15, deadline=None)
@given(number=st.integers(0, 10**6))
def test_what_holds_in_any_house(number):
    plan = FloorPlan.load(f"house-{number}")
    walls, camera, all_ = (visibility(plan, Sight.of(name)).seen for name in ("walls", "camera", "all"))
    free = len(plan.free_cells)
    assert all_.all()
    assert (camera <= walls).all()
    assert (camera[:, :ALL_ROUND].any(axis=1) == camera[:, ALL_ROUND]).all()  # turning round shows it all
    assert walls[np.arange(free), :, np.arange(free)].all()
    beside = plan.graph.distances_from(range(free))[:, :free] <= 1
    assert walls[:free, ALL_ROUND][beside].all()
    assert walls[list(lookouts(plan)), ALL_ROUND].any(axis=0).all() or len(lookouts(plan)) == 12

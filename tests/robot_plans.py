"""Floor plans on which the robot's room, routes and paths are tested."""

from hypothesis import strategies as st
from random_plans import plan_texts

from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan

#: Four rooms round a cross of walls, with a doorway each; the two stairwells lie beside the shortest ways.
HOUSE = FloorPlan.parse(
    """
    #########
    #B..#...#
    #.......#
    #...#..S#
    ##.###.##
    #...#...#
    #.......#
    #S..#.CT#
    #########
    """.replace(" ", ""),
    "four_rooms",
)
#: A corridor: whoever stands in it leaves no way.
CORRIDOR = FloorPlan.parse("########\n#B....T#\n####.###\n####S###\n########", "corridor")


def centre(plan: FloorPlan, cell: Cell) -> tuple[float, float]:
    return tuple(plan.position(cell).tolist())


@st.composite
def journeys(draw, landings=True):
    """A plan, and two of the cells on which the robot can stand."""
    plan = FloorPlan.parse(draw(plan_texts(6, 14)), "random")
    cells = st.sampled_from(plan.caregiver_cells if landings else plan.free_cells)
    return plan, draw(cells), draw(cells)

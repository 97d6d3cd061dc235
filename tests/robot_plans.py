"""Floor plans on which the robot's room, routes and paths are tested."""

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

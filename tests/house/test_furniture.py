"""Furniture: it says what the rooms are, and stands where nobody walks."""

import mujoco
import numpy as np
import pytest

from caregiver_mj.house.fittings import OPAQUE
from caregiver_mj.house.furniture import pieces
from caregiver_mj.house.scene import build_house
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.layout import Layout

HOUSES = ("paper", "home", "apartment", "railroad", "house-3", "courtyard")
CHILD = 0.12  # metres, the radius of a child's body
FLAT = 0.045  # metres off a wall that a child does not mind: windows, curtains, pictures
KNOWN = *pieces(), "decoration"


def furniture(plan):
    """The boxes of all furniture, (n, 6): lowest and highest x, y and z, and their names."""
    model = build_house(plan, robot=False).compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    names = [model.geom(i).name for i in range(model.ngeom)]
    which = [i for i, name in enumerate(names) if name.rpartition("_")[0].rpartition("_")[0] in KNOWN]
    which += [i for i, name in enumerate(names) if name.startswith("decoration_")]
    for i in which:
        geom = model.geom(i)
        assert geom.contype[0] == geom.conaffinity[0] == 0, names[i]
        assert geom.group[0] not in (OPAQUE, 3), names[i]  # what hides a child from the robot's eye
    signs = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
    boxes = []
    for i in which:
        centre, half = model.geom_aabb[i, :3], model.geom_aabb[i, 3:]
        corners = data.geom_xpos[i] + (centre + half * signs) @ data.geom_xmat[i].reshape(3, 3).T
        boxes.append([*corners.min(axis=0), *corners.max(axis=0)])
    return np.array(boxes), [names[i] for i in which]


def inside(boxes, rectangle):
    """Which boxes reach into a rectangle: x and y of its middle, and half of its sides, in metres."""
    x, y, half_x, half_y = rectangle
    low, high = (x - half_x, y - half_y), (x + half_x, y + half_y)
    return ((boxes[:, :2] < np.array(high) - 1e-6) & (boxes[:, 3:5] > np.array(low) + 1e-6)).all(axis=1)


@pytest.mark.parametrize("house", HOUSES)
def test_nobody_walks_into_furniture(house):
    plan = FloorPlan.load(house)
    boxes, names = furniture(plan)
    assert len(names) > 30
    stands = boxes[:, 5] > 0.02  # metres; what lies flatter is walked over
    for cell in plan.free_cells:
        x, y = plan.position(cell)
        met = inside(boxes, (x, y, plan.cell_size / 2, plan.cell_size / 2)) & stands
        assert not met.any(), [names[i] for i in np.flatnonzero(met)]
        # The lanes in which a child comes up to a wall, and turns back.
        for down, right in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            if plan.is_wall((cell[0] + down, cell[1] + right)):
                far = plan.cell_size - Layout(plan).wall_thickness / 2 - FLAT  # from the cell's middle
                middle = (x + right * far / 2, y - down * far / 2)
                half = np.array([far / 2, CHILD])[:: 1 if right else -1]
                met = inside(boxes, (*middle, *half)) & stands
                assert not met.any(), [names[i] for i in np.flatnonzero(met)]

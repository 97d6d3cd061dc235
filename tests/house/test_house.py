"""The scene of the house: it is complete, and its contacts do what they are for."""

import mujoco
import numpy as np
import pytest

from caregiver_mj import load
from caregiver_mj.house.scene import build_house
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan

SMALL = FloorPlan.parse("#####\n#B.S#\n#..C#\n#T..#\n#####", "small")
WIDE_CELLS = FloorPlan.parse("#######\n#B...C#\n#.....#\n#..S.T#\n#.....#\n#######", "wide_cells", cell_size=1.1)
PLANS = [FloorPlan.load("paper"), SMALL, WIDE_CELLS]
TODDLER_RADIUS = 0.12  # metres


class House:
    def __init__(self, plan: FloorPlan):
        self.plan = plan
        self.model = build_house(plan, robot=False).compile()
        self.data = mujoco.MjData(self.model)
        joints = [self.model.joint(f"toddler/{name}") for name in ("x", "y", "yaw")]
        self._qpos = np.array([int(joint.qposadr[0]) for joint in joints])
        self._dof = np.array([int(joint.dofadr[0]) for joint in joints])

    def step(self, toddler: np.ndarray, velocity: tuple[float, float] = (0, 0), steps: int = 1) -> set[str]:
        """Puts the toddler somewhere, (2,), steps, and returns the names of what it touched."""
        self.data.qpos[self._qpos] = [*toddler, 0]
        self.data.qvel[self._dof] = [*velocity, 0]
        touched = set()
        for _ in range(steps):
            mujoco.mj_step(self.model, self.data)
            touched |= self.touched()
        return touched

    def touched(self) -> set[str]:
        pairs = [[self.model.geom(geom).name for geom in pair] for pair in self.data.contact.geom]
        return {name for pair in pairs if "toddler/body" in pair for name in pair} - {"toddler/body"}

    @property
    def toddler_force(self) -> float:
        return float(np.abs(self.data.qfrc_constraint[self._dof]).max())

    @property
    def toddler_position(self) -> np.ndarray:
        return self.data.qpos[self._qpos[:2]]

    def candle(self, index: int):
        return self.data.body(f"candle_{index}/candle")


@pytest.fixture(scope="module", params=PLANS, ids=lambda plan: plan.name)
def house(request) -> House:
    return House(request.param)


@pytest.fixture
def paper() -> House:
    return House(PLANS[0])


def test_objects_stand_where_the_plan_says(house: House):
    plan, model, data = house.plan, house.model, house.data
    mujoco.mj_resetData(model, data)
    mujoco.mj_forward(model, data)
    for i, (x, y, half_x, half_y) in enumerate(layout.Layout(plan).tables):
        top = model.geom(f"table_{i}/top")
        assert np.allclose(data.geom(f"table_{i}/top").xpos[:2], [x, y])
        assert np.allclose(top.size[:2], [half_x, half_y])
        assert data.geom(f"table_{i}/top").xpos[2] + top.size[2] == pytest.approx(layout.TABLE_HEIGHT)
    for i, (x, y, half_x, half_y) in enumerate(layout.Layout(plan).bins):
        assert np.allclose(data.geom(f"bin_{i}/box").xpos[:2], [x, y])
        assert np.allclose(model.geom(f"bin_{i}/box").size[:2], [half_x, half_y])
    for i, table in enumerate(plan.candle_tables):
        assert np.allclose(house.candle(i).xpos, [*plan.position(plan.tables[table]), layout.TABLE_HEIGHT])
        assert house.candle(i).xmat.reshape(3, 3)[2, 2] == pytest.approx(1)
    for i, cell in enumerate(plan.stairwells):
        assert np.allclose(data.geom(f"stairwell_{i}/trigger").xpos[:2], plan.position(cell))


def test_trigger_reports_overlap_and_exerts_no_force(house: House):
    for i, cell in enumerate(house.plan.stairwells[:4]):
        centre = house.plan.position(cell)
        for direction in ((0, 1), (1, 0), (0, -1), (-1, 0)):
            for distance, expected in ((0.33, False), (0.321, False), (0.319, True), (0.2, True), (0.0, True)):
                touched = house.step(centre + distance * np.array(direction))
                trigger = f"stairwell_{i}/trigger"
                assert (trigger in touched) == expected
                if touched == {trigger}:
                    assert house.toddler_force == 0.0


def test_tables_and_walls_stop_the_toddler(paper: House):
    table, bin_ = paper.plan.tables[1], paper.plan.bins[0]
    paper_wall = paper.plan.position((4, 5)) - np.array([0, 0.625])  # the face of the wall south of a free cell
    for face, direction, name in (
        (paper.plan.position(table) - np.array([layout.TABLE_HALF_SIZE, 0]), (1, 0), "table_1/top"),
        (paper.plan.position(bin_) + np.array([layout.BIN_HALF_SIZE, 0]), (-1, 0), "bin_0/box"),
        (paper_wall, (0, -1), "wall_"),
    ):
        direction = np.array(direction)
        start = face - (TODDLER_RADIUS + 0.02) * direction
        touched = paper.step(start, 0.4 * direction, steps=20)
        assert any(other.startswith(name) for other in touched), name
        # It may dent a face that stops it by a few millimetres, no more.
        assert (paper.toddler_position - face) @ direction < -TODDLER_RADIUS + 0.004


def test_a_child_gets_to_its_toys_in_the_largest_cells_that_a_plan_may_have():
    env = load("supervise", WIDE_CELLS, 0.0, 0, {"robot": False, "time_limit": 30.0}, visuals=False)
    env.reset()
    while not env.step(()).last():
        pass
    assert env.task.outcome()["toys_reached"] > 0


def test_toddler_pushes_a_candle_over_and_the_floor_catches_it(paper: House):
    far = paper.plan.position(paper.plan.free_cells[-1])
    spot = paper.plan.position(paper.plan.free_cells[0])
    joint = paper.model.joint("candle_0/joint")
    paper.data.qpos[joint.qposadr[0] : joint.qposadr[0] + 3] = [*spot, 0.3]
    paper.step(far, steps=400)
    assert paper.candle(0).xpos[2] == pytest.approx(0, abs=1e-3)
    assert paper.candle(0).xmat.reshape(3, 3)[2, 2] > 0.999
    touched = set()
    for k in range(30):
        touched |= paper.step(spot - np.array([0.3 - 0.01 * k, 0]), (0.5, 0), steps=4)
    assert touched == {"candle_0/wax"}
    assert paper.candle(0).xmat.reshape(3, 3)[2, 2] < 0.5  # it lies
    assert paper.candle(0).xpos[2] < 0.03
    assert not paper.data.warning.number.any()

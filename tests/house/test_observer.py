"""What a robot's eye sees in the physical house, what is in its way, and what observations show of the rest."""

import numpy as np
import pytest

from caregiver_mj import FloorPlan, load
from caregiver_mj.house.observer import Observer, RobotEyes
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.rendering import engine
from caregiver_mj.plans.visibility import Sight
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.reach import reach_path
from caregiver_mj.viz.cameras import Camera

# The middle of its cell (3, 5) is the house's origin. The table's is (-1.5, 0).
ROOMS = FloorPlan.parse(
    """
#####################
#.........#.........#
#.........#.........#
#.......T.....C.....#
#.........#.........#
#........B#.........#
#####################
""",
    "rooms",
)
TABLE = (-1.5, 0.0)
ROBOT = find_embodiment()


def house(**options):
    return Physics.from_plan(ROOMS, visuals=False, **options)


def sees(physics, child, base, sight="walls", arm=None):
    """Whether a child at (x, y) is seen by a robot at (x, y, yaw)."""
    with physics.reset_context():
        physics.set_robot(np.array(base), arm)
        physics.named.data.qpos[["toddler/x", "toddler/y"]] = child
    seen, _, cells = RobotEyes(ROOMS, Sight.of(sight)).look(physics)
    if cells[ROOMS.cell_index[ROOMS.cell_at(np.array(child))]].all():  # then it is seen wherever in the cell it is
        assert seen[0]
    return bool(seen[0])


def test_a_camera_sees_ahead_of_the_base_and_five_metres_far():
    physics = house()
    for yaw in (0.0, 2.0, -2.5):
        ahead = np.array([np.cos(yaw), np.sin(yaw)])
        aside = np.array([-ahead[1], ahead[0]])
        for share, seen in ((0.5, True), (0.7, True), (1.5, False), (-1.0, False)):  # tangents of the angle
            place = ahead + share * aside if share > 0 else -ahead
            assert sees(physics, (-4.5, 0.0) + 0.8 * place, (-4.5, 0.0, yaw), "camera") == seen
            assert sees(physics, (-4.5, 0.0) + 0.8 * place, (-4.5, 0.0, yaw), "walls")
    # From the door along the right room; the eye is .05 m ahead of the base's middle.
    assert sees(physics, (4.9, 0.75), (0.0, 0.0, 0.0), "camera")
    assert not sees(physics, (5.2, 0.75), (0.0, 0.0, 0.0), "camera")
    assert sees(physics, (5.2, 0.75), (0.0, 0.0, 0.0), "walls")


def test_the_eye_sees_no_child_over_a_wall_as_it_would_where_walls_are_cut_low():
    physics, frames, renders, pictures = Physics.from_plan(ROOMS), [], [], []
    for child in ((4.0, 1.5), (-4.0, 1.5)):  # in the other room, five metres ahead; and behind the robot
        with physics.reset_context():
            physics.set_robot(np.array((-1.0, 1.5, 0.0)))
            physics.named.data.qpos[["toddler/x", "toddler/y"]] = child
        frames.append(physics.frames(overview=False)["eye"])
        renders += [physics.render(camera_id="eye"), physics.render(camera_id=physics.camera_names().index("eye"))]
        renders.append(Camera(physics, "eye", 320, 240, shadows=True).render())
        pictures.append(engine.Camera(physics, camera_id="eye").render())
    np.testing.assert_array_equal(*frames)
    for picture in renders:
        np.testing.assert_array_equal(picture, frames[0])
    assert (pictures[0] != pictures[1]).any()


@pytest.mark.parametrize(("side", "shadows"), [(84, False), (256, True)])
def test_small_pictures_have_shadows_only_if_asked(side, shadows):
    physics = Physics.from_plan(ROOMS)

    def picture(**options):
        return physics.render(side, side, "overview", **options)

    usual, with_them, without = picture(), *(picture(render_flag_overrides={"shadow": on}) for on in (True, False))
    np.testing.assert_array_equal(usual, with_them if shadows else without)
    assert (with_them != without).any()


@pytest.mark.parametrize("height", [0.45, 0.60, 0.75])
def test_a_child_behind_a_table_is_seen_over_its_board_or_between_its_legs(height):
    physics = house(table_heights=np.full(len(ROOMS.tables), height))
    assert sees(physics, (TABLE[0] + 0.40, 0.0), (-3.5, 0.0, 0.0))


def test_the_arm_hides_a_child_when_it_reaches_out_across_the_line_of_sight():
    physics, path = house(), reach_path(arm_of(ROBOT), 6800)
    base, child = np.array([-4.0, 0.5, 0.0]), (-3.2, -0.5)
    for sight in ("walls", "camera"):
        nearer = child if sight == "walls" else (-3.2, -0.1)
        assert sees(physics, nearer, base, sight, path.joints(0.0))
        assert not sees(physics, nearer, base, sight, path.joints(1.0))


def test_a_child_behind_the_robot_is_felt_when_it_runs_into_it():
    env = load("supervise", ROOMS, "seeker:0", random=0, task_kwargs={"sight": "camera"})
    env.reset()
    eyes, felt = RobotEyes(ROOMS, env.task.observer.sight), 0
    while env.physics.time() < 60.0 and felt < 3:
        child, robot = env.physics.toddler_position(), env.physics.base_position()
        # It always has its back to the child.
        robot[2] = np.arctan2(*(robot[:2] - child[:2])[::-1])
        env.physics.set_robot(robot)
        timestep = env.step(np.append(np.zeros(3), env.physics.data.ctrl[3:11]))
        touched = any(touch.kind == "robot" for touch in env.physics.touches)
        if touched and not eyes.look(env.physics)[0][0]:
            felt += 1
            assert timestep.observation["toddler_seen"] == [1.0]
            assert timestep.observation["toddler_position"] == pytest.approx(env.physics.toddler_position())
    assert felt == 3


def test_a_gate_is_as_it_was_seen_last():
    plan = FloorPlan.parse(
        "###########\n#....#....#\n#....#....#\n#.........#\n#..B.#....#\n#.T..#..G##\n###########", "gated"
    )
    env = load("supervise", plan, random=0, task_kwargs={"sight": "walls"})
    env.reset()
    still = np.append(np.zeros(3), env.physics.data.ctrl[3:11])

    def shown(cell):
        env.physics.set_robot(np.array([*plan.position(cell), 0.0]))
        for _ in range(5):  # as often as it looks
            timestep = env.step(still)
        return timestep.observation["gate_position"][0], env.physics.gate_positions()[0]

    seen, is_so = shown((3, 7))
    assert seen == is_so > 1.0
    shown((5, 1))
    env.physics.set_gates(0.3)
    seen, is_so = shown((5, 1))
    assert seen > 1.0 > is_so  # nobody has told it
    seen, is_so = shown((3, 7))
    assert seen == is_so < 1.0


WEST, EAST = (1, 1), (1, 15)  # cells in either room that no door leads the view to


@pytest.fixture(scope="module")
def physics():
    return house()


def place(physics, child):
    with physics.reset_context():
        physics.set_robot(np.array([*ROOMS.position(WEST), 0.0]))
        physics.named.data.qpos[["toddler/x", "toddler/y"]] = ROOMS.position(child)


@pytest.mark.parametrize(("sight", "child", "seen"), [("all", EAST, 1), ("walls", EAST, 0), ("walls", (1, 3), 1)])
def test_of_a_child_out_of_sight_nothing_is_shown(physics, sight, child, seen):
    place(physics, child)
    observer = Observer(ROOMS, 1, np.zeros((2, 5)), 0.02, sight=sight)
    observer.reset(physics, 0)
    found = observer.observe(physics, 0)
    assert found["toddler_position"][:2] == pytest.approx(seen * ROOMS.position(child))
    assert found.get("toddler_seen", [1.0]) == [seen]


@pytest.mark.parametrize(("sight", "follows"), [("all", True), ("walls", False)])
def test_a_candle_out_of_sight_is_where_it_was_at_first(physics, sight, follows):
    place(physics, EAST)
    at_first, later = np.array([*ROOMS.position((3, 14)), 0.6]), np.array([*ROOMS.position((1, 13)), 0.0])
    observer = Observer(ROOMS, 1, np.zeros((2, 5)), 0.02, sight=sight)
    physics.set_candle(0, at_first, 0.0)
    observer.reset(physics, 0)
    observer.observe(physics, 0)
    physics.set_candle(0, later, 0.0)
    observer.take_in(physics, 5)
    shown = observer.observe(physics, 5)["candle_position"][0]
    assert shown == pytest.approx(later if follows else at_first)

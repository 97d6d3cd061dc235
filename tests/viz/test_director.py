"""The camera that tells the story: the whole house is in the picture, and those whom a moment is about."""

import dataclasses
import itertools
from unittest import mock

import mujoco
import numpy as np
import pytest

from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.house.rendering import engine
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import Where
from caregiver_mj.viz import director
from caregiver_mj.viz.cameras import FOVY, Camera, StillCamera
from caregiver_mj.viz.episode import Episode
from caregiver_mj.viz.moment import ChildState, HudState

PLAN = FloorPlan.load("paper")
NOTHING_THERE = np.empty((0, 2, 3))


def pixels(pose, points, width, height):
    """Where points (n, 3) are in a picture, (n, 2): by the vectors of a camera that looks north, written out."""
    down = pose.elevation
    ahead = np.array([0.0, np.cos(down), -np.sin(down)])
    up = np.array([0.0, np.sin(down), np.cos(down)])
    offset = points - (np.array(pose.place) - pose.distance * ahead)
    scale = height / 2 / np.tan(np.radians(FOVY) / 2) / (offset @ ahead)
    return np.stack([width / 2 + scale * offset[:, 0], height / 2 - scale * (offset @ up)], axis=1)


@pytest.mark.parametrize("house", ["paper", "railroad", "house-3", "courtyard", "terrace", "hall-3"])
@pytest.mark.parametrize(("width", "height"), [(1280, 592), (640, 282)])
def test_the_house_fills_the_picture_but_for_a_column_or_a_row(house, width, height):
    plan = FloorPlan.load(house)
    pose, column, row = director.overview(plan, width, height)
    assert (row > 0) == (house in ("railroad", "hall-3"))
    assert (column > 0) == (row == 0)
    height -= row
    half_y, half_x = np.array(plan.shape) * plan.cell_size / 2
    corners = np.array([*itertools.product((-half_x, half_x), (-half_y, half_y), (0.0, 0.9))])
    seen = pixels(pose, corners, width, height)
    assert seen.min() >= 0
    assert seen[:, 0].max() <= width - column + 1e-6
    assert seen[:, 1].max() <= height
    assert (np.ptp(seen, axis=0) / (width - column, height)).max() > 0.85  # there is little lawn


def moment(children=((0.0, 0.0),), **fields):
    basis = HudState(
        plan=PLAN,
        timestep=1,
        family="0.5",
        children=tuple(ChildState(np.array(place)) for place in children),
        candles=np.array([PLAN.position(PLAN.tables[t]) for t in PLAN.candle_tables]),
    )
    return dataclasses.replace(basis, **fields)


def test_a_close_shot_holds_the_child_the_robot_and_the_hazard():
    stairs = PLAN.position(PLAN.stairwells[0])  # hazard 0
    x, y = stairs
    child, robot, gone = np.array([x + 1.0, y - 0.5]), np.array([x - 1.0, y - 1.5, 0.3]), np.array([x, y - 6.0, 0.0])
    shot = director.CloseShot(1.2, 10.0, NOTHING_THERE)
    pose = shot.follow(moment((child,), robot=robot, target=0))
    points = np.array([[*place, z] for place in (child, robot[:2], stairs) for z in (0.0, 1.0)])
    seen = pixels(pose, points, 240, 200)
    assert (seen > 0).all()
    assert (seen < (240, 200)).all()
    aside = director.CloseShot(2.0, 10.0, NOTHING_THERE, 0.25).follow(moment((child,), robot=robot, target=0))
    seen = pixels(aside, points, 400, 200)
    assert ((seen > 0) & (seen < (300, 200))).all()
    # A robot in another part of the house is left out: the child is larger then, once the camera has followed.
    for _ in range(50):
        far = shot.follow(moment((child,), robot=gone, target=0))
    assert far.distance < pose.distance
    # The hazard that the robot goes to is there before the child is, which is 3.3 m away.
    early = moment(((x + 2.5, y - 2.2),), robot=np.array([x + 3.5, y - 2.2, 0.0]), target=0)
    seen = pixels(director.CloseShot(1.2, 10.0, NOTHING_THERE).follow(early), np.array([[*stairs, 0.0]]), 240, 200)
    assert ((seen > 0) & (seen < (240, 200))).all()


def test_the_hand_is_in_its_shot_from_one_side():
    candle, table = PLAN.hazards.number(Where.ON_TABLE, 0), PLAN.position(PLAN.tables[PLAN.candle_tables[0]])
    places = np.array([[*PLAN.position(PLAN.tables[t]), 0.5] for t in PLAN.candle_tables])
    robot = np.array([table[0], table[1] - 0.7, 0.0])  # it reaches to the north
    works = moment(candles=places, target=candle, robot=robot)
    hand = mock.Mock(
        **{"pinch_position.return_value": places[0] + (0.0, 0.0, 0.1), "base_velocity.return_value": np.zeros(3)}
    )
    shot = director.HandShot(1.2, 10.0, NOTHING_THERE)
    assert shot.follow(moment(candles=places, robot=robot), hand) is None
    pose = shot.follow(works, hand)
    ahead = np.array([np.cos(pose.azimuth), np.sin(pose.azimuth)])
    assert abs(ahead[1]) < 0.3  # neither from behind the robot nor against it
    np.testing.assert_allclose(pose.place, places[0] + (0.0, 0.0, 0.1))
    # A board between hand and camera sends the camera to the other side.
    board = np.array([table - 0.3 * ahead - 0.05, table - 0.3 * ahead + 0.05])
    boards = np.pad(board, ((0, 0), (0, 1)), constant_values=((0, 0), (0, 2.0)))[None]
    boards[0, 0, 2] = 0.0
    other = director.HandShot(1.2, 10.0, boards).follow(works, hand)
    assert np.cos(other.azimuth) * ahead[0] < 0
    # A robot that waits with the candle, away from all tables, tells nothing.
    carried = places + np.array([1.0, 0.0, 0.2])
    assert min(np.linalg.norm(PLAN.position(table) - carried[0, :2]) for table in PLAN.tables) > 0.6
    hand.pinch_position.return_value = carried[0]
    assert shot.follow(moment(candles=carried, target=candle, robot=robot), hand) is None


def test_no_wall_hides_a_child_right_behind_it(episode):
    """By MuJoCo's own rays, towards walls and furniture alone, from both of a child's sides."""
    physics = episode.env.physics
    model, data, boxes = physics.model.ptr, physics.data.ptr, director.screens(physics)

    def is_hidden(point, pose):
        ray = np.array(pose.place) - pose.distance * pose.axes[:, 2] - point
        return 0 <= mujoco.mj_ray(model, data, point, ray, np.array([1, 1, 1, 0, 0, 0], np.uint8), 1, -1, geom) < 1

    geom, usual, found = np.zeros(1, np.int32), [], []
    south_of = {cell for cell in PLAN.free_cells if (cell[0] + 1, cell[1]) not in PLAN.cell_index}
    for cell in sorted(south_of - {(int(row), int(column)) for row, column in PLAN.stairwells}):
        x, y = PLAN.position(cell)
        state = moment(((x, y - 0.3),), candles=np.full((4, 3), 50.0))  # no candle is near
        pose = director.CloseShot(1.2, 10.0, boxes).follow(state)
        sides = [np.array([x + side, y - 0.3, 0.2]) for side in (-0.12, 0.12)]
        found += [is_hidden(side, pose) for side in sides]
        usual += [is_hidden(side, director.close_pose(np.array([[x, y - 0.3]]), 1.2)) for side in sides]
    assert sum(usual) > 5
    assert not any(found)


@pytest.fixture(scope="module")
def episode():
    return Episode(EpisodeSpec("paper", 0.5, "expected-danger", seed=0))


def test_what_a_camera_anywhere_leaves_out_is_not_missed(episode):
    physics = episode.env.physics
    pose = director.CloseShot(1.0, 10.0, director.screens(physics)).follow(episode.hud_state(1))
    fovy = physics.model.vis.global_.fovy
    picture = Camera(physics, pose, 320, 240).render()
    assert physics.model.vis.global_.fovy == fovy
    whole = engine.MovableCamera(physics, 240, 320)
    whole.set_pose(pose.place, pose.distance, 90.0, -np.degrees(pose.elevation))
    physics.model.vis.global_.fovy = FOVY
    drawn = whole.render(render_flag_overrides={"shadow": False})
    physics.model.vis.global_.fovy = fovy
    assert (picture != drawn).any(axis=2).sum() < 20  # rounding at the edges of shapes
    assert picture.std() > 10


def test_a_camera_knows_where_a_point_is_in_its_picture(episode):
    pose = director.close_pose(np.array([[1.0, 0.5]]), 1.0)
    camera = Camera(episode.env.physics, pose, 320, 240)
    (expected,) = pixels(pose, np.array([[1.3, 0.2, 0.4]]), 320, 240)
    np.testing.assert_allclose(camera.pixel((1.3, 0.2, 0.4)), expected)
    assert camera.pixel((1.0, 20.0, 0.0)) is None
    assert camera.pixel((1.0, -20.0, 0.0)) is None  # behind it


def test_redrawn_part_equals_the_whole_picture_drawn_anew():
    episode = Episode(EpisodeSpec("paper", 1.0, "none"))
    size = {"height": 240, "width": 480}
    still = StillCamera(episode.env.physics, "overview", **size)
    for second in range(1, 12):
        assert episode.run_until(second)
        picture, whole = still.render(), engine.Camera(episode.env.physics, **size, camera_id="overview").render()
        assert (picture != whole).any(axis=2).sum() < 20  # rounding at the edges of shapes

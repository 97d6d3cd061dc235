"""What films lay over the floor: where children may be soon, and what may hurt them."""

import numpy as np
import pytest
from test_hud import PLAN, changed

from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.tasks import load
from caregiver_mj.viz import colours, hud
from caregiver_mj.viz.cameras import TileLayer
from caregiver_mj.viz.episode import Episode
from caregiver_mj.viz.film import Picture, Studio
from caregiver_mj.viz.moment import LEAST, Forecast, Tile

FREE = len(PLAN.free_cells)


def forecast(presence=None, harm=(0.0, 0.0, 0.0), goal=(1.0,)):
    """A forecast in `test_hud.PLAN`, of the probability of some cells, of as many children as that has rows."""
    rows = presence or [{}]
    of_cells = np.zeros((len(rows), FREE))
    for row, cells in zip(of_cells, rows, strict=True):
        for cell, probability in cells.items():
            row[cell] = probability
    return Forecast(of_cells, np.array(harm), np.tile(goal, (len(rows), 1)), np.full(len(rows), 0.5))


def test_tiles_lie_where_children_may_be():
    tiles = forecast([{3: 0.25, 4: LEAST / 2}, {3: 0.04, 5: 1.0}]).tiles(PLAN, np.zeros((2, 3)))
    assert [tile.centre for tile in tiles] == [tuple(PLAN.position(PLAN.free_cells[cell])) for cell in (3, 5)]
    assert [tile.colour for tile in tiles] == [colours.of_child(0), colours.of_child(1)]  # whoever is more probable
    assert tiles[0].opacity == pytest.approx(tiles[1].opacity / 2)  # the root of a fourth


@pytest.fixture(scope="module")
def physics(house):
    env = load("supervise", house=house, task_kwargs={"robot": False})
    env.reset()
    env.physics.model.vis.global_.offwidth = 320
    env.physics.model.vis.global_.offheight = 240
    return env.physics, env.task.plan


def test_tiles_blend_and_are_hidden(physics):
    physics, plan = physics
    layer = TileLayer(physics, "overview", 320, 240)
    half = plan.cell_size / 2

    def laid(cell, height=0.01):
        picture = np.full((240, 320, 3), 100, np.uint8)
        layer.lay(picture, [Tile(tuple(plan.position(cell)), half, height, (200, 0, 100), 0.25)])
        seen = (picture != 100).any(axis=2)
        assert (picture[seen] == (125, 75, 100)).all()
        return seen.sum()

    open_floor, under_a_table = laid((2, 3)), laid((3, 5))
    assert 0 < under_a_table < 0.7 * open_floor
    assert laid((2, 3), height=0.8) > 1.3 * open_floor
    blank = np.zeros((240, 320, 3), np.uint8)
    layer.lay(blank, [])
    assert not blank.any()


def test_a_film_shows_what_the_caregiver_believes(house):
    def picture(foresees):
        episode = Episode(EpisodeSpec(house, caregiver="foresight", seed=3), foresees)
        assert episode.run_until(4.0)
        return episode, Studio(episode, Picture(480, 360), 10).frame()

    (_, plain), (episode, shown) = picture(False), picture(True)
    assert changed(plain, shown)[: hud.strip_top(480, 360), 480 // 3 :].sum() > 500
    np.testing.assert_array_equal(plain[hud.strip_top(480, 360) :], shown[hud.strip_top(480, 360) :])
    found = episode.forecast
    assert found is episode.forecast  # made once for every look
    reach = episode.policy.assessment.reach[0, 0]
    np.testing.assert_allclose(found.harm, reach)
    assert found.presence.shape == (1, len(episode.env.task.plan.free_cells))
    assert found.goal.shape == (1, len(episode.env.task.plan.bins))
    assert 0.5 < found.goal.sum() < 1.0  # what is left wants no toy
    assert 0.05 <= found.epsilon[0] <= 1.0

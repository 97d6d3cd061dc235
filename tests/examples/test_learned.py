"""The learned caregiver: its options and features in a small house by hand, and its network."""

import learned_caregiver
import numpy as np
import pytest
from learned_caregiver import LearnedCaregiver, layers

from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.children.tape import Tape
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.interventions.verb import BLOCK, DO_NOTHING, RELOCATE, STAND_ASIDE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

# As in test_caregiver: cells 0 to 4, the landing is cell 5. Tables: 0 bare, 1 with the candle, 2 bare.
CORRIDOR = FloorPlan.parse("#########\n#S.....B#\n##T#C#T##\n#########")


def see(child, caregiver, table=1, **others):
    one = np.array
    return Percept(
        one([[child]]), one([[child]]), one([[NOTHING]]), one([caregiver]), one([[table]]), one([-1]), **others
    )


def test_options_by_hand():
    caregiver = LearnedCaregiver(CORRIDOR)
    assert caregiver.hazard.tolist() == [0, 1, 1, 1, NOTHING, NOTHING]
    assert caregiver.table.tolist() == [NOTHING, 0, 1, 2, NOTHING, NOTHING]
    orders = caregiver.take(np.array([0, 3, 4, 5]))
    assert orders.verb.tolist() == [BLOCK, RELOCATE, STAND_ASIDE, DO_NOTHING]
    assert orders.destination.tolist() == [NOTHING, 2, NOTHING, NOTHING]
    # Beside table 2 the child would come to more harm by a candle there; table 1 is where it is.
    _, there = caregiver.features(see(4, 0))
    assert there.tolist() == [[True, True, False, False, True, True]]
    _, there = caregiver.features(see(4, 0, out_of_reach=np.array([[True, False]]), shut=np.array([[True]])))
    assert there.tolist() == [[False, True, False, False, True, True]]


def test_what_a_child_may_do_while_the_caregiver_stands_in_its_way_by_hand():
    # All moves are random: from cell 0 one in four falls. Whoever stands on the landing prevents that; in cell 1 it
    # keeps the child beside the stairwell, and in cell 4 it does nothing in three moves.
    standing = learned_caregiver._standing(CORRIDOR)[:, 0, 0].reshape(6, -1, 4)[:, -1, 0]  # of the stairwell
    assert standing[5] == 0.0
    assert standing[1] == pytest.approx(3 / 4)  # it is beside it all the time, for three moves
    # Alone it is in cell 0 still after a move with 3/4, after two with 3/4 3/4 + 1/4 1/4.
    assert standing[4] == pytest.approx((1 + 3 / 4 + 10 / 16) / 4)


def test_the_network_by_hand():
    net = {"mean": np.array([1.0]), "spread": np.array([2.0]), "w1": np.eye(1), "b1": np.zeros(1)}
    net |= {"w2": np.eye(1), "u2": 10 * np.eye(1), "b2": np.zeros(1), "w3": np.ones(1)}
    # (3 - 1) / 2 = 1 and (5 - 1) / 2 = 2, on an average 1.5; -1 is cut off by the rectifier, and 99 at 6.
    assert layers(net, np.array([[3.0], [5.0], [-1.0], [99.0]]), np.array([2, 2]))[-1].tolist() == [16, 17, 30, 36]


@pytest.mark.parametrize(("name", "children"), [("paper", 1), ("home-500001", 2)])
def test_an_episode_does_not_depend_on_its_batch(name, children):
    plan = FloorPlan.load(name)
    families = [Tape.draw_family(np.random.RandomState(seed), children) for seed in range(4)]
    run = lambda some: GridWorld(plan, [0.5] * children, LearnedCaregiver(plan)).run(some).damage  # noqa: E731
    assert (run(families) == np.concatenate([run([family]) for family in families])).all()


def test_a_house_too_large_for_what_it_would_keep_them_from_does_without(monkeypatch):
    monkeypatch.setattr(learned_caregiver, "_LARGEST", 10)
    learned_caregiver._standing.cache_clear()
    features, _ = LearnedCaregiver(CORRIDOR).features(see(0, 1))
    learned_caregiver._standing.cache_clear()
    assert np.isfinite(features).all()

"""The action prior that is carried from house to house, by hand."""

import numpy as np
import pytest

from caregiver_mj.danger.safety import CONTEXTS, SECTORS, carried_prior, context, context_counts, sector

NORTH, EAST, SOUTH, WEST = range(4)
FREE, WALL, STAIRWELL, TABLE, BIN = range(5)


def counts(around, goal_sector, action, hyperprior=1.0):
    return context_counts(np.array([around]), np.array([goal_sector]), np.array([action]), hyperprior)


def at(alpha, around, goal_sector):
    return alpha[context(np.array(around), np.array(goal_sector))].tolist()


def test_sectors_go_clockwise_from_north_by_signs():
    down = np.array([-3, -1, 0, 2, 1, 7, 0, -9])
    right = np.array([0, 5, 4, 1, 0, -1, -2, -1])
    assert sector(down, right).tolist() == list(range(SECTORS))


def test_contexts_are_all_different():
    around = np.stack(np.meshgrid(*[np.arange(5)] * 4, indexing="ij"), axis=-1).reshape(-1, 1, 4)
    found = context(around, np.arange(SECTORS))
    assert np.array_equal(np.unique(found), np.arange(CONTEXTS))


def test_a_move_counts_where_it_was_made():
    # East to a bin straight in the east, between walls. It is its own mirror image, upside down: so it counts twice.
    alpha = counts((WALL, BIN, WALL, FREE), 2, EAST)
    assert at(alpha, (WALL, BIN, WALL, FREE), 2) == [1, 3, 1, 1]
    assert at(alpha, (WALL, BIN, WALL, FREE), 1) == [1, 1, 1, 1]


def test_it_counts_in_a_house_that_is_turned_or_mirrored_too():
    alpha = counts((WALL, FREE, TABLE, STAIRWELL), 1, EAST)  # the goal to the upper right
    # Turned by a quarter clockwise: what was north is east, and the goal is to the lower right.
    assert at(alpha, (STAIRWELL, WALL, FREE, TABLE), 3) == [1, 1, 2, 1]
    # Mirrored: what was east is west, and the goal is to the upper left.
    assert at(alpha, (WALL, STAIRWELL, TABLE, FREE), 7) == [1, 1, 1, 2]
    assert alpha.sum() == 4 * CONTEXTS + 8


@pytest.mark.parametrize("hyperprior", [0.0, -1.0, float("nan")])
def test_the_hyperprior_must_be_positive(hyperprior):
    with pytest.raises(ValueError, match="hyperprior must be positive"):
        counts((FREE,) * 4, 0, NORTH, hyperprior)


def test_goals_are_equally_probable():
    theta = np.full((CONTEXTS, 4), 0.25)
    theta[7], theta[9] = [1, 0, 0, 0], [0, 0, 0.5, 0.5]
    assert carried_prior(theta, np.array([[7, 9], [7, 7]])).tolist() == [[0.5, 0, 0.25, 0.25], [1, 0, 0, 0]]

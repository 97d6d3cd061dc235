"""How long the caregiver is on its way while a child walks about in it, and what befalls the child meanwhile."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.sparse import csr_array

from caregiver_mj.caregivers.foresight.travel import Travel
from caregiver_mj.danger.chain import ChildChain

_MOVES = 30  # of a child, after which the caregiver is thought to have arrived anyway
_TYPICAL = 0.5  # epsilon of the child round which it fetches candles


class Transit:
    """Expectations for every state of a child that is about to move and every cell of the caregiver on its way.

    Attributes:
        to_post: Moves of the child until the caregiver is in each post, rounded, (posts, cells, G E, cells of it).
        cost: Damage of open stairwells meanwhile and the price of moves that the child is denied, discounted, likewise.
        to_get: Moves of the child until the caregiver has got the candle from each table, rounded, by the child's cell,
            (tables, cells, cells of it).
        denied: Price of the moves that the child is denied meanwhile, (tables, cells, G, cells of it).
    """

    def __init__(self, chain: ChildChain, ways: Travel, damage: np.ndarray, discount: float, price: float):
        """Works them out.

        Args:
            chain: How the child moves.
            ways: How the caregiver does.
            damage: Expected damage of the next move if all stairwells are open, (states,).
            discount: Of damage, a timestep.
            price: Of a move into a free cell that the caregiver denies the child, in damage.
        """
        posts, tables = len(ways.posts), ways.step.shape[2] - len(ways.posts)
        cells = chain.shape[0]
        ones, sure = np.ones((chain.size, 1), np.float32), single(chain.transition)
        later, costs = single(discount * chain.transition), damage[:, None] + _denied(chain, ways, price)
        shape = posts, cells, chain.size // cells, ways.done + 1
        self.to_post, self.cost = np.zeros(shape, np.int8), np.zeros(shape, np.float32)
        for post, cell in enumerate(ways.posts):
            step = [(share, after[:, post]) for share, after in ways.in_a_timestep()]
            self.to_post[post] = np.round(_until(sure, ones, step, cell))
            self.cost[post] = _until(later, costs, step, cell)
        typical = dataclasses.replace(chain, epsilons=np.array([_TYPICAL]))
        sure, ones = single(typical.transition), np.ones((typical.size, 1), np.float32)
        later, costs = single(discount * typical.transition), _denied(typical, ways, price)
        self.to_get = np.zeros((tables, cells, ways.done + 1), np.int8)
        self.denied = np.zeros((tables, cells, chain.shape[1], ways.done + 1), np.float32)
        for table in range(tables):
            step = [(share, after[:, posts + table]) for share, after in ways.in_a_timestep()]
            self.to_get[table] = np.round(_until(sure, ones, step, ways.done).mean(axis=1))
            self.denied[table] = _until(later, costs, step, ways.done)


def _denied(chain: ChildChain, ways: Travel, price: float) -> np.ndarray:
    """Price of the next move from each state if the caregiver is in each cell, (states, cells of it)."""
    denied = np.zeros((chain.size, ways.done + 1), np.float32)
    denied[:, : chain.shape[0]] = price * chain.enters.toarray()
    return denied


def _until(transition: csr_array, cost: np.ndarray, step: list[tuple[float, np.ndarray]], end: int) -> np.ndarray:
    """Expected sum of a cost of the child's moves until the caregiver is in a cell.

    Args:
        transition: Of the child, (states, states), discounted or not.
        cost: Of a move from each state while the caregiver is in each cell, (states, cells), or (states, 1).
        step: Where the caregiver may be after each of its turns, (children's cells, cells), and with what probability.
        end: The cell in which it has arrived.

    Returns:
        Array (children's cells, states of a cell, cells).
    """
    cells, places = step[0][1].shape
    turns = [(share, after[:, None].astype(int)) for share, after in step]
    total = np.zeros((cells, len(cost) // cells, places), np.float32)
    arrived = np.arange(places) == end
    for _ in range(_MOVES):
        parts = (np.float32(share) * np.take_along_axis(total, index, axis=2) for share, index in turns)
        after = np.asarray(sum(parts))
        total = (cost + transition @ after.reshape(len(cost), places)).reshape(total.shape)
        total[..., arrived] = 0.0
    return total


def single(matrix: csr_array) -> csr_array:
    """The same in single precision, which is precise enough and takes half the time."""
    return csr_array((matrix.data.astype(np.float32), matrix.indices.astype(np.int32), matrix.indptr.astype(np.int32)))

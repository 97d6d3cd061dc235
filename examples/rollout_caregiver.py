r"""A caregiver that searches, to start from for a planner of your own: the grid is its simulator.

    PYTHONPATH=examples caregiver-mj evaluate --world grid --sight walls --house house-20 --epsilon .5 \
        --episodes 2 --caregiver foresight rollout_caregiver:RolloutCaregiver

It is a rollout algorithm (Tesauro and Galperin 1997). At the beginning of each timestep the options that `foresight`
thinks best are simulated, from cells, goals and epsilons drawn from what it believes: the option for a timestep, then
`foresight` with its own eyes for some more, then what that expects. That is a step of policy improvement in which it
counts what will be seen, where QMDP takes all for known after the next move. It takes a hundred times as long.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.caregivers.foresight.options import Options
from caregiver_mj.caregivers.foresight.value_table import OBJECTIVE, costs
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.children.novice import Novice
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.danger.child_model import child_chain
from caregiver_mj.errors import CaregiverError
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.hazards import NOTHING

OTHERS, SCENARIOS, AHEAD = 4, 16, 5  # how many other options are simulated, how often each, and for how many timesteps
SURE = 1.5  # standard errors by which another option must be better than that of `foresight`
_FAR = 1e6  # damage of what cannot be done, and more


class RolloutCaregiver(ForesightCaregiver):
    """At the beginning of a timestep it does what a simulation finds better than what `foresight` would do.

    It is for the grid, for an only child, and for houses of stairwells, candles and tables.

    Attributes:
        world: Its simulator.
        decisions: How often it has searched in each world, (B,).
        others: How often it has then done something else than `foresight`, (B,).
    """

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        plan = self.plan
        if children > 1 or plan.floor_cells or len(plan.stairwells) > len(plan.landings):
            raise CaregiverError("a searching caregiver must have an only child, and no gates or things on the floor")
        super().reset(batch, seeds, children)
        self._random = [np.random.default_rng(seed) for seed in (range(batch) if seeds is None else seeds)]
        self._child, self._ahead = Novices(plan, 0.0), Committed(plan)
        self.world = GridWorld(plan, ChildGroup((self._child,)), self._ahead, sight=self.sight)
        self.decisions, self.others = np.zeros((2, batch), int)
        self._found = np.full(batch, NOTHING)

    def watch(self, percept: Percept) -> None:
        super().watch(percept)
        self._found[:] = NOTHING

    def best(self, options: Options, percept: Percept, worlds: np.ndarray) -> np.ndarray:
        usual, every = super().best(options, percept, worlds), np.arange(len(worlds))
        if percept.time_left is not None and percept.time_left[0] == 1:
            damage = options.damage.copy()
            damage[every, usual] = np.inf
            others = np.argsort(damage, axis=1, kind="stable")[:, :OTHERS]
            cost = self.simulate(percept, worlds, np.insert(others, 0, usual, axis=1))
            more = cost[:, 1:] - cost[:, :1]  # with the same chance
            least = more.mean(axis=2) + SURE * more.std(axis=2) / np.sqrt(SCENARIOS)
            least[np.take_along_axis(damage, others, axis=1) > _FAR] = np.inf
            found = others[every, least.argmin(axis=1)]
            self._found[worlds] = np.where(least.min(axis=1) < 0, found, NOTHING)
            self.decisions[worlds] += 1
            self.others[worlds] += least.min(axis=1) < 0
        return np.where(self._found[worlds] == NOTHING, usual, self._found[worlds])

    def simulate(self, percept: Percept, worlds: np.ndarray, options: np.ndarray) -> np.ndarray:
        """Return the discounted damage and price to come of some options in each world, (W, n, scenarios).

        The worlds are (W,), the numbers of the options (W, n).
        """
        world, chain, shape = self.world, child_chain(self.plan), (*options.shape, SCENARIOS)
        which = np.broadcast_to(worlds[:, None, None], shape).ravel()
        draws = [_even(self._random[one]) for one in worlds]  # (scenarios, 1 + timesteps, 3) each
        world.reset([(RandomStream(one[0], one[1:]),) for some in draws for _ in range(shape[1]) for one in some])
        # Where the child is, where it goes and how much it strays: it is a novice, as far as that can be told.
        if percept.belief:
            novices = percept.belief.joint[worlds, 0]
        else:
            known = np.arange(chain.shape[0]) == percept.child_cell[worlds]
            novices = known[..., None, None] * self.belief.probability[worlds]
        novices = novices[:, :, : len(self.plan.bins)]
        up_to = novices.reshape(len(worlds), -1).cumsum(axis=1, dtype=float)
        drawn = [np.searchsorted(one, some[:, 0, 0] * one[-1]) for one, some in zip(up_to, draws, strict=True)]
        state = np.broadcast_to(np.array(drawn)[:, None], shape).ravel()
        cell, world.goal[:, 0], epsilon = np.unravel_index(state, novices.shape[1:])
        self._child.share = chain.epsilons[epsilon]
        world.child_cell = world.previous_cell = cell[:, None]
        world.caregiver_cell, world.candle_table = percept.caregiver_cell[which], percept.candle_table[which]
        if percept.belief and world.eyes:
            tracker = self._ahead.belief = world.eyes.tracker
            tracker.joint = percept.belief.joint[which]
            tracker.seen, tracker.cell = percept.belief.seen[which], percept.belief.cell[which]
        self._ahead.belief.probability = self.belief.probability[which]
        self._ahead.option = np.repeat(options, SCENARIOS)
        world.care(self._ahead)
        cost, discount = np.zeros(len(which)), 1.0
        for _ in range(AHEAD):
            cost += discount * to_expect(world, OBJECTIVE.price, OBJECTIVE.random_price)
            discount *= OBJECTIVE.discount
            world.step()
        last = world.percept()  # what is in the hand is thought to be put down already
        tables = np.where(last.candle_table == NOTHING, world.orders.destination[:, None], last.candle_table)
        last = dataclasses.replace(last, candle_table=tables)
        return (cost + discount * self._ahead.expected_damage(last, np.arange(len(which)))).reshape(shape)


class Committed(ForesightCaregiver):
    """`foresight` with options fixed for the rest of the timestep: their numbers, (B,), or NOTHING."""

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        super().reset(batch, seeds, children)
        self.option = np.full(batch, NOTHING)

    def watch(self, percept: Percept) -> None:
        super().watch(percept)
        self.option = np.full(len(self.option), NOTHING)

    def best(self, options: Options, percept: Percept, worlds: np.ndarray) -> np.ndarray:
        fixed = self.option[worlds]
        return np.where(fixed == NOTHING, super().best(options, percept, worlds), fixed)


class Novices(Novice):
    """Novices, each with its own epsilon, (B,)."""

    share = np.zeros(0)

    def epsilons(self, batch: int) -> np.ndarray:
        return self.share


def to_expect(world: GridWorld, price: float = 0.0, random_price: float = 0.0) -> np.ndarray:
    """Return the damage to be expected of the only child's next move, and the price of its being denied, (B,).

    Given what the child wants. Added up over an episode it has the mean of the damage that is done, and less chance.
    """
    plan, cell, epsilon = world.plan, world.child_cell[:, 0], world.behaviours[0].epsilons(len(world.goal))[:, None]
    next_cell, target, index = (part[cell] for part in plan.graph.moves)  # (B, moves)
    entered = np.where(target == Target.STAIRWELL, len(plan.free_cells) + index, next_cell)
    free = entered != world.caregiver_cell[:, None]
    candle = (world.candle_table[:, None] == index[..., None]).any(axis=2)
    fall, bump, more = costs(plan)
    harm = (target == Target.STAIRWELL) * free * fall + (target == Target.TABLE) * (bump + more * candle)
    denied = (target == Target.FREE) & ~free
    wants = (1 - epsilon) * child_chain(plan).greedy[cell, world.goal[:, 0]]
    at_random = np.broadcast_to(epsilon / wants.shape[1], wants.shape)
    return ((harm + denied * price) * wants + (harm + denied * random_price) * at_random).sum(axis=1)


def _even(random: np.random.Generator) -> np.ndarray:
    """Return uniform draws, (scenarios, 1 + timesteps, 3), each of which is spread evenly over the scenarios."""
    order = np.tile(np.arange(SCENARIOS)[:, None, None], (1, AHEAD + 1, 3))
    return (random.permuted(order, axis=0) + random.random(order.shape)) / SCENARIOS

"""The paper's world: novice and caregiver on a grid, a batch of episodes at once.

In a timestep the novice makes one move, then the caregiver up to three of its seven actions (four moves, wait, get,
place), because it walks three times as fast (paper, section V.C). It decides anew before each, unless it has a
candle in the hand: that is put down first. Get and place act on a table in a neighbouring cell. A caregiver that
has nothing to do, or whose way the novice bars, keeps out of the novice's way.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import NOTHING, Caregiver, Observation
from caregiver_mj.children.novice import (
    CANDLE_DAMAGE,
    DAMAGE_THRESHOLD,
    EPISODE_TIMESTEPS,
    STAIRWELL_DAMAGE,
    TABLE_DAMAGE,
    Novice,
    NoviceTape,
    pick,
)
from caregiver_mj.plans.cell_graph import UNREACHABLE, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.yielding import yielding

CAREGIVER_ACTIONS = 3  # a novice timestep: 5.0 km/h over 1.6 km/h, rounded down


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What happened in a batch of episodes; every attribute has shape (B,).

    The grid and the house report the same figures; see the README for the columns.
    """

    damage: np.ndarray
    damage_stairwell: np.ndarray
    damage_candle: np.ndarray
    damage_table: np.ndarray
    timesteps_to_threshold: np.ndarray
    cells_visited: np.ndarray
    toys_reached: np.ndarray
    moves_blocked: np.ndarray
    interventions: np.ndarray
    interventions_done: np.ndarray


class GridWorld:
    """A batch of episodes on one floor plan.

    The state is public, for inspection and tests; all arrays have the episode as first dimension.

    Attributes:
        visits: Timesteps that novices have ended in each free cell, summed over the batch, (free cells,).
        damage_at: Damage that they have taken in each, likewise.
    """

    def __init__(
        self,
        plan: FloorPlan,
        epsilon: float,
        caregiver: Caregiver | None,
        *,
        caregiver_actions: int = CAREGIVER_ACTIONS,
    ):
        self.plan = plan
        self.novice = Novice(plan, epsilon)
        self.caregiver = caregiver
        self._caregiver_actions = caregiver_actions
        self._next_cell, self._target, self._target_index = plan.graph.moves
        self._paths = _Paths(plan)
        self._stairwell_node = len(plan.free_cells) + np.arange(len(plan.stairwells))

    def reset(self, tapes: Sequence[NoviceTape]) -> None:
        """Begins one episode for each tape."""
        self.batch = batch = len(tapes)
        start = np.stack([tape.start for tape in tapes])  # (B, 3)
        self._draws = np.stack([tape.steps for tape in tapes], axis=1)  # (timesteps, B, 3)
        self.timestep = 0
        self.novice_cell = self.novice.start_cell(start[:, 0])
        self.goal = self.novice.next_bin(start[:, 2])
        self.previous_cell = self.novice_cell.copy()
        self.previous_action = np.full(batch, NOTHING)
        self.candle_table = np.tile(np.array(self.plan.candle_tables, int), (batch, 1))
        self.holding = np.full(batch, NOTHING)
        self.destination = np.full(batch, NOTHING)
        self.intention = np.full(batch, NOTHING)
        self._done = np.zeros(batch, bool)  # the intervention intended is a stairwell that is blocked by now
        self.caregiver_cell = caregiver_start(self.plan, self.novice_cell, start[:, 1])
        self._visited = np.zeros((batch, len(self.plan.free_cells)), bool)
        self._visited[np.arange(batch), self.novice_cell] = True
        self.visits, self.damage_at = np.zeros((2, len(self.plan.free_cells)))
        self.stopped = np.zeros(batch, bool)  # has reached the damage threshold
        self._figures = {field.name: np.zeros(batch) for field in dataclasses.fields(Outcome)}
        self._figures["timesteps_to_threshold"] += EPISODE_TIMESTEPS
        if self.caregiver:
            self.caregiver.reset(batch, [tape.caregiver_seed for tape in tapes])

    def step(self) -> None:
        """One novice timestep: the novice's move, then the caregiver's actions."""
        self._move_novice()
        if self.caregiver:
            self.caregiver.watch(self.observation())
            for _ in range(self._caregiver_actions):
                self._act_caregiver()

    def run(self, tapes: Sequence[NoviceTape], progress: Callable[[], None] = lambda: None) -> Outcome:
        """Runs whole episodes, one for each tape.

        Args:
            tapes: The novices' chance.
            progress: Called after every timestep.
        """
        self.reset(tapes)
        for _ in range(len(self._draws)):
            self.step()
            progress()
        return self.outcome()

    def outcome(self) -> Outcome:
        """The figures so far."""
        figures = self._figures
        damage = figures["damage_stairwell"] + figures["damage_candle"] + figures["damage_table"]
        return Outcome(**{**figures, "damage": damage})

    def observation(self) -> Observation:
        """What the caregiver sees now."""
        return Observation(
            self.novice_cell,
            self.previous_cell,
            self.previous_action,
            self.caregiver_cell,
            self.candle_table,
            self.holding,
        )

    # -- The novice ------------------------------------------------------------------------------

    def _move_novice(self) -> None:
        draws, figures = self._draws[self.timestep], self._figures
        self.timestep += 1
        cell = self.novice_cell
        action = self.novice.act(cell, self.goal, draws)
        target, index = self._target[cell, action], self._target_index[cell, action]
        next_cell = self._next_cell[cell, action]

        stairwell, table = target == Target.STAIRWELL, target == Target.TABLE
        blocked = np.zeros(self.batch, bool)
        if self.caregiver:
            free = target == Target.FREE
            blocked = free & (next_cell == self.caregiver_cell)
            blocked[stairwell] = self._stairwell_node[index[stairwell]] == self.caregiver_cell[stairwell]
            next_cell = np.where(blocked, cell, next_cell)
        bears_candle = table & (self.candle_table == index[:, None]).any(axis=1)
        harm = {
            "damage_stairwell": STAIRWELL_DAMAGE * (stairwell & ~blocked),
            "damage_candle": CANDLE_DAMAGE * bears_candle,
            "damage_table": TABLE_DAMAGE * (table & ~bears_candle),
        }
        for name, damage in harm.items():
            figures[name] += damage
        self.damage_at += np.bincount(cell, sum(harm.values()), len(self.damage_at))
        self.visits += np.bincount(next_cell, minlength=len(self.visits))
        figures["moves_blocked"] += blocked

        reached = (target == Target.BIN) & (index == self.goal)
        figures["toys_reached"] += reached
        self.goal = np.where(reached, self.novice.next_bin(draws[:, 2]), self.goal)

        self.previous_cell, self.previous_action, self.novice_cell = cell, action, next_cell
        newly_visited = ~self.stopped & ~self._visited[np.arange(self.batch), next_cell]
        self._visited[np.flatnonzero(newly_visited), next_cell[newly_visited]] = True
        figures["cells_visited"] = self._visited.sum(axis=1).astype(float)
        stops_now = ~self.stopped & (self.outcome().damage >= DAMAGE_THRESHOLD)
        figures["timesteps_to_threshold"][stops_now] = self.timestep
        self.stopped |= stops_now

    # -- The caregiver ---------------------------------------------------------------------------

    def _act_caregiver(self) -> None:
        observation = self.observation()
        stairwells = len(self.plan.stairwells)
        holds = self.holding != NOTHING
        target = np.where(holds, self.holding + stairwells, self.caregiver.decide(observation))
        begins = target != self.intention
        self._figures["interventions"] += begins & (target != NOTHING)
        self._done &= ~begins
        self.intention = target

        # Where to go: onto a landing, or beside the table with the candle or for it.
        at_stairwell = (target != NOTHING) & (target < stairwells)
        at_table = target >= stairwells
        candle = np.where(at_table, target - stairwells, 0)
        worlds = np.arange(self.batch)
        table = np.where(holds, self.destination, 0)
        if self.candle_table.shape[1]:
            table = np.where(at_table & ~holds, self.candle_table[worlds, candle], table)
        goal = np.where(at_table, stairwells + table, np.where(at_stairwell, target, _Paths.ASIDE))

        distance, next_cell = self._paths.towards(goal, observation)
        act_here = at_table & (distance == 0)
        moves = distance > 0
        self.caregiver_cell = np.where(moves, next_cell, self.caregiver_cell)
        blocks = at_stairwell & ((distance == 0) | (moves & (distance == 1)))
        self._figures["interventions_done"] += blocks & ~self._done
        self._done |= blocks

        get, place = np.flatnonzero(act_here & ~holds), np.flatnonzero(act_here & holds)
        if get.size:
            self.destination[get] = self.caregiver.safe_table(observation, candle)[get]
            self.candle_table[get, candle[get]] = NOTHING
            self.holding[get] = candle[get]
        self.candle_table[place, candle[place]] = table[place]
        self.holding[place] = NOTHING
        self._figures["interventions_done"][place] += 1
        self.intention[place] = NOTHING  # to take the same candle again is another intervention


class _Paths:
    """Shortest paths of the caregiver round the novice, computed once for every novice cell that occurs.

    A goal is a stairwell, to stand on, or (numbered after those) a table, to stand beside. The last one, `ASIDE`,
    is to be out of the novice's way: on no shortest path from the novice to any toy bin, if there is such a cell.

    Where the novice stands in the only way to a goal there is no path, and two that wait for each other in a
    doorway would wait for ever. The caregiver then follows the novice as closely as it can while that walks away
    from it, and steps aside when it comes.
    """

    ASIDE = -1

    def __init__(self, plan: FloorPlan):
        self._plan = plan
        free, cells = len(plan.free_cells), len(plan.caregiver_cells)
        self._stand = [[plan.cell_index[c]] for c in plan.stairwells]
        self._stand += [[plan.cell_index[n] for n in plan.free_neighbours(c)] for c in plan.tables]
        # Beside a table better not where the novice could shut it in.
        self._safe_stand = [[cell for cell in stand if not yielding(plan).traps[cell]] for stand in self._stand]
        self._open_distance = plan.graph.distances_from(self._stand)  # (goals but ASIDE, cells), as if without a novice
        self._between = plan.graph.distances_from(range(cells))  # (cells, cells), likewise
        self._intended_cell = plan.graph.moves[0]
        self._known = np.zeros(free, bool)
        # Zero pages until written to, so a large plan costs only the novice cells that occur.
        shape = (free, len(self._stand) + 1, cells)
        self._distance, self._next_cell, self._next_aside = (np.zeros(shape, np.int16) for _ in range(3))

    def towards(self, goal: np.ndarray, observation: Observation) -> tuple[np.ndarray, np.ndarray]:
        """Moves left to each goal, `UNREACHABLE` where no path leads, and the cell to be in next, both (B,)."""
        novice_cell, cell = observation.novice_cell, observation.caregiver_cell
        for closed in np.unique(novice_cell[~self._known[novice_cell]]):
            self._learn(int(closed))
        # A novice that has just bumped into the caregiver comes, too: what counts is where it meant to go.
        previous, action = observation.previous_cell, observation.previous_action
        intended = np.where(action == NOTHING, previous, self._intended_cell[previous, action])
        comes = self._between[cell, intended] < self._between[cell, previous]
        distance = self._distance[novice_cell, goal, cell]
        next_cell = np.where(
            comes & (distance == UNREACHABLE),
            self._next_aside[novice_cell, goal, cell],
            self._next_cell[novice_cell, goal, cell],
        )
        return distance, next_cell

    def _learn(self, closed: int) -> None:
        """Fills the tables in for one novice cell."""
        plan, part, in_the_way = self._plan, self._plan.graph.parts(closed), yielding(self._plan).routes_over(closed)

        def lowest(height: np.ndarray) -> np.ndarray:
            """The lowest cells of every part."""
            least = np.full(part.max() + 1, np.iinfo(int).max)
            np.minimum.at(least, part, height)
            return np.flatnonzero(height == least[part])

        aside = plan.graph.downhill(plan.graph.distances_from([lowest(in_the_way)], closed)[0])
        self._distance[closed, self.ASIDE] = UNREACHABLE
        self._next_cell[closed, self.ASIDE] = self._next_aside[closed, self.ASIDE] = aside
        if self._stand:
            distance = plan.graph.distances_from(self._safe_stand, closed)
            distance = np.where(distance < UNREACHABLE, distance, plan.graph.distances_from(self._stand, closed))
            self._distance[closed, : self.ASIDE] = height = distance
            barred = distance == UNREACHABLE
            if np.delete(barred, closed, axis=1).any():
                left = self._open_distance.astype(int)
                close = plan.graph.distances_from([lowest(d) for d in left], closed)
                clear = plan.graph.distances_from([lowest(d + UNREACHABLE * in_the_way) for d in left], closed)
                height = np.where(barred, close, distance)
                self._next_aside[closed, : self.ASIDE] = plan.graph.downhill(clear)
            self._next_cell[closed, : self.ASIDE] = plan.graph.downhill(height)
        self._known[closed] = True


def caregiver_start(plan: FloorPlan, novice_cell: np.ndarray, draw: np.ndarray) -> np.ndarray:
    """Start cells of the caregiver (B,), uniform over the free cells other than the novice's."""
    others = len(plan.free_cells) - 1
    if others == 0:  # then it starts on a landing, if there is one
        return np.full(len(novice_cell), len(plan.caregiver_cells) - 1)
    cell = pick(draw, others)
    return cell + (cell >= novice_cell)


def run_episodes(
    plan: FloorPlan,
    epsilon: float,
    caregiver: Caregiver | None,
    seeds: Sequence[int],
    progress: Callable[[], None] = lambda: None,
) -> Outcome:
    """Runs one episode for every seed."""
    tapes = [NoviceTape.draw(np.random.RandomState(seed)) for seed in seeds]
    return GridWorld(plan, epsilon, caregiver).run(tapes, progress)

"""The paper's world: children and caregiver on a grid, a batch of episodes at once.

In a timestep the children move or stay, one after the other. Then the caregiver does up to three of its seven actions
(four moves, wait, get, place), because it walks three times as fast (paper, section V.C). It decides before each
action, but puts down a candle in its hand first. Get and place act on a table in a neighbouring cell; closing a gate,
and picking up a thing in its cell, are further actions. A caregiver that yields makes room for children when idle, and
keeps its distance where one bars its way (`plans/routes.py`).

For another child speed, the mean number of actions in a timestep is another, possibly a fraction: actions have a fixed
duration, and the rest of a timestep counts for the next. With five thirds it does one, two, two, one, two, two.

A child's move is immediate, as in the paper: a caregiver cannot interrupt it. The caregiver sees everything, as in the
paper, or a part (`Sight`, `GridEyes`).
"""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver, Future, PrivilegedCaregiver, Truth, answer, starting_tables
from caregiver_mj.caregivers.percept import PAPER, Pace, Percept
from caregiver_mj.children.behaviour import DENIED, ChildPercept, MoveRules, denied
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.children.random_stream import Random, RandomStream, start_cells
from caregiver_mj.danger.child_model import CHANGE, child_chain
from caregiver_mj.danger.tracker import Tracker
from caregiver_mj.errors import CaregiverError, check_kind, check_number
from caregiver_mj.grid.verbs import GRID_VERBS, GridState
from caregiver_mj.interventions.verb import BLOCK, DO_NOTHING, LOOK, Interventions, half_of, verb_of
from caregiver_mj.plans.cell_graph import ACTIONS, Target
from caregiver_mj.plans.floor_plan import FloorPlan, check_house
from caregiver_mj.plans.hazards import KINDS, NOTHING, TABLE, State, Where
from caregiver_mj.plans.routes import ASIDE, STAY, routes
from caregiver_mj.plans.visibility import ALL_ROUND, Sight, visibility
from caregiver_mj.recording.ledger import Ledger, Rollout

CAREGIVER_ACTIONS = int(PAPER.cells)  # in a novice timestep
MOST_ACTIONS = 100
_ROUNDING = 1e-6  # actions; tolerance for fractional numbers of actions


class GridWorld(GridState, Rollout):
    """A batch of B episodes on one floor plan, with K children each, one for each of the `behaviours`."""

    eyes: GridEyes | None = None  #: the caregiver's eyes; None with full sight, or without a caregiver
    ledger: Ledger  #: the account of the episodes

    def __init__(
        self,
        plan: FloorPlan,
        family: ChildGroup | float | str,
        caregiver: Caregiver | None,
        *,
        caregiver_actions: float = CAREGIVER_ACTIONS,
        sight: Sight | str = "all",
    ):
        """Prepare the world; `reset` begins episodes.

        `ChildGroup.of` takes the family and `Sight.of` the sight. `caregiver_actions` is the mean number in a novice
        timestep.

        Raises:
            CaregiverError: A privileged caregiver has limited sight, the caregiver or a child is for another house, or
                there is no caregiver action.
        """
        check_number("caregiver_actions", caregiver_actions, 1, MOST_ACTIONS)
        self.sight = Sight.of(sight)
        if isinstance(caregiver, PrivilegedCaregiver) and not self.sight.is_full:
            raise CaregiverError(f"sight must be all with a caregiver that needs privileged information, got {sight}")
        check_kind("the house", plan, FloorPlan, advice=": FloorPlan.load makes one")
        check_kind("the caregiver", caregiver, Caregiver, type(None), advice=": make_caregiver makes one")
        if caregiver:
            check_house(caregiver, plan)
        self.plan = plan
        self.timestep, self._draws = 0, np.zeros((0, 0, 0, 3))  # before any episode
        self.behaviours = list(ChildGroup.of(family).make(plan))
        self.caregiver = caregiver
        self._caregiver_actions = caregiver_actions
        self._rules = MoveRules(plan)
        self._lying = np.full(len(plan.free_cells), NOTHING)  # hazard on the floor of each free cell
        self._lying[list(plan.floor_cells)] = plan.hazards.number(Where.FLOOR, np.arange(len(plan.floor_cells)))
        # Damage of a collision with each hazard and, last, with a bare table, by kind: (hazards + 1, kinds).
        kinds = [KINDS.index(kind) for kind in (*plan.hazards.kinds, TABLE)]
        self._harm = np.eye(len(KINDS))[kinds] * [plan.damage[kind.name] for kind in KINDS]
        needed = {LOOK: not self.sight.is_full, DO_NOTHING: bool(caregiver and caregiver.waits)}
        numbers: dict[tuple[int, ...], int] = {}  # of the places of all verbs
        self._places: dict[str, np.ndarray] = {}  # of each verb
        for name, verb in GRID_VERBS.items():
            places = map(tuple, verb.places(plan) if needed.get(name, True) else [])
            self._places[name] = np.array([*(numbers.setdefault(place, len(numbers)) for place in places), STAY, ASIDE])
        if caregiver:
            caregiver.pace, caregiver.sight = Pace(caregiver_actions), self.sight
            self._routes = routes(plan, tuple(numbers))

    def reset(self, streams: Sequence[Sequence[RandomStream]]) -> None:
        """Begin B episodes, each with a random stream for every child."""
        batch, children = len(streams), len(self.behaviours)
        if not batch or any(len(group) != children for group in streams):
            raise CaregiverError(
                f"streams must be {children} in each of at least 1 episode, got {[len(group) for group in streams]}"
            )
        start = np.array([[stream.start for stream in group] for group in streams])  # (B, K, 3)
        steps = np.array([[stream.steps for stream in group] for group in streams])  # (B, K, timesteps, 3)
        self._draws = _shown(np.ascontiguousarray(np.moveaxis(steps, 2, 0)))  # (timesteps, B, K, 3)
        self.timestep = 0
        plan = self.plan
        landings = len(plan.landings)
        self.child_cell, self.caregiver_cell = (
            plan.starts[cells] for cells in start_cells(len(plan.starts) - landings, landings, start)
        )
        for behaviour in self.behaviours:
            behaviour.reset(batch)
        self.goal = np.stack([b.next_bin(start[:, k, 2]) for k, b in enumerate(self.behaviours)], axis=1)
        self.bumped = np.zeros((batch, children), bool)
        self.previous_cell = self.child_cell.copy()
        self.previous_action = np.full((batch, children), NOTHING)
        self.holding = np.full(batch, NOTHING)
        self.state = np.full((batch, len(plan.hazards)), State.AS_PLANNED, np.int8)
        self.time_left = np.ones(batch)
        self.orders = Interventions.idle(batch)
        self.done = np.zeros(batch, bool)
        self.ledger = Ledger(plan, self.child_cell, len(self._draws))
        if self.caregiver:
            self.caregiver.reset(batch, [group[0].caregiver_seed for group in streams], children)
        self.candle_table = starting_tables(plan, self.caregiver, batch)
        self.eyes = None if self.sight.is_full or not self.caregiver else GridEyes(self, self.sight)

    def step(self) -> None:
        """Run one novice timestep: the children's moves, then the caregiver's actions."""
        self.move_children()
        if self.caregiver:
            if self.eyes:
                self.eyes.watch(self._met)
            self.caregiver.watch(self.percept())
            if isinstance(self.caregiver, PrivilegedCaregiver):
                self.caregiver.hear(self.truth())
            self.care(self.caregiver)

    @property
    def over(self) -> bool:
        return self.timestep >= len(self._draws)

    def run(self, streams: Sequence[Sequence[RandomStream]]) -> Ledger:
        """Run B whole episodes and return their ledger; arguments and errors are those of `reset`."""
        self.reset(streams)
        self.run_on()
        return self.ledger

    def outcomes(self) -> list[dict[str, Any]]:
        return self.ledger.outcomes()

    def percept(self) -> Percept:
        """Return the caregiver's percept."""
        left = (self.eyes or self).state != State.AS_PLANNED  # need nothing more
        openings, _, lying = self.plan.hazards.split(left)
        some = left.any()
        everything = Percept(
            _shown(self.child_cell),
            _shown(self.previous_cell),
            _shown(self.previous_action),
            _shown(self.caregiver_cell),
            _shown(self.candle_table),
            _shown(self.holding),
            time_left=_shown(self.time_left),
            clock=np.full(len(self.holding), float(self.timestep)),
            out_of_reach=left if some else None,
            shut=openings if some else None,
            gone=lying if some else None,
            under_way=_shown(self.orders.hazard),
        )
        return self.eyes.percept(everything) if self.eyes else everything

    def truth(self) -> Truth:
        """Return the hidden state of the children."""
        epsilons = [behaviour.epsilons(len(self.goal)) for behaviour in self.behaviours]
        return Truth(_shown(self.goal), np.stack(epsilons, axis=1), self.future)

    def future(self) -> Future:
        """Return the rest of the episodes without a caregiver."""
        alone = copy.copy(self)
        alone.caregiver, alone.eyes, alone.goal, alone.bumped = None, None, self.goal.copy(), self.bumped.copy()
        alone.behaviours = copy.deepcopy(self.behaviours, {id(self.plan): self.plan})
        alone.ledger, alone.state = Ledger(self.plan, self.child_cell, len(self._draws)), self.state.copy()
        cells, objects = [], []
        for _ in range(self.timestep, len(self._draws)):
            alone.move_children()
            cells.append(alone.child_cell)
            before, action = alone.previous_cell, alone.previous_action
            objects.append(np.where(action == NOTHING, NOTHING, self.plan.graph.bumps[before, action]))
        shape = -1, *self.child_cell.shape
        return Future(np.reshape(cells, shape).astype(int), np.reshape(objects, shape).astype(int))

    # -- The children ----------------------------------------------------------------------------

    def move_children(self) -> None:
        """Run the first half of a novice timestep: every child moves or stays, and the ledger books the results."""
        if self.timestep >= len(self._draws):
            raise CaregiverError("no episode has begun, or it is over: call reset() first")
        draws = self._draws[self.timestep]
        self.timestep += 1
        # New arrays: a caregiver may have kept the old ones.
        begun = self.previous_cell = self.child_cell
        self.child_cell, self.previous_action = begun.copy(), self.previous_action.copy()
        harm, blocked = np.zeros((*begun.shape, len(KINDS))), np.zeros((*begun.shape, len(DENIED)), bool)
        toys, self._met = np.zeros((2, *begun.shape), bool)
        for child in range(len(self.behaviours)):
            booked = self._move(child, draws[:, child])
            harm[:, child], toys[:, child], blocked[:, child], self._met[:, child] = booked
        self.ledger.book(begun, self.child_cell, harm, toys, blocked)

    def _move(self, child: int, draws: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Move a child; return its harm by kind, its toys, the denied targets, and whether it met the caregiver."""
        cell, behaviour = self.child_cell[:, child], self.behaviours[child]
        caregiver_cell = self.caregiver_cell if self.caregiver else np.full(len(cell), NOTHING)
        goal = _shown(self.goal[:, child])
        self.goal[:, child] = behaviour.reconsider(goal, draws[:, 2])
        action = behaviour.act(ChildPercept(*map(_shown, (cell, goal, caregiver_cell, self.bumped[:, child]))), draws)
        way = self._rules.way(cell, action)
        target, index = way.target, way.number
        stairwell, table = target == Target.STAIRWELL, target == Target.TABLE
        waits, met = way.waits(np.delete(self.child_cell, child, axis=1)), way.meets(caregiver_cell)
        self.previous_action[:, child] = np.where(waits, NOTHING, action)
        shut = stairwell
        if stairwell.any():
            shut = stairwell & (self.state[np.arange(len(cell)), np.where(stairwell, index, 0)] == State.SHUT)
        blocked = (met | shut) & ~waits
        next_cell = np.where(blocked | waits, cell, way.next_cell)
        bears = table[:, None] & (self.candle_table == index[:, None])  # (B, candles)
        hazard = np.where(stairwell, index, NOTHING)
        if bears.size:
            hazard = np.where(bears.any(axis=1), len(self.plan.stairwells) + bears.argmax(axis=1), hazard)
        lying = np.where(next_cell == cell, NOTHING, self._lying[next_cell])
        takes = lying != NOTHING
        if takes.any():
            takes &= self.state[np.arange(len(cell)), lying] == State.AS_PLANNED
            hazard = np.where(takes, lying, hazard)
            self.state[takes, lying[takes]] = State.GONE
        harm = self._harm[hazard] * ((stairwell & ~blocked) | table | takes)[:, None]
        reached = way.reaches(self.goal[:, child])
        self.goal[:, child] = np.where(reached, behaviour.next_bin(draws[:, 2]), self.goal[:, child])
        self.bumped[:, child] = (next_cell == cell) & (target != NOTHING)
        self.child_cell[:, child] = next_cell
        return harm, reached, denied(target, blocked), met

    # -- The caregiver ---------------------------------------------------------------------------

    def care(self, caregiver: Caregiver) -> None:
        """Run the caregiver's actions of a timestep, of which `time_left` is the share that remains."""
        each = self._caregiver_actions
        done, end = (math.floor(each * timestep + _ROUNDING) for timestep in (self.timestep - 1, self.timestep))
        for left in range(end - done, 0, -1):
            self.time_left = np.full(len(self.holding), left / each)
            self.act_caregiver(caregiver)
        spent = np.stack([self.orders.verb == LOOK, self.orders.verb == BLOCK, self.orders.handles], axis=1)
        self.ledger.attend(self.eyes.tracker.seen if self.eyes else 1, spent)

    def act_caregiver(self, caregiver: Caregiver) -> None:
        """Run one action of the caregiver."""
        percept = self.percept()
        before, self.orders = self.orders, self.orders.where(self.holding != NOTHING, answer(caregiver, percept))
        verbs = self.orders.verb
        parties = [
            (verb_of(name), half_of(name, GRID_VERBS, "grid.verbs.GRID_VERBS"), np.flatnonzero(verbs == name))
            for name in dict.fromkeys(verbs.tolist())
        ]
        begins = self.orders.begins_after(before)
        self.done &= ~begins

        place, begun, ended = np.full(len(self.orders), STAY), *np.zeros((2, len(self.orders)), bool)
        for verb, half, which in parties:
            begun[which] = begins[which] & verb.counts
            place[which] = self._places[verb.name][half.place(self, which)]
        distance, next_cell = self._routes.towards(place, percept.child_cell, percept.caregiver_cell, caregiver.yields)
        stood, moves = distance == 0, distance > 0
        if self.eyes:
            felt = moves[:, None] & (next_cell[:, None] == self.child_cell)
            moves &= ~felt.any(axis=1)
        was = self.caregiver_cell
        self.caregiver_cell = np.where(moves, next_cell, was)
        came = stood | (moves & (distance == 1))
        hazard = self.orders.hazard
        for verb, half, which in parties:
            ends = which[half.carry_out(self, which, came[which], stood[which]) & ~self.done[which]]
            ended[ends] = self.done[ends] = True
            if verb.leaves:
                self.state[ends, hazard[ends]] = verb.leaves
        self.ledger.intervene(begun, ended)
        if self.eyes:
            self.eyes.turn(was, ~moves & ~(stood & self.orders.handles))
            self.eyes.look(felt)


def run_episodes(
    plan: FloorPlan, family: ChildGroup | float | str, caregiver: Caregiver | None, seeds: Sequence[Random]
) -> Ledger:
    """Run one episode for every seed or source of randomness, as `random_state` takes them."""
    family = ChildGroup.of(family)
    streams = [RandomStream.draw_group(seed, len(family)) for seed in seeds]
    return GridWorld(plan, family, caregiver).run(streams)


class BareTablesWorld(GridWorld):
    """The bare-tables baseline: no candles, all stairwells shut, and nothing on the floor.

    Only bumps into bare tables remain. A shut stairwell blocks a child like a caregiver in it. A caregiver could do
    slightly better by standing between child and table, which none does on purpose.
    """

    def __init__(self, plan: FloorPlan, family: ChildGroup | float | str):
        super().__init__(plan, family, None)

    def reset(self, streams: Sequence[Sequence[RandomStream]]) -> None:
        super().reset(streams)
        self.candle_table[:] = NOTHING
        stairs, _, lying = self.plan.hazards.split(self.state)
        stairs[:], lying[:] = State.SHUT, State.GONE


def _shown(array: np.ndarray) -> np.ndarray:
    view = array.view()
    view.flags.writeable = False
    return view


class GridEyes:
    """The sight of the caregivers of B worlds, and what they know from it.

    A caregiver looks in the direction of its last move. After an action without walking or handling it has turned
    round, and sees in all directions. It feels a child that walks into it, or that it would walk into. It learns the
    state of things on the floor by seeing their cells. Its `tracker` holds its belief about the children.
    """

    def __init__(self, world: GridState, sight: Sight):
        """Observe the start of the episodes."""
        self._world, self._seen = world, visibility(world.plan, sight).seen
        batch, children = world.child_cell.shape
        self.tracker = Tracker(child_chain(world.plan), batch, children, CHANGE)
        self.heading = np.full(batch, ALL_ROUND)  # direction as a move, or `ALL_ROUND`
        self.state = world.state.copy()  # known `State` of each hazard
        self._previous, self._action = np.full((2, batch, children), NOTHING)
        self._places = np.array(world.plan.caregiver_cells)  # rows and columns
        self.look(np.zeros_like(world.child_cell, bool))

    def watch(self, felt: np.ndarray) -> None:
        """Observe the children's moves; `felt`, bool (B, K), marks those into the caregiver."""
        world = self._world
        in_view = self.in_view()
        before, now = (
            np.take_along_axis(in_view, cell, axis=1) | felt for cell in (world.previous_cell, world.child_cell)
        )
        self._previous = np.where(before & now, world.previous_cell, NOTHING)
        self._action = np.where(before & now, world.previous_action, NOTHING)
        cell = np.where(now, world.child_cell, NOTHING)
        self.tracker.move(self._previous, self._action, cell, in_view, world.caregiver_cell)
        self._see_hazards(in_view)

    def turn(self, before: np.ndarray, idle: np.ndarray) -> None:
        """Turn to the direction of the move from a cell, (B,), or all round if idle, bool (B,)."""
        step = self._places[self._world.caregiver_cell] - self._places[before]
        moved = step.any(axis=1)
        move = (step[:, None] == np.array(ACTIONS)).all(axis=2).argmax(axis=1)
        self.heading = np.where(moved, move, np.where(idle, ALL_ROUND, self.heading))

    def look(self, felt: np.ndarray) -> None:
        """Observe the world after an action; `felt`, bool (B, K), marks children in the caregiver's way."""
        world = self._world
        in_view = self.in_view()
        now = np.take_along_axis(in_view, world.child_cell, axis=1) | felt
        self.tracker.look(np.where(now, world.child_cell, NOTHING), in_view)
        self._see_hazards(in_view)

    def percept(self, everything: Percept) -> Percept:
        """Return a percept with the children reduced to the knowledge of a caregiver with partial sight."""
        tracker, known = self.tracker, self._previous != NOTHING
        return dataclasses.replace(
            everything,
            child_cell=tracker.cell.copy(),
            previous_cell=np.where(known, self._previous, tracker.cell),
            previous_action=self._action.copy(),
            belief=tracker,
        )

    def in_view(self) -> np.ndarray:
        """Return whether each free cell is in view, bool (B, free cells)."""
        return self._seen[self._world.caregiver_cell, self.heading]

    def _see_hazards(self, in_view: np.ndarray) -> None:
        """Update the known states of hazards; those on the floor only if in view."""
        world = self._world
        unseen = np.zeros(self.state.shape, bool)
        world.plan.hazards.split(unseen)[2][:] = ~in_view[:, list(world.plan.floor_cells)]
        self.state = np.where(unseen, self.state, world.state)

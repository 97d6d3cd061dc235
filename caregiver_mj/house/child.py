"""A child in the house: what it is about to do, where that takes it, and what comes of it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Collection, Sequence

import numpy as np

from caregiver_mj.children.behaviour import Behaviour, Sight
from caregiver_mj.children.tape import Tape
from caregiver_mj.children.walk import ToddlerWalk, Vector
from caregiver_mj.house.move import Booking, Move
from caregiver_mj.house.touch import Touch
from caregiver_mj.plans.cell_graph import ACTIONS, Cell, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.recording.contacts import STRIKE_PAUSE, STRIKE_SPEED


class HouseChild:
    """One child of an episode.

    Attributes:
        behaviour: Decides its moves.
        walk: How its body moves.
        cell: Free cell in which its present move began.
        goal: Toy bin that it wants to get to.
        move: Its present move.
        touched: Directions of all that it touches now and cannot push away, unit vectors (x, y).
    """

    def __init__(self, plan: FloorPlan, behaviour: Behaviour, novice_timestep: float):
        """Prepares a child.

        Args:
            plan: The house.
            behaviour: What decides its moves.
            novice_timestep: Seconds that a move takes.
        """
        self.behaviour, self.walk = behaviour, ToddlerWalk(novice_timestep)
        self._plan, self._moves = plan, plan.graph.moves
        self._damage = dataclasses.asdict(plan.damage)

    def reset(self, tape: Tape, cell: int, yaw: float) -> None:
        """Begins an episode in a free cell."""
        self.behaviour.reset(1)
        self._draws = tape.steps
        self.goal = int(self.behaviour.next_bin(tape.start[2:])[0])
        self.put(self._plan.free_cells[cell], yaw)
        self.move = Move(self.cell, self.cell)
        self._bumped = False
        self.touched: Sequence[tuple[float, float]] = ()
        self._struck_at = -math.inf
        self._entry: Vector | None = None  # middle of the cell that it goes to, if the robot can be there

    @property
    def position(self) -> tuple[float, float]:
        """Where it is, metres."""
        return self.walk.position

    def put(self, cell: Cell, yaw: float = 0.0) -> None:
        """Puts the child into the middle of a free cell, at rest."""
        x, y = self._plan.position(cell).tolist()
        self.put_at(x, y, yaw)

    def put_at(self, x: float, y: float, yaw: float = 0.0) -> None:
        """Puts the child somewhere, at rest: metres and radians."""
        self.walk.reset((x, y), yaw)
        self.cell = self._nearest_cell()

    # -- A novice timestep -----------------------------------------------------------------------

    def begin(
        self, timestep: int, random: np.random.RandomState, caregiver_cell: int, taken: Collection[int] = ()
    ) -> None:
        """Chooses a move and sets out for it.

        Args:
            timestep: Number of the novice timestep.
            random: Source of draws once the tape is over.
            caregiver_cell: Where the caregiver is, or NOTHING.
            taken: Free cells in which other children are, or will be. The child does not set out for one of these.
        """
        draws = self._draws[timestep][None] if timestep < len(self._draws) else random.random_sample((1, 3))
        self.goal = int(self.behaviour.reconsider(np.array([self.goal]), draws[:, 2])[0])
        sight = Sight(*(np.array([value]) for value in (self.cell, self.goal, caregiver_cell, self._bumped)))
        action = int(self.behaviour.act(sight, draws)[0])
        self.move, self._entry = Move(self.cell, self.cell, draw=draws[:, 2]), None
        next_cell, target, index = self._moves
        if action == NOTHING or (target[self.cell, action] == Target.FREE and next_cell[self.cell, action] in taken):
            self.walk.stay()
            return
        self.move.target, self.move.going = Target(int(target[self.cell, action])), int(next_cell[self.cell, action])
        self.move.to_toy = self.move.target == Target.BIN and int(index[self.cell, action]) == self.goal
        home, (down, right) = self._plan.free_cells[self.cell], ACTIONS[action]
        ahead = home[0] + down, home[1] + right
        here, there = (tuple(self._plan.position(cell).tolist()) for cell in (home, ahead))
        if self.move.target in (Target.FREE, Target.STAIRWELL):
            self._entry = there
            if caregiver_cell == self._plan.cell_index[ahead]:
                self.move.entered = None
        self.walk.begin(here, there, bump=self.move.target != Target.FREE)

    def step(self, seconds: float) -> None:
        """Walks on."""
        self.walk.step(seconds, self.touched)

    def see_robot(self, robot: Sequence[float]) -> None:
        """Takes note of a robot at x, y (m) that has come into the cell to which the child is on its way."""
        if self._entry is None or self.move.entered is not False or self.walk.is_on_way_back:
            return
        half = self._plan.cell_size / 2
        self.move.entered = abs(robot[0] - self._entry[0]) < half and abs(robot[1] - self._entry[1]) < half

    def take_in(self, touches: list[Touch], bears_candle: Callable[[int], bool], time: float) -> int:
        """Takes in all its contacts of a control timestep.

        Args:
            touches: The contacts.
            bears_candle: Tells whether there is a candle on a table.
            time: Seconds since the start.

        Returns:
            How many times the robot has struck it.
        """
        self.touched = [touch.direction for touch in touches if touch.kind != "candle"]
        strikes = 0
        for touch in touches:
            if touch.kind in ("stairwell", "candle"):
                self._hurt(touch.kind)
                self.move.fell |= touch.kind == "stairwell"
            elif touch.kind == "table":
                self._hurt("candle" if bears_candle(touch.index) else "table")
            elif touch.kind == "bin":
                self.move.reached_toy |= touch.index == self.goal
            elif touch.kind == "robot":
                vx, vy = self.walk.velocity
                self.move.met_robot |= vx * touch.direction[0] + vy * touch.direction[1] > 0 or self.walk.blocked
                if touch.speed > STRIKE_SPEED and time - self._struck_at > STRIKE_PAUSE:
                    strikes += 1
                    self._struck_at = time
        return strikes

    def _hurt(self, kind: str) -> None:
        self.move.hurt(kind, self._damage[kind])

    def end(self) -> Booking:
        """Ends the move, and tells what came of it."""
        move = self.move
        self.cell = self._nearest_cell()
        self._bumped = self.cell == move.begun
        if move.reached_toy:
            assert move.draw is not None  # drawn when the move began
            self.goal = int(self.behaviour.next_bin(move.draw)[0])
        self.move = Move(self.cell, self.cell)
        return move.booking(self.cell)

    @property
    def next_goal(self) -> int:
        """The toy bin that it will want to get to after its present move, if that takes it where it is to."""
        if not self.move.to_toy:
            return self.goal
        assert self.move.draw is not None  # drawn when the move began
        return int(self.behaviour.next_bin(self.move.draw)[0])

    def _nearest_cell(self) -> int:
        """The free cell that it is in, or nearest to."""
        plan, position = self._plan, self.walk.position
        here = plan.cell_index.get(plan.cell_at(np.array(position)), NOTHING)
        if 0 <= here < len(plan.free_cells):
            return here
        return min(range(len(plan.free_cells)), key=lambda i: math.dist(plan.position(plan.free_cells[i]), position))

"""The children of a house: their order, who waits for whom, and their contacts."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np

from caregiver_mj.children.behaviour import Behaviour
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.house.candles import Candles
from caregiver_mj.house.child import SOFTNESS, Booking, CompliantBody, HouseChild
from caregiver_mj.house.physics import Physics
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, State


class Children(Sequence[HouseChild]):
    """All children of an episode, in the order in which they move; a move takes a novice timestep, in seconds.

    Compliant ones give way to a push, see `child.CompliantBody`.

    Attributes:
        harm: The worst damage that any of them has taken in the present novice timestep.
        state: What has become of each hazard, a `State`, (hazards,).
    """

    harm = 0.0

    def __init__(
        self,
        plan: FloorPlan,
        behaviours: Sequence[Behaviour],
        novice_timestep: float,
        compliant: bool = False,
        speed: float = WALKING_SPEED,
    ):
        self._bodies = [CompliantBody() for _ in behaviours] if compliant else []
        self.state = np.full(len(plan.hazards), State.AS_PLANNED)
        self._children = [HouseChild(plan, behaviour, novice_timestep, self.state, speed) for behaviour in behaviours]
        self._plan, self._gates = plan, slice(len(plan.landings), len(plan.stairwells))
        self._places = [tuple(plan.position(cell).tolist()) for cell in plan.caregiver_cells]

    def __getitem__(self, number: int) -> HouseChild:  # type: ignore[override]  # no slices
        return self._children[number]

    def __len__(self) -> int:
        return len(self._children)

    def start(self, number: int, stream: RandomStream, cell: int, yaw: float, physics: Physics) -> None:
        """Begin an episode for one child, in a free cell."""
        self.harm = 0.0
        self[number].reset(stream, cell, yaw)
        physics.set_toddler(self[number].walk, number)
        if physics.figures:
            physics.figures[number].reset()
        if self._bodies:
            physics.soften_toddlers(*SOFTNESS)
            self._bodies[number].reset(self[number].walk)

    def begin(self, timestep: int, random: np.random.RandomState, physics: Physics) -> None:
        """Begin their moves in turn; none enters the present or coming cell of another."""
        caregiver_cell = NOTHING
        if physics.has_robot:  # the cell that is nearest to its base
            robot, index = physics.base_position()[:2].tolist(), self._plan.cell_index
            caregiver_cell = index.get(self._plan.cell_at(robot), NOTHING)
            if caregiver_cell == NOTHING:  # in that of a wall, which is thinner
                caregiver_cell = min(range(len(self._places)), key=lambda i: math.dist(self._places[i], robot))
        for number, child in enumerate(self):
            taken = {other.move.going for other in self._children[:number]}
            taken |= {other.cell for other in self._children[number + 1 :]}
            child.begin(timestep, random, caregiver_cell, taken)

    def step(self, seconds: float, physics: Physics) -> None:
        """Advance their walks."""
        robot = physics.base_position()[:2].tolist() if physics.has_robot else None
        for number, child in enumerate(self._children):
            child.step(seconds)
            if robot:
                child.see_robot(robot)
            if self._bodies:
                self._bodies[number].follow(child.walk, physics, number, seconds)
            else:
                physics.set_toddler(child.walk, number)
        for figure, child in zip(physics.figures, self._children, strict=False):  # none without visuals
            figure.step(child.walk, child.mood, robot, seconds)

    def take_in(self, physics: Physics, candles: Candles) -> None:
        """Process their contacts of the last control timestep."""
        if not physics.touches:  # most of the time
            for child in self._children:
                child.touched = ()
            return
        on_table = functools.partial(candles.are_on, physics)
        for number, child in enumerate(self):
            child.take_in([touch for touch in physics.touches if touch.child == number], on_table)
        self.harm = max(child.move.harm for child in self)

    @property
    def shut_gates(self) -> list[int]:
        """The numbers of the gates that are shut."""
        return np.flatnonzero(self.state[self._gates] == State.SHUT).tolist()

    def hurt(self, number: int, kind: str) -> None:
        """Record that a kind of thing hurts one of them."""
        self[number].hurt(kind)
        self.harm = max(self.harm, self[number].move.harm)

    def end(self) -> list[Booking]:
        """End their moves and return the result of each."""
        self.harm = 0.0
        return [child.end() for child in self]

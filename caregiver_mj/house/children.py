"""The children of a house together: who goes first, and who waits for whom."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from caregiver_mj.children.behaviour import Behaviour
from caregiver_mj.children.tape import Tape
from caregiver_mj.house.candles import Candles
from caregiver_mj.house.child import HouseChild
from caregiver_mj.house.compliant import SOFTNESS, CompliantBody
from caregiver_mj.house.contacts import ContactWatch
from caregiver_mj.house.move import Booking
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.touch import Touch
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.recording.contacts import Contacts


class Children(Sequence[HouseChild]):
    """All children of an episode, in the order in which they move.

    Attributes:
        harm: The worst damage that any of them has taken in the present novice timestep.
    """

    harm = 0.0

    def __init__(
        self, plan: FloorPlan, behaviours: Sequence[Behaviour], novice_timestep: float, compliant: bool = False
    ):
        """Prepares the children.

        Args:
            plan: The house.
            behaviours: What decides the moves of each child.
            novice_timestep: Seconds that a move takes.
            compliant: Whether they give way to a push, see `house.compliant`.
        """
        self._bodies = [CompliantBody() for _ in behaviours] if compliant else []
        self._children = [HouseChild(plan, behaviour, novice_timestep) for behaviour in behaviours]
        self._watches = [ContactWatch() for _ in behaviours]
        self._places = [tuple(plan.position(cell).tolist()) for cell in plan.caregiver_cells]

    def __getitem__(self, number: int) -> HouseChild:  # type: ignore[override]  # no slices
        return self._children[number]

    def __len__(self) -> int:
        return len(self._children)

    def __iter__(self) -> Iterator[HouseChild]:
        return iter(self._children)

    def start(self, number: int, tape: Tape, cell: int, yaw: float, physics: Physics) -> None:
        """Begins an episode for one child, in a free cell."""
        self.harm = 0.0
        self._watches[number] = ContactWatch()
        self[number].reset(tape, cell, yaw)
        physics.set_toddler(self[number].walk, number)
        if self._bodies:
            physics.soften_toddlers(*SOFTNESS)
            self._bodies[number].reset(self[number].walk)

    def begin(self, timestep: int, random: np.random.RandomState, physics: Physics) -> None:
        """Has them set out one after the other; none goes where another is or, if that has set out, will be."""
        caregiver_cell = self._caregiver_cell(physics)
        for number, child in enumerate(self):
            taken = {other.move.going for other in self._children[:number]}
            taken |= {other.cell for other in self._children[number + 1 :]}
            child.begin(timestep, random, caregiver_cell, taken)

    def step(self, seconds: float, physics: Physics) -> None:
        """Has them walk on."""
        robot = physics.base_position()[:2].tolist() if physics.has_robot else None
        for number, child in enumerate(self._children):
            child.step(seconds)
            if robot:
                child.see_robot(robot)
            if self._bodies:
                self._bodies[number].follow(child.walk, physics, number, seconds)
            else:
                physics.set_toddler(child.walk, number)

    def take_in(self, physics: Physics, candles: Candles, contacts: Contacts) -> int:
        """Has them take in what they touched in the last control timestep.

        Args:
            physics: The simulation.
            candles: The candles in it.
            contacts: Where the robot's contacts with them are counted.

        Returns:
            How often the robot struck one.
        """
        if not physics.touches:  # most of the time
            for child in self._children:
                child.touched = ()
            return 0
        touches: list[list[Touch]] = [[] for _ in self]
        for touch in physics.touches:
            touches[touch.child].append(touch)
        bears_candle, time = functools.partial(candles.are_on, physics), physics.time()
        for watch, felt in zip(self._watches, touches, strict=True):
            watch.take_in(felt, physics.timestep(), contacts)
        strikes = sum(child.take_in(felt, bears_candle, time) for child, felt in zip(self, touches, strict=True))
        self.harm = max(child.move.harm for child in self)
        return strikes

    def end(self) -> list[Booking]:
        """Ends their moves, and tells what came of each."""
        self.harm = 0.0
        return [child.end() for child in self]

    def _caregiver_cell(self, physics: Physics) -> int:
        """The caregiver cell that is nearest to the robot's base; NOTHING if there is no robot."""
        if not physics.has_robot:
            return NOTHING
        robot = physics.base_position()[:2].tolist()
        return min(range(len(self._places)), key=lambda i: math.dist(self._places[i], robot))

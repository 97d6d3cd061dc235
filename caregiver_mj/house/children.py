"""The children of a house together: who goes first, who waits for whom, and how the robot touches them."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterable, Sequence
from operator import attrgetter

import numpy as np

from caregiver_mj.children.behaviour import Behaviour
from caregiver_mj.children.tape import Tape
from caregiver_mj.house.candles import Candles
from caregiver_mj.house.child import SOFTNESS, Booking, CompliantBody, HouseChild
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.touch import Touch
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, State
from caregiver_mj.recording.contacts import PRESSING, STRIKE_PAUSE, STRIKE_SPEED, Contacts, region_at

_APART = 0.1  # seconds without touch that end a contact: one that lasts flickers as the two give way to each other


class Children(Sequence[HouseChild]):
    """All children of an episode, in the order in which they move; a move takes a novice timestep, in seconds.

    Compliant ones give way to a push, see `child.CompliantBody`.

    Attributes:
        harm: The worst damage that any of them has taken in the present novice timestep.
        state: What has become of each hazard, a `State`, (hazards,).
    """

    harm = 0.0

    def __init__(
        self, plan: FloorPlan, behaviours: Sequence[Behaviour], novice_timestep: float, compliant: bool = False
    ):
        self._bodies = [CompliantBody() for _ in behaviours] if compliant else []
        self.state = np.full(len(plan.hazards), State.AS_PLANNED)
        self._children = [HouseChild(plan, behaviour, novice_timestep, self.state) for behaviour in behaviours]
        self._watches = [ContactWatch() for _ in behaviours]
        self._plan = plan
        self._places = [tuple(plan.position(cell).tolist()) for cell in plan.caregiver_cells]

    def __getitem__(self, number: int) -> HouseChild:  # type: ignore[override]  # no slices
        return self._children[number]

    def __len__(self) -> int:
        return len(self._children)

    def start(self, number: int, tape: Tape, cell: int, yaw: float, physics: Physics) -> None:
        """Begin an episode for one child, in a free cell."""
        self.harm = 0.0
        self._watches[number] = ContactWatch()
        self[number].reset(tape, cell, yaw)
        physics.set_toddler(self[number].walk, number)
        if self._bodies:
            physics.soften_toddlers(*SOFTNESS)
            self._bodies[number].reset(self[number].walk)

    def begin(self, timestep: int, random: np.random.RandomState, physics: Physics) -> None:
        """Have them set out one after the other; none goes where another is or, if that has set out, will be."""
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
        """Have them walk on."""
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
        """Have them take in what they touched in the last control timestep.

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
        on_table, time = functools.partial(candles.are_on, physics), physics.time()
        for watch, felt in zip(self._watches, touches, strict=True):
            watch.take_in(felt, physics.timestep(), contacts)
        strikes = sum(child.take_in(felt, on_table, time) for child, felt in zip(self, touches, strict=True))
        self.harm = max(child.move.harm for child in self)
        return strikes

    def hurt(self, number: int, kind: str) -> None:
        """Have one of them hurt itself at a kind of thing."""
        self[number].hurt(kind)
        self.harm = max(self.harm, self[number].move.harm)

    def end(self) -> list[Booking]:
        """End their moves, and return what came of each."""
        self.harm = 0.0
        return [child.end() for child in self]


class ContactWatch:
    """Watches the contacts of one child with the robot.

    They are read from the simulation at every physics step. What has no time or no extent of its own, such as a
    strike, is booked once: a strike again after half a second, a pressing when the contact has lasted for that long.
    """

    def __init__(self) -> None:
        self._touched_at = self._struck_at = -math.inf
        self._lasted = 0.0

    def take_in(self, touches: Iterable[Touch], seconds: float, tally: Contacts) -> None:
        """Take in the child's contacts of a control timestep.

        Args:
            touches: All of them, in the order in which they came.
            seconds: Of a physics step.
            tally: What is counted.
        """
        robot = (touch for touch in touches if touch.kind == "robot")
        for time, together in itertools.groupby(robot, key=attrgetter("time")):
            self._step(time, list(together), seconds, tally)

    def _step(self, time: float, touches: list[Touch], seconds: float, tally: Contacts) -> None:
        begins = time - self._touched_at > _APART
        if begins:
            self._lasted = 0.0
        self._touched_at = time
        before, self._lasted = self._lasted, self._lasted + seconds
        tally.pressings += before < PRESSING - seconds / 2 <= self._lasted  # half a step for what rounding adds up to
        forces: dict[str, float] = {}
        for touch in touches:
            region = region_at(touch.height)
            forces[region] = forces.get(region, 0.0) + touch.force
        tally.press(forces, seconds)
        # At first the surface is as fast as it has come. Then the child pushes it, which is not the robot's doing.
        speed = max(
            touch.surface_speed if begins else min(touch.surface_speed, touch.driven_speed) for touch in touches
        )
        tally.contact_speed = max(tally.contact_speed, speed)
        if speed > STRIKE_SPEED and time - self._struck_at > STRIKE_PAUSE:
            tally.strikes_surface += 1
            self._struck_at = time

"""The children of a house together: who goes first, who waits for whom, and how the robot touches them."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Collection, Sequence
from operator import attrgetter

import numpy as np

from caregiver_mj.children.behaviour import Behaviour
from caregiver_mj.children.tape import Tape
from caregiver_mj.house.candles import Candles
from caregiver_mj.house.child import SOFTNESS, Booking, CompliantBody, HouseChild
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.touch import Touch
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, TABLE, State
from caregiver_mj.recording.contacts import PRESSING, STRIKE_PAUSE, STRIKE_SPEED, Contacts, band_of, region_at

_APART = 0.1  # seconds without touch that end a contact: one that lasts flickers as the two give way to each other
_SOLID = ("wall", "bin", TABLE.name)  # what gives no way, beside closed gates
_OPPOSITE = -0.5  # cosine between robot and solid thing, seen from a child, up to which it is between them: 120 degrees


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
        self._plan, self._gates = plan, slice(len(plan.landings), len(plan.stairwells))
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
        """Have them take in what they touched in the last control timestep, and count the robot's contacts with them.

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
        shut = [gate for gate, state in enumerate(self.state[self._gates]) if state == State.SHUT]
        for watch, felt in zip(self._watches, touches, strict=True):
            watch.take_in(felt, physics.timestep(), contacts, shut)
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
        self._touched_at = self._struck_at = self._pinched_at = self._gate_struck_at = -math.inf
        self._lasted = self._fastest = self._energy = 0.0

    def take_in(self, touches: Sequence[Touch], seconds: float, tally: Contacts, shut: Collection[int] = ()) -> None:
        """Count the child's contacts of a control timestep, in their order.

        `seconds` are those of a physics step, `shut` the numbers of the closed gates.
        """
        if not any(touch.part or touch.kind == "robot" for touch in touches):
            return
        for time, together in itertools.groupby(touches, key=attrgetter("time")):
            now = list(together)
            robot = [touch for touch in now if touch.kind == "robot"]
            held = [touch for touch in now if touch.part and touch.kind not in ("robot", "panel")]
            tally.touch(robot + held, seconds)
            if robot:
                self._step(time, robot, seconds, tally)
                self._watch_pinches(time, robot, [touch for touch in now if _is_solid(touch, shut)], seconds, tally)
            self._watch_gates(time, now, tally)

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
        speeds = [touch.surface_speed if begins else min(touch.surface_speed, touch.driven_speed) for touch in touches]
        speed = max(speeds)
        tally.contact_speed = max(tally.contact_speed, speed)
        if speed > STRIKE_SPEED:
            tally.contact_seconds_driven += seconds
            if time - self._struck_at > STRIKE_PAUSE:
                tally.strikes_surface += 1
                self._struck_at = time
        energies = [touch.mass * speed * speed / 2 for touch, speed in zip(touches, speeds, strict=True)]
        self._grade(begins, speed, max(energies), tally)

    def _grade(self, begins: bool, speed: float, energy: float, tally: Contacts) -> None:
        """Count a contact by its greatest speed and energy so far, and no longer by those before."""
        was = "" if begins else band_of(self._fastest)
        if begins:
            self._fastest = self._energy = 0.0
        self._fastest = max(self._fastest, speed)
        tally.grade(was, band_of(self._fastest))
        if energy > self._energy:
            tally.contact_energy_total += energy - self._energy
            tally.contact_energy = max(tally.contact_energy, energy)
            self._energy = energy

    def _watch_gates(self, time: float, touches: list[Touch], tally: Contacts) -> None:
        pushed = any(touch.kind == "panel" and touch.part and touch.speed > STRIKE_SPEED for touch in touches)
        if pushed and time - self._gate_struck_at > STRIKE_PAUSE:
            tally.gate_strikes += 1
            self._gate_struck_at = time

    def _watch_pinches(
        self, time: float, robot: list[Touch], solid: list[Touch], seconds: float, tally: Contacts
    ) -> None:
        if any(_cosine(one.direction, other.direction) <= _OPPOSITE for one in robot for other in solid):
            tally.pinches += time - self._pinched_at > _APART
            tally.pinch_seconds += seconds
            self._pinched_at = time


def _is_solid(touch: Touch, shut: Collection[int]) -> bool:
    """Return whether what a child touches gives no way. Other children are no touch: they do not collide."""
    return touch.kind in _SOLID or (touch.kind == "panel" and touch.index in shut)


def _cosine(one: tuple[float, float], other: tuple[float, float]) -> float:
    """The cosine between two directions; 0 if one is up or down."""
    return one[0] * other[0] + one[1] * other[1]

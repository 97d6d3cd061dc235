"""Contacts of the robot with children: their counts, and limits for adults on the same parts of the body.

The limits put forces on a child into perspective; they are not a child's limits. Source: the pain threshold register
of the German accident insurers (DGUV 2011, "BG/BGIA risk assessment recommendations according to machinery directive:
design of workplaces with collaborative robots"), as reprinted in Buxbaum and Sen, "Kollaborierende Roboter in der
Pflege", table 1.4 (in: Bendel (ed.), Pflegeroboter, Springer 2018, open access).
ISO/TS 15066:2016 has a similar table in its annex A, from another study of adults, which ISO 10218-2:2025 adopts. ISO
13482:2014, on personal care robots, covers contact with people of any age, as hazards to assess and reduce for each
robot. No compliance with any of them is claimed.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import types
from collections.abc import Collection, Sequence
from operator import attrgetter

from caregiver_mj.plans.hazards import TABLE
from caregiver_mj.recording.record import COLUMNS

REGIONS = {"legs": 0.24, "trunk": 0.54, "head": math.inf}  # m; upper end of each region of a child of 0.80 m
STRIKE_SPEED = 0.05  # m/s; speed of the robot at the contact, above which it is a strike
STRIKE_PAUSE = 0.5  # s; contacts within it are one strike
# m/s; upper end of each band of a contact's greatest speed. Creeping: no strike. Slow: 0.25 m/s is the "reduced speed"
# of ISO 10218:2025 for an industrial robot near its operator, an adult. Fast: the rest. Both robots stay far below the
# 1.5 m/s of Paez-Granados and Billard, see `CAUTION`.
BANDS = {"creeping": STRIKE_SPEED, "slow": 0.25, "fast": math.inf}
PRESSING = 0.5  # s; a contact of at least this duration is a pressing
FLAME_CLEAR = 0.3  # m; the 12 inches between a burning candle and clothing that NFPA and makers recommend
WAX_CLEAR = 0.1  # m; the same distance from the candle itself, own choice
FAR = 1.0  # m; greater distances are recorded as this
_APART = 0.1  # s; time without touch that ends a contact: shorter gaps occur while robot and child yield to each other
_SOLID = ("wall", "bin", TABLE.name)  # rigid things, beside closed gates
_OPPOSITE = -0.5  # cosine; the child is between robot and solid if it sees them at least 120 degrees apart
# Columns that only the house counts, with their types.
COUNTED = {
    column.name: int if column.type == "int" else float
    for column in COLUMNS
    if column.role == "contact" or column.name == "strikes"
}
CAUTION = (
    "These limits are for adults at work, and nothing here claims to keep them: a child of a year and a half bears "
    "less, no such table covers it, and its head is as high as their hips. Standards that consider children forbid "
    "any contact, such as EN 16005 for automatic doors that many children use. In crash tests with the dummy of a "
    "child the risk of a serious injury was below 5 % only below 1.5 m/s (Paez-Granados and Billard, Scientific "
    "Reports 12, 5285, 2022)."
)


# Region, part of the body, and its limits, N: greatest force while clamped or squeezed, and of an impact.
BODY_LIMITS = (
    ("head", "skull, forehead", 130, 175),
    ("head", "face", 65, 90),
    ("head", "neck, at the sides and behind", 145, 190),
    ("head", "throat", 35, 35),
    ("trunk", "back, shoulders", 210, 250),
    ("trunk", "chest", 140, 210),
    ("trunk", "belly", 110, 160),
    ("trunk", "pelvis", 180, 250),
    ("trunk", "upper arm, elbow", 150, 190),
    ("trunk", "forearm, wrist", 160, 220),
    ("trunk", "hand, fingers", 135, 180),
    ("legs", "thigh, knee", 220, 250),
    ("legs", "lower leg", 140, 170),
    ("legs", "foot, ankle", 125, 160),
)


@dataclasses.dataclass(frozen=True)
class Touch:
    """A contact of a child with something, as the house reports it."""

    child: int  # number of the child
    kind: str  # the other body: "wall", "bin", "robot", "panel" (of a gate), or the name of a `HazardKind`
    index: int  # its number in the floor plan, -1 for walls and the robot
    # unit vector from the child towards it, on the floor; (0, 0) if it is above or below
    direction: tuple[float, float]
    speed: float  # m/s; speed of the touching part of the robot or gate towards the child, 0 for all else
    # m/s; speed of that part's surface at the contact, towards the child and along it: above `speed` where the part
    # turns or slides past. Of a surface that moves away only the sliding counts
    surface_speed: float = 0.0
    # m/s; the same at the base velocity that the drives command: a pushing child moves the robot without driving it
    driven_speed: float = 0.0
    force: float = 0.0  # N; force between the two, with friction
    height: float = 0.0  # m; height of the contact above the floor
    time: float = 0.0  # s since the start
    # part of the robot that touches the child, directly or with a held thing: "base" or "arm", which includes the
    # hand; "" without the robot
    part: str = ""
    # reduced mass of robot and child along the contact, kg, see `house.touch.TouchReader.reduced_mass`; 0 for all else
    mass: float = 0.0


class Contacts(types.SimpleNamespace):
    """Counts of one episode in the house: an attribute for each column that only the house counts, and the strikes.

    Strikes of a child within `STRIKE_PAUSE` count once, and a pressing counts once, after `PRESSING`.
    """

    def __init__(self) -> None:
        super().__init__(**{name: kind(0) for name, kind in COUNTED.items()})
        self.flame_distance = self.wax_distance = FAR
        self._watches: dict[int, _Watch] = {}  # by the child

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Contacts) and self.outcome() == other.outcome()

    def take_in(self, touches: Sequence[Touch], seconds: float, time: float, shut: Collection[int] = ()) -> None:
        """Count the contacts of children in a control step.

        Args:
            touches: All contacts, in order of time for each child.
            seconds: Length of a physics step.
            time: End of the control step, s.
            shut: Numbers of the closed gates.
        """
        for child in sorted({touch.child for touch in touches}):
            watch = self._watches.setdefault(child, _Watch(self))
            watch.take_in([touch for touch in touches if touch.child == child], seconds, time, shut)

    def carry(self, flame: float, wax: float, seconds: float) -> None:
        """Count the distances of flame and wax of a candle in the hand from the nearest child, m."""
        self.flame_distance, self.wax_distance = min(self.flame_distance, flame), min(self.wax_distance, wax)
        self.flame_seconds += seconds * (flame < FLAME_CLEAR)
        self.wax_seconds += seconds * (wax < WAX_CLEAR)

    def outcome(self) -> dict[str, float]:
        """Return the columns of the record."""
        return {name: getattr(self, name) for name in COUNTED}


class _Pause:
    """A pause after an event, in which further events count as the same one."""

    def __init__(self, seconds: float):
        self._seconds, self._last = seconds, -math.inf

    def is_over(self, time: float) -> bool:
        """Return whether an event at a time, in seconds, is a new one; then restart the pause."""
        over = time - self._last > self._seconds
        self._last = time if over else self._last
        return over


class _Watch:
    """Counter of the contacts of one child in an episode."""

    def __init__(self, account: Contacts) -> None:
        self._account = account
        self._strikes, self._on_surface, self._by_gates = (_Pause(STRIKE_PAUSE) for _ in range(3))
        self._touched_at = self._pinched_at = -math.inf
        self._lasted = self._fastest = self._energy = 0.0

    def take_in(self, touches: Sequence[Touch], seconds: float, time: float, shut: Collection[int]) -> None:
        for touch in touches:
            # A panel counts even after the hand has left it, for the robot has set it in motion.
            if touch.kind in ("robot", "panel") and touch.speed > STRIKE_SPEED:
                self._account.strikes += self._strikes.is_over(time)
        if not any(touch.part or touch.kind == "robot" for touch in touches):
            return
        for at, together in itertools.groupby(touches, key=attrgetter("time")):
            now = list(together)
            robot = [touch for touch in now if touch.kind == "robot"]
            held = [touch for touch in now if touch.part and touch.kind not in ("robot", "panel")]
            parts = {touch.part for touch in robot + held} - {""}
            for name in parts | {region_at(touch.height) for touch in robot + held}:
                self._add(f"contact_seconds_{name}", seconds)
            if robot:
                self._step(at, robot, seconds)
                self._watch_pinches(at, robot, [touch for touch in now if _is_solid(touch, shut)], seconds)
            if any(touch.kind == "panel" and touch.part and touch.speed > STRIKE_SPEED for touch in now):
                self._account.gate_strikes += self._by_gates.is_over(at)

    def _press(self, forces: dict[str, float], seconds: float) -> None:
        """Count the forces on each region, N, in a physics step."""
        account, force = self._account, sum(forces.values())
        account.contact_seconds += seconds
        account.contact_impulse += force * seconds
        greatest = {"contact_force": force} | {f"contact_force_{region}": part for region, part in forces.items()}
        for column, part in greatest.items():
            setattr(account, column, max(getattr(account, column), part))

    def _add(self, column: str, amount: float) -> None:
        setattr(self._account, column, getattr(self._account, column) + amount)

    def _step(self, time: float, touches: list[Touch], seconds: float) -> None:
        account, begins = self._account, time - self._touched_at > _APART
        if begins:
            self._lasted = 0.0
        self._touched_at = time
        before, self._lasted = self._lasted, self._lasted + seconds
        account.pressings += before < PRESSING - seconds / 2 <= self._lasted  # half a step absorbs rounding
        forces: dict[str, float] = {}
        for touch in touches:
            region = region_at(touch.height)
            forces[region] = forces.get(region, 0.0) + touch.force
        self._press(forces, seconds)
        # At the start the surface counts as it moves; later only as it is driven, because the child may push it.
        speeds = [touch.surface_speed if begins else min(touch.surface_speed, touch.driven_speed) for touch in touches]
        speed = max(speeds)
        account.contact_speed = max(account.contact_speed, speed)
        if speed > STRIKE_SPEED:
            account.contact_seconds_driven += seconds
            account.strikes_surface += self._on_surface.is_over(time)
        energies = [touch.mass * speed * speed / 2 for touch, speed in zip(touches, speeds, strict=True)]
        self._grade(begins, speed, max(energies))

    def _grade(self, begins: bool, speed: float, energy: float) -> None:
        """Update the band and energy of a contact to its greatest speed and energy so far."""
        was = "" if begins else band_of(self._fastest)
        if begins:
            self._fastest = self._energy = 0.0
        self._fastest = max(self._fastest, speed)
        if was != (band := band_of(self._fastest)):
            self._add(f"contacts_{band}", 1)
            if was:
                self._add(f"contacts_{was}", -1)
        if energy > self._energy:
            self._account.contact_energy_total += energy - self._energy
            self._account.contact_energy = max(self._account.contact_energy, energy)
            self._energy = energy

    def _watch_pinches(self, time: float, robot: list[Touch], solid: list[Touch], seconds: float) -> None:
        pairs = itertools.product((touch.direction for touch in robot), (touch.direction for touch in solid))
        if any(x * other_x + y * other_y <= _OPPOSITE for (x, y), (other_x, other_y) in pairs):  # cosines
            self._account.pinches += time - self._pinched_at > _APART
            self._account.pinch_seconds += seconds
            self._pinched_at = time


def _is_solid(touch: Touch, shut: Collection[int]) -> bool:
    """Return whether a child touches a rigid thing; children do not collide with each other."""
    return touch.kind in _SOLID or (touch.kind == "panel" and touch.index in shut)


def region_at(height: float) -> str:
    """Return the region of a child at a height above the floor, m."""
    return next(region for region, top in REGIONS.items() if height < top)


def band_of(speed: float) -> str:
    """Return the band of `BANDS` for a contact's greatest speed, m/s."""
    return next(band for band, top in BANDS.items() if speed <= top)

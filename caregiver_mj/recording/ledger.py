"""Episodes in both worlds: `Rollout` is their only loop; `Ledger`, and `Contacts` in the house, their only account."""

from __future__ import annotations

import abc
import dataclasses
import itertools
import math
from collections.abc import Callable, Collection, Sequence
from operator import attrgetter
from typing import Any

import numpy as np

from caregiver_mj.children.behaviour import DENIED
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import KINDS, TABLE
from caregiver_mj.recording.record import DAMAGE_THRESHOLD

SPENT = ("looking", "guarding", "handling")  # activities of a caregiver
BLOCKED = tuple(target.name.lower() for target in DENIED)  # targets of moves that the caregiver blocked
MET = ("entered", "entered_blocked", "held_up")  # other encounters with the caregiver; see `EpisodeRecord`


class Ledger:
    """The account of a batch of B episodes with K children each. Worlds report through its methods only.

    Attributes:
        timestep: Novice timesteps booked so far.
        harm: Damage of each kind that each child has taken, (B, K, kinds), in the order of `KINDS`.
        toys: Toy bins that each child has reached, (B, K).
        moves_blocked: Moves of each child into the caregiver, by target, (B, K, targets), in the order of `BLOCKED`.
        moves_met: Moves of each child that met the caregiver otherwise, (B, K, kinds), in the order of `MET`.
        longest_blocked: Most consecutive timesteps in which each child was blocked, (B, K).
        interventions: Interventions begun, (B,).
        interventions_done: Interventions completed, (B,).
        seen: Timesteps in which each child was seen, (B, K).
        spent: Timesteps that the caregiver spent on each of `SPENT`, (B, 3).
        candles_dropped: Candles that fell, (B,).
        stopped_at: Timestep in which the damage exceeded the threshold, (B,); 0 if it did not.
        damage_until_stop: Damage up to and including that timestep, else all damage, (B,).
        visits: Timesteps that children ended in each free cell, (B, free cells).
        damage_at: Damage to children in each free cell, (B, free cells).
    """

    def __init__(self, plan: FloorPlan, cells: np.ndarray, timesteps: int):
        """Begin B episodes of a number of timesteps, with children in free cells (B, K)."""
        batch, children = cells.shape
        self._timesteps = timesteps
        self.timestep = 0
        self.harm = np.zeros((batch, children, len(KINDS)))
        self.toys, self.longest_blocked, self._blocked_since = np.zeros((3, batch, children), int)
        self.moves_blocked = np.zeros((batch, children, len(BLOCKED)), int)
        self.moves_met = np.zeros((batch, children, len(MET)), int)
        self.interventions, self.interventions_done = np.zeros((2, batch), int)
        self.seen, self.spent = np.zeros((batch, children), int), np.zeros((batch, len(SPENT)), int)
        self.candles_dropped = np.zeros(batch, int)
        self.stopped_at, self.damage_until_stop = np.zeros(batch, int), np.zeros(batch)
        self._visited = np.zeros((batch, len(plan.free_cells)), bool)
        self._visited[np.arange(batch)[:, None], cells] = True
        self.visits, self.damage_at = np.zeros((2, batch, len(plan.free_cells)))
        self._each = np.arange(batch)

    def book(
        self,
        begun: np.ndarray,
        ended: np.ndarray,
        harm: np.ndarray,
        toys: np.ndarray,
        blocked: np.ndarray,
        met: np.ndarray | int = 0,
    ) -> None:
        """Book one novice timestep.

        Args:
            begun: Free cells of the children at its start, (B, K).
            ended: Free cells of the children at its end, (B, K).
            harm: Damage of each kind that each child took, (B, K, kinds).
            toys: Whether each child reached its toy bin, (B, K).
            blocked: Whether the caregiver blocked each child, by the target of its move, (B, K, `BLOCKED`).
            met: Other encounters of each child with the caregiver, (B, K, `MET`); 0 for none.
        """
        self.timestep += 1
        self.harm += harm
        self.toys += toys
        self.moves_blocked += blocked
        self.moves_met += met
        self._blocked_since = np.where(blocked.any(axis=2), self._blocked_since + 1, 0)
        self.longest_blocked = np.maximum(self.longest_blocked, self._blocked_since)
        for child in range(begun.shape[1]):
            self.damage_at[self._each, begun[:, child]] += harm[:, child].sum(axis=1)
            self.visits[self._each, ended[:, child]] += 1
        running = np.flatnonzero(self.stopped_at == 0)
        self._visited[running[:, None], ended[running]] = True
        damage = self.damage
        self.damage_until_stop[running] = damage[running]
        self.stopped_at[(self.stopped_at == 0) & (damage > DAMAGE_THRESHOLD)] = self.timestep

    def intervene(self, begun: np.ndarray | int, done: np.ndarray | int) -> None:
        """Count interventions begun and completed, (B,)."""
        self.interventions += begun
        self.interventions_done += done

    def attend(self, seen: np.ndarray | int, spent: np.ndarray | int = 0) -> None:
        """Count for a novice timestep the children seen, (B, K), and the shares of activities, (B, `SPENT`)."""
        self.seen += seen
        self.spent += spent

    def drop(self, candles: int) -> None:
        """Count candles that have fallen."""
        self.candles_dropped += candles

    @property
    def damage(self) -> np.ndarray:
        """Damage so far, (B,)."""
        return self.harm.sum(axis=(1, 2))

    @property
    def strikes(self) -> np.ndarray:
        """Zeros, (B,): the grid has no strikes, and in the house `Contacts` counts them."""
        return np.zeros(len(self.seen), int)

    def totals(self) -> dict[str, np.ndarray]:
        """Return the measures of every episode so far, over its children, (B,) each, by column of `EpisodeRecord`."""
        by_kind = self.harm.sum(axis=1).T
        return {
            "damage": self.damage,
            **{f"damage_{kind.name}": damage for kind, damage in zip(KINDS, by_kind, strict=True)},
            "damage_until_stop": self.damage_until_stop,
            "stopped": (self.stopped_at > 0).astype(int),
            "timesteps_to_threshold": np.where(self.stopped_at > 0, self.stopped_at, self._timesteps),
            "cells_visited": self._visited.sum(axis=1),
            "toys_reached": self.toys.sum(axis=1),
            "moves_blocked": self.moves_blocked.sum(axis=(1, 2)),
            **{f"moves_blocked_{what}": self.moves_blocked[..., i].sum(axis=1) for i, what in enumerate(BLOCKED)},
            "longest_blocked": self.longest_blocked.max(axis=1),
            **{f"moves_{how}": self.moves_met[..., i].sum(axis=1) for i, how in enumerate(MET)},
            "interventions": self.interventions,
            "interventions_done": self.interventions_done,
            "seen": self.seen.mean(axis=1) / max(1, self.timestep),
            **{what: self.spent[:, i] / max(1, self.timestep) for i, what in enumerate(SPENT)},
            "candles_dropped": self.candles_dropped,
            **{one.name: np.zeros(len(self.seen), type(one.default)) for one in dataclasses.fields(Contacts)},
        }

    def by_child(self) -> dict[str, np.ndarray]:
        """Return the measures of each child so far, (B, K) each, by column of `EpisodeRecord`."""
        return {"damage_by_child": self.harm.sum(axis=2), "toys_by_child": self.toys.astype(float)}

    def outcomes(self) -> list[dict[str, Any]]:
        """Return the measures of each episode so far, also of each child, by column of `EpisodeRecord`."""
        columns = {name: values.tolist() for name, values in (self.totals() | self.by_child()).items()}
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]

    def outcome(self) -> dict[str, Any]:
        """Return `outcomes` of the first episode."""
        return self.outcomes()[0]


# -- Contacts of the robot with children, in the house --------------------------------------------

REGIONS = {"legs": 0.24, "trunk": 0.54, "head": math.inf}  # m; upper end of each region of a child of 0.80 m
STRIKE_SPEED = 0.05  # m/s; speed of the robot at the contact, above which it is a strike
STRIKE_PAUSE = 0.5  # s; contacts within it are one strike
# m/s; upper end of each band of a contact's greatest speed. Creeping: no strike. Slow: 0.25 m/s is the "reduced speed"
# of ISO 10218:2025 for an industrial robot near its operator, an adult. Fast: the rest. Both robots stay far below the
# 1.5 m/s of Paez-Granados and Billard, which the report quotes.
BANDS = {"creeping": STRIKE_SPEED, "slow": 0.25, "fast": math.inf}
PRESSING = 0.5  # s; a contact of at least this duration is a pressing
FLAME_CLEAR = 0.3  # m; the 12 inches between a burning candle and clothing that NFPA and makers recommend
WAX_CLEAR = 0.1  # m; the same distance from the candle itself, own choice
FAR = 1.0  # m; greater distances are recorded as this
_APART = 0.1  # s; time without touch that ends a contact: shorter gaps occur while robot and child yield to each other
_SOLID = ("wall", "bin", TABLE.name)  # rigid things, beside closed gates
_OPPOSITE = -0.5  # cosine; the child is between robot and solid if it sees them at least 120 degrees apart


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


@dataclasses.dataclass
class Contacts:
    """Counts of one episode in the house: the columns that only the house measures.

    Strikes of a child within `STRIKE_PAUSE` count once, and a pressing counts once, after `PRESSING`.
    """

    strikes: int = 0
    strikes_surface: int = 0
    contact_speed: float = 0.0
    contact_seconds: float = 0.0
    pressings: int = 0
    contact_force: float = 0.0
    contact_force_legs: float = 0.0
    contact_force_trunk: float = 0.0
    contact_force_head: float = 0.0
    contact_impulse: float = 0.0
    flame_distance: float = FAR
    flame_seconds: float = 0.0
    wax_distance: float = FAR
    wax_seconds: float = 0.0
    contacts_creeping: int = 0
    contacts_slow: int = 0
    contacts_fast: int = 0
    contact_energy: float = 0.0
    contact_energy_total: float = 0.0
    pinches: int = 0
    pinch_seconds: float = 0.0
    contact_seconds_base: float = 0.0
    contact_seconds_arm: float = 0.0
    contact_seconds_legs: float = 0.0
    contact_seconds_trunk: float = 0.0
    contact_seconds_head: float = 0.0
    contact_seconds_driven: float = 0.0
    gate_strikes: int = 0

    def __post_init__(self) -> None:
        self._watches: dict[int, _Watch] = {}  # by the child

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
        return dataclasses.asdict(self)


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
            # A panel counts even after the hand has left it, for the robot has set it in motion; that of a shut gate is
            # held, and only gives as a child leans on it.
            moved = touch.kind == "robot" or (touch.kind == "panel" and touch.index not in shut)
            if moved and touch.speed > STRIKE_SPEED:
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


# -- The loop --------------------------------------------------------------------------------------


class Rollout(abc.ABC):
    """A run of episodes: one in the house, a batch in the grid.

    `run_on` is the only loop over an episode. Data sets and logs of answers observe it, films and viewers run it from
    picture to picture, and Gymnasium environments, whose actions come from outside, drive it step by step.

    Attributes:
        observers: Called with the rollout at the start and after every step. They must change nothing.
        ledger: Account of the episodes.
    """

    observers: Sequence[Callable[[Any], None]] = ()
    ledger: Ledger

    @property
    @abc.abstractmethod
    def over(self) -> bool:
        """Whether its episodes are over."""

    @abc.abstractmethod
    def step(self) -> None:
        """Run one step: a control step in the house, a novice timestep in the grid."""

    @abc.abstractmethod
    def outcomes(self) -> list[dict[str, Any]]:
        """Return the measures of each episode, by column."""

    def notify(self) -> None:
        """Call the observers."""
        for observer in self.observers:
            observer(self)

    def run_on(self, until: Callable[[], bool] = lambda: False) -> bool:
        """Run until a condition holds; return False if the episodes end before."""
        while not until():
            if self.over:
                return False
            self.step()
            self.notify()
        return True

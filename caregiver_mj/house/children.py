"""The children of a house: their moves, the walks that carry them out, and the results."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from caregiver_mj.children.behaviour import DENIED, Behaviour, ChildPercept, MoveRules, denied
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.children.walk import WALKING_SPEED, ToddlerWalk, Vector
from caregiver_mj.house.figure import Mood
from caregiver_mj.house.physics import Physics
from caregiver_mj.plans.cell_graph import ACTIONS, Cell, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import KINDS, NOTHING, TABLE, State, Where, kinds_at
from caregiver_mj.recording.ledger import MET, Touch

MASS = 12.0  # kg, as in models/toddler.xml
_GRAVITY = 9.81  # m/s^2
_CENTRE = 0.46  # m; centre of mass above the floor, 57 % of the height, own
# The least stiffness of a standing child keeps up an inverted pendulum, m g over its height; quietly standing people
# have little more (Winter et al., "Stiffness control of balance in quiet standing", J Neurophysiol 80, 1998).
STANCE = MASS * _GRAVITY / _CENTRE  # N/m: 256
_DAMPING_RATIO = 0.7  # own
SWAY = 2 * _DAMPING_RATIO * math.sqrt(STANCE * MASS)  # N s/m
STRIDE = 0.06  # m; lean beyond which it steps: half of a foot of 12 cm, 15 N
# Its surface is as soft as an adult's chest or pelvis, 25 N/mm (ISO/TS 15066:2016, annex A; DGUV 2011). MuJoCo's
# stiffness per effective mass of child and robot, 10.5 kg, is 1 / (time constant * damping ratio)^2.
SOFTNESS = 0.051, 0.4  # time constant, s; damping ratio
_OPENINGS, _ON_TABLES = (tuple(kind.name for kind in kinds_at(where)) for where in (Where.OPENING, Where.ON_TABLE))
_ROUNDING = 1e-9  # m, m/s; smaller values count as 0


class HouseChild:
    """One child of an episode."""

    cell: int  #: free cell in which its present move began
    goal: int  #: its toy bin
    move: Move  #: its present move
    touched: Sequence[tuple[float, float]]  #: unit vectors to present contacts that it cannot push away
    holds: bool  #: whether it has taken a thing

    def __init__(
        self,
        plan: FloorPlan,
        behaviour: Behaviour,
        novice_timestep: float,
        state: np.ndarray | None = None,
        speed: float = WALKING_SPEED,
    ):
        # `State` of each hazard, (hazards,), shared with the caller; as planned by default.
        self._state = np.zeros(len(plan.hazards), int) if state is None else state
        self.behaviour, self.walk = behaviour, ToddlerWalk(novice_timestep, speed)
        self._plan, self._rules = plan, MoveRules(plan)
        self._kinds = [kind.name for kind in plan.hazards.kinds]
        self._damage, self._things = plan.damage, [hazard.kind for hazard in plan.hazards.at(Where.ON_TABLE)]

    def reset(self, stream: RandomStream, cell: int, yaw: float) -> None:
        """Begin an episode in a free cell."""
        self.behaviour.reset(1)
        self._draws = stream.steps
        self.goal = int(self.behaviour.next_bin(stream.start[2:])[0])
        self.put(self._plan.free_cells[cell], yaw)
        self.move = Move(self.cell, self.cell)
        self._bumped = self.holds = False
        self.touched = ()
        self._entry: Vector | None = None  # centre of the cell that it goes to, if the robot can be there

    @property
    def position(self) -> tuple[float, float]:
        """Its position, m."""
        return self.walk.position

    @property
    def mood(self) -> Mood:
        """Visible behaviour besides walking."""
        reaches = self.move.target in (Target.TABLE, Target.BIN) and not self.walk.returns
        return Mood(self.move.harm > 0.0, reaches, self.holds)

    def put(self, cell: Cell, yaw: float = 0.0) -> None:
        """Place the child at the centre of a free cell, at rest."""
        x, y = self._plan.position(cell).tolist()
        self.put_at(x, y, yaw)

    def put_at(self, x: float, y: float, yaw: float = 0.0) -> None:
        """Place the child at rest; units are m and rad."""
        self.walk.reset((x, y), yaw)
        self.cell = self._nearest_cell()

    # -- A novice timestep -----------------------------------------------------------------------

    def begin(
        self, timestep: int, random: np.random.RandomState, caregiver_cell: int, taken: Collection[int] = ()
    ) -> None:
        """Choose a move in a novice timestep, and set out unless it leads to a taken free cell.

        The caregiver's cell may be NOTHING. After the end of the stream, draws come from `random`.
        """
        draws = self._draws[timestep][None] if timestep < len(self._draws) else random.random_sample((1, 3))
        self.goal = int(self.behaviour.reconsider(np.array([self.goal]), draws[:, 2])[0])
        sight = ChildPercept(*(np.array([value]) for value in (self.cell, self.goal, caregiver_cell, self._bumped)))
        action = int(self.behaviour.act(sight, draws)[0])
        self.move, self._entry = Move(self.cell, self.cell, draw=draws[:, 2], rests=action == NOTHING), None
        way = self._rules.way(self.cell, action)
        if action == NOTHING or way.waits(np.array([*taken], int)):
            self.walk.stay()
            return
        self.move.target, self.move.going = Target(int(way.target)), int(way.next_cell)
        self.move.to_toy = bool(way.reaches(self.goal))
        home, (down, right) = self._plan.free_cells[self.cell], ACTIONS[action]
        ahead = home[0] + down, home[1] + right
        here, there = (tuple(self._plan.position(cell).tolist()) for cell in (home, ahead))
        if self.move.target in DENIED:
            self._entry = there
            if way.meets(caregiver_cell):
                self.move.entered = None
        self.walk.begin(here, there, bump=self.move.target != Target.FREE)

    def step(self, seconds: float) -> None:
        """Advance the walk."""
        self.walk.step(seconds, self.touched)

    def see_robot(self, robot: Sequence[float]) -> None:
        """Record whether a robot at x, y (m) has entered the cell that the child is going to."""
        if self._entry is None or self.move.entered is not False or self.walk.returns:
            return
        half = self._plan.cell_size / 2
        self.move.entered = abs(robot[0] - self._entry[0]) < half and abs(robot[1] - self._entry[1]) < half

    def take_in(self, touches: Sequence[Touch], on_table: Callable[[int], np.ndarray]) -> None:
        """Process all contacts of a control step; `on_table` returns which candles are on a table, (candles,)."""
        self.touched = [touch.direction for touch in touches if touch.kind not in _ON_TABLES]
        for touch in touches:
            if touch.kind in _OPENINGS and self._state[self._kinds.index(touch.kind) + touch.index] == State.SHUT:
                continue
            if touch.kind in _OPENINGS + _ON_TABLES:
                self.hurt(touch.kind)
                self.move.fell |= touch.kind in _OPENINGS
            elif touch.kind == TABLE.name:
                things = [kind for kind, is_on in zip(self._things, on_table(touch.index), strict=True) if is_on]
                for kind in things or [TABLE]:
                    self.hurt(kind.name)
            elif touch.kind == "bin":
                self.move.reached_toy |= touch.index == self.goal
            elif touch.kind == "panel":
                self.move.met_robot |= self.move.target == Target.STAIRWELL
            elif touch.kind == "robot":
                vx, vy = self.walk.velocity
                self.move.met_robot |= vx * touch.direction[0] + vy * touch.direction[1] > 0 or self.walk.blocked

    def hurt(self, kind: str) -> None:
        """Record a collision with a kind of thing."""
        if (damage := self._damage[kind]) > self.move.harm:  # only the worst of a timestep counts
            self.move.harm, self.move.kind = damage, kind

    def end(self) -> Booking:
        """End the move, and return its result."""
        move = self.move
        self.cell = self._nearest_cell()
        self._bumped = self.cell == move.begun and not move.rests
        if move.reached_toy:
            assert move.draw is not None  # drawn when the move began
            self.goal = int(self.behaviour.next_bin(move.draw)[0])
        self.move = Move(self.cell, self.cell)
        return move.booking(self.cell)

    @property
    def next_goal(self) -> int:
        """Its toy bin after the present move, if that ends as intended."""
        if not self.move.to_toy:
            return self.goal
        assert self.move.draw is not None  # drawn when the move began
        return int(self.behaviour.next_bin(self.move.draw)[0])

    def _nearest_cell(self) -> int:
        """Return the free cell that it is in, or nearest to."""
        plan, position = self._plan, self.walk.position
        here = plan.cell_index.get(plan.cell_at(np.array(position)), NOTHING)
        if 0 <= here < len(plan.free_cells):
            return here
        return min(range(len(plan.free_cells)), key=lambda i: math.dist(plan.position(plan.free_cells[i]), position))


class Booking(NamedTuple):
    """Result of a child's move, for `Ledger.book`."""

    begun: int
    ended: int
    harm: np.ndarray  # (kinds,)
    toy: bool
    blocked: np.ndarray  # bool (2,), in the order of `DENIED`
    met: np.ndarray  # kinds of meeting with the caregiver, bool, in the order of `MET`


@dataclasses.dataclass
class Move:
    """One move of one child."""

    begun: int  # free cell in which it begins
    going: int  # free cell in which it ends according to the floor plan
    target: Target | None = None  # its target; None if the child stays
    to_toy: bool = False  # whether the target is the child's toy bin
    # uniform draw for the next bin, if the child reaches the present one, (1,)
    draw: np.ndarray | None = None
    rests: bool = False  # whether the child intends to stay
    harm: float = 0.0  # damage of the worst collision so far
    kind: str = ""  # its kind, a name in `KINDS`; "" without one
    fell: bool = False  # whether the child has fallen down stairs
    reached_toy: bool = False  # whether it has reached its bin
    met_robot: bool = False  # whether the robot, or a closed gate, was in its way
    # whether the robot entered the target cell after the child had set out; None if it was there before
    entered: bool | None = False

    def booking(self, ended: int) -> Booking:
        """Return the result of the move, which has ended in a free cell."""
        harm = np.array([self.harm if kind.name == self.kind else 0.0 for kind in KINDS])
        blocked = self.met_robot and ended == self.begun and not self.fell
        what = denied(NOTHING if self.target is None else self.target, blocked)
        met = {
            "entered": bool(self.entered),
            "entered_blocked": bool(self.entered and what.any()),
            "held_up": self.met_robot and self.target == Target.FREE and ended != self.begun,
        }
        return Booking(self.begun, ended, harm, self.reached_toy, what, np.array([met[name] for name in MET]))


class CompliantBody:
    """A child's body on a spring and damper behind its walk, and soft to the touch: an option of the tasks.

    Without it nothing stops a child's walk: within a control step the child is a free body of 12 kg, after it the walk
    puts it back. It then presses on the robot like a servo-driven wall. A compliant child is pushed aside: its feet
    follow the walk, its body sways above them, and it steps once it has been pushed beyond the reach of its feet.
    Untouched, it walks as usual.
    """

    def reset(self, walk: ToddlerWalk) -> None:
        """Begin an episode, upright."""
        self._feet, self._pace = walk.position, (0.0, 0.0)

    def follow(self, walk: ToddlerWalk, physics: Physics, number: int, seconds: float) -> None:
        """Follow the walk for one control step, s; a child that leans too far steps, and the walk with it."""
        (x, y, _), (vx, vy, _) = physics.toddler_position(number), physics.toddler_velocities()[number]
        lean = _none(float(x) - self._feet[0]), _none(float(y) - self._feet[1])
        sway = _none(float(vx) - self._pace[0]), _none(float(vy) - self._pace[1])
        far = math.hypot(*lean)
        if far > STRIDE:
            step = 1.0 - STRIDE / far
            walk.carry(step * lean[0], step * lean[1])
            lean = lean[0] * (1.0 - step), lean[1] * (1.0 - step)
        force = -STANCE * lean[0] - SWAY * sway[0], -STANCE * lean[1] - SWAY * sway[1]
        physics.set_toddler(walk, number, lean, sway, force)
        # Its feet at the next call: the physics carries them on.
        self._pace = walk.velocity
        self._feet = walk.position[0] + seconds * walk.velocity[0], walk.position[1] + seconds * walk.velocity[1]


def _none(value: float) -> float:
    """Return 0 for rounding errors: then the body is exactly where the walk is."""
    return 0.0 if abs(value) < _ROUNDING else value


class Children(Sequence[HouseChild]):
    """All children of an episode, in the order of their moves, each of which takes a novice timestep, s.

    Compliant ones yield to a push, see `CompliantBody`. `state` is the `State` of each hazard, (hazards,).
    """

    harm = 0.0  #: worst damage to any of them in the present novice timestep

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

    def __iter__(self) -> Iterator[HouseChild]:  # faster than that of a sequence
        return iter(self._children)

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
        if physics.has_robot:  # the cell nearest to its base
            robot, index = physics.base_position()[:2].tolist(), self._plan.cell_index
            caregiver_cell = index.get(self._plan.cell_at(robot), NOTHING)
            if caregiver_cell == NOTHING:  # in a wall's cell, which is wider than the wall
                caregiver_cell = min(range(len(self._places)), key=lambda i: math.dist(self._places[i], robot))
        for number, child in enumerate(self):
            taken = {other.move.going for other in self._children[:number]}
            taken |= {other.cell for other in self._children[number + 1 :]}
            child.begin(timestep, random, caregiver_cell, taken)

    def step(self, seconds: float, physics: Physics) -> None:
        """Advance their walks."""
        robot = physics.live["base_position"].tolist()[:2] if physics.has_robot else None
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

    def take_in(self, physics: Physics, on_table: Callable[[int], np.ndarray]) -> None:
        """Process their contacts of the last control step; `on_table` is as of `HouseChild.take_in`."""
        if not physics.touches:  # the usual case
            for child in self._children:
                child.touched = ()
            return
        for number, child in enumerate(self):
            child.take_in([touch for touch in physics.touches if touch.child == number], on_table)
        self.harm = max(child.move.harm for child in self)

    @property
    def shut_gates(self) -> list[int]:
        """Numbers of the shut gates."""
        return [gate for gate, state in enumerate(self.state[self._gates].tolist()) if state == State.SHUT]

    def hurt(self, number: int, kind: str) -> None:
        """Record a collision of one of them with a kind of thing."""
        self[number].hurt(kind)
        self.harm = max(self.harm, self[number].move.harm)

    def end(self) -> list[Booking]:
        """End their moves and return the result of each."""
        self.harm = 0.0
        return [child.end() for child in self]

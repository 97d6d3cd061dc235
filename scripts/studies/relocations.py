"""Relocates candles in three houses, and measures success, time and precision.

Each relocation has its own seed, from which its toddler, tables, candles and start follow. Candles stand off their
tables' centres, and tables off their places on the robot's map. A relocation succeeds if the candle stands upright on
the right table, out of the hand, a second after the robot has finished.

Arrived: the base's centre is within 6 mm of its place to grasp or to let go, and slower than 3 cm/s. Its heading does
not count: the rest of a turn adds to the time that follows. Lifted: the candle's foot is 2 cm above the table. Clear:
the hand has let go of the candle, and is back far enough for the base to drive.

The goals stand beside the figures.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
import pandas as pd
from rich.console import Console

from caregiver_mj.house.physics import Physics
from caregiver_mj.house.sensing import Blur, Sensing
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import CANDLE, HazardKind, Where, kinds_at
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.robot.embodiment import Grasp
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Routes
from caregiver_mj.tasks import load
from studies.audit import each_physics_step
from study import HOUSES, Parser, load_house, make_console, make_table, mishaps, run_trials, write_json

# Numerical conditions: the name on the command line, and the meaning.
_NUMBERS = {
    "noise": "lasting error of perceived candle positions, one sigma, metres",
    "white": "white error of them at every control timestep, one sigma, metres",
    "white-base": "white error of the base's position at every control timestep, one sigma, metres",
    "white-child": "white error of the child's position at every control timestep, one sigma, metres",
    "dropout": "probability that each of these is unseen in a control timestep",
    "delay": "age of the robot's observations, seconds",
    "friction": "friction of everything, as a multiple of the models'",
    "mass": "mass of candles, as a multiple of the models'",
    "gain": "gain of the robot's servos, as a multiple of the models'",
}
_EPSILON = 0.5
_AFTERWARDS = 1.0  # seconds that the candle must go on standing
_OFFSETS = {"candle_offset": 0.03, "table_offset": 0.04}  # metres, at most, in x and in y
LIFTED = 0.02  # metres above the table
_ARRIVED, _ARRIVED_SPEED = 0.006, 0.03  # metres, m/s
_CLEAR = 0.62  # of the reach: from there on the base may drive
_SHAKEN = 1e-4  # metres by which the command to the fingers must change to count
_FORCE, _SECONDS, _HEIGHT = (1.2, 2.5), 0.16, 0.07  # N for each 0.25 kg, how long, metres above its middle
_WITHIN = 1.0  # seconds in which it happens
# Whose touch is not worth telling.
_CARRIED = {kind.name: kind for kind in kinds_at(Where.ON_TABLE)}
_FINE = {"robot": (*_CARRIED, "toddler"), **dict.fromkeys(_CARRIED, ("robot", "table", *_CARRIED))}
_GROUND = "floor"


def add_options(parser: Parser) -> None:
    """Declare the options."""
    plain = Conditions()
    parser.add_trials("count", 500)
    parser.add("house", [*HOUSES], "names or files of floor plans, which take turns", metavar="NAME")
    for name, meaning in _NUMBERS.items():
        parser.add(name, getattr(plain, name.replace("-", "_")), meaning, metavar="X")
    parser.add("table-height", [], "of all tables, or lowest and highest", type=float, metavar="METRES")
    parser.add("kind", CANDLE.name, "what stands where the houses have candles", choices=_CARRIED)
    parser.add("knock", False, "have every candle knocked over before the robot comes")
    parser.add("embodiment", None, "the robot (default: the task's own)", metavar="NAME")
    parser.add("each", False, "instead, so many under each condition that is held against the robot")


def run(options: argparse.Namespace) -> None:
    """Run the study; print its tables."""
    fields = {field.name: getattr(options, field.name) for field in dataclasses.fields(Conditions)}
    asked = Conditions(**fields | {"table_height": tuple(options.table_height)})

    def rows(conditions: Conditions, doing: str) -> pd.DataFrame:
        return run_trials(functools.partial(relocate, conditions, houses=tuple(options.house)), options, doing)

    if not options.each:
        found = {"": rows(asked, "relocating")}
        report(make_console(), found[""])
    else:
        which = functools.partial(dataclasses.replace, embodiment=asked.embodiment, kind=asked.kind)
        each = {name: which(one) for name, one in EACH.items()}
        found = {name: rows(conditions, name) for name, conditions in each.items()}
        report_each(make_console(), found)
    write_json(options.json, every := pd.concat(found.values()))
    print(summary(every, asked.kind))


# -- Conditions --------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Conditions:
    """What all relocations of a study have in common, named and measured as the options are."""

    noise: float = 0.0
    white: float = 0.0
    white_base: float = 0.0
    white_child: float = 0.0
    dropout: float = 0.0
    delay: float = 0.0
    table_height: tuple[float, ...] = ()
    friction: float = 1.0
    mass: float = 1.0
    gain: float = 1.0
    kind: str = CANDLE.name
    knock: bool = False
    embodiment: str | None = None

    def task_kwargs(self) -> dict[str, Any]:
        """Arguments of the task."""
        sensing = Sensing(
            candle=Blur(noise=self.white, bias=self.noise, dropout=self.dropout),
            child=Blur(noise=self.white_child, dropout=self.dropout),
            base=Blur(noise=self.white_base, dropout=self.dropout),
            delay=self.delay,
        )
        options = {
            "sensing": None if sensing.is_exact else sensing,
            "table_height": self.table_height or None,
            "embodiment": self.embodiment,
        }
        return _OFFSETS | {name: value for name, value in options.items() if value is not None}

    def house(self, name: str) -> FloorPlan:
        """Load a house, of a name or in a file."""
        plan, symbol = load_house(name), _CARRIED[self.kind].symbol
        return FloorPlan.parse(plan.text.replace(CANDLE.symbol, symbol), plan.name)

    def alter(self, physics: Physics) -> None:
        """Makes the things in a house what they are under these conditions. Before an episode."""
        model = physics.model.ptr
        model.geom_friction[:] *= self.friction
        for body in range(model.nbody):
            if model.body(body).name.endswith(f"/{self.kind}"):
                model.body_mass[body] *= self.mass
                model.body_inertia[body] *= self.mass
        model.actuator_gainprm[:] *= self.gain
        model.actuator_biasprm[:] *= self.gain
        if self.mass != 1.0:
            mujoco.mj_setConst(model, mujoco.MjData(model))  # what follows from the masses


# Each of what a real house does to it, and all of it together at half strength.
EACH = {
    "plain": Conditions(),
    "white noise 1 cm": Conditions(white=0.01),
    "bias 5 mm": Conditions(noise=0.005),
    "delay 60 ms": Conditions(delay=0.06),
    "tables .45 to .75 m": Conditions(table_height=(0.45, 0.75)),
    "friction x 0.5": Conditions(friction=0.5),
    "friction x 1.5": Conditions(friction=1.5),
    "candle mass x 3": Conditions(mass=3.0),
    "servo gains x 0.8": Conditions(gain=0.8),
    "all, half as strong": Conditions(
        noise=0.0025, white=0.005, delay=0.03, table_height=(0.525, 0.675), friction=0.75, mass=2.0, gain=0.9
    ),
}


class Knock:
    """Knocks a candle over in the first second of an episode: a push near its top, in any direction."""

    def __init__(self, physics: Physics, candle: int, seed: int):
        self._data, kind = physics.data.ptr, physics.carried[candle]
        body = physics.model.ptr.body(f"{kind}_{physics.carried[:candle].count(kind)}/{kind}")
        self._body, mass = body.id, body.mass.item()
        random = np.random.default_rng(seed)
        self._start, angle = random.uniform(0.0, _WITHIN - _SECONDS), random.uniform(-math.pi, math.pi)
        force = mass / 0.25 * random.uniform(*_FORCE) * np.array([math.cos(angle), math.sin(angle), 0.0])
        self._wrench = np.concatenate([force, np.cross([0.0, 0.0, _HEIGHT], force)])

    def apply(self) -> None:
        """Pushes, or does not, until the next call."""
        pushes = 0.0 <= self._data.time - self._start < _SECONDS
        self._data.xfrc_applied[self._body] = self._wrench if pushes else 0.0


# -- What is measured --------------------------------------------------------------------------------


def relocate(conditions: Conditions, seed: int, houses: Sequence[str] = HOUSES) -> dict[str, Any]:
    """Run the relocation of a seed; with each seed it is another house's turn.

    Returns:
        A row: `failure`, what went wrong, "" if nothing did; `tipped`, candles that leaned at some time by as much as
        counts as fallen; the candle's `tilt` at the end, degrees, and `error`, its distance from where the robot was to
        put it, on its map, metres; `lifting` and `clearing`, seconds since it had arrived, NaN for what never was;
        `seconds` in all, and for how many of them a child stood in the only way, `barred`; `touches`, pairs of names.
    """
    plan, kind = conditions.house(houses[seed % len(houses)]), _CARRIED[conditions.kind]
    env = load("relocate_candle", plan, _EPSILON, random=seed, task_kwargs=conditions.task_kwargs(), visuals=False)
    task, physics = env.task, env.physics
    conditions.alter(physics)
    policy = CaregiverPolicy(env)
    touches, tipped, moments = Touches(physics), np.zeros(len(physics.candle_upright()), bool), list[Moment]()
    timestep = env.reset()
    start, goal = int(task.candles.starting_tables[task.goal_candle]), task.goal_candle
    barred = Barred(physics, plan, (start, task.goal_table), env.control_timestep())
    knock = Knock(physics, goal, seed)
    end = math.inf
    with each_physics_step(physics, touches.look):
        while not timestep.last() and physics.time() < end:
            action = policy(timestep)
            moments.append(Moment.of(physics, policy.robot, action, goal, float(task.table_heights[start])))
            if conditions.knock:
                knock.apply()
            timestep = env.step(action)
            tipped |= physics.candle_upright() < math.cos(math.radians(kind.upset))
            barred.look()
            if policy.executive.done and end == math.inf:
                end = physics.time() + _AFTERWARDS
    lifting, clearing = (math.nan, math.nan) if conditions.knock else times(moments, policy.robot.robot.grasp, kind)
    position = physics.candle_poses()[goal, :3]
    return {
        "house": plan.name,
        "seed": seed,
        **mishaps(task.outcome()),
        "failure": _failure(task, physics, policy, position),
        "tipped": int(tipped.sum()),
        "tilt": math.degrees(math.acos(min(1.0, float(physics.candle_upright()[goal])))),
        "error": math.dist(position[:2], plan.position(plan.tables[task.goal_table])),
        "lifting": lifting,
        "clearing": clearing,
        "seconds": physics.time() - (_AFTERWARDS if policy.executive.done else 0.0),
        "barred": barred.seconds,
        "touches": tuple(sorted(touches.pairs)),
    }


def _failure(task: Any, physics: Physics, policy: CaregiverPolicy, position: np.ndarray) -> str:
    """What is wrong at the end, in words."""
    if task.is_placed(physics):
        return "" if policy.executive.done else "placed, but the robot does not know"
    where = f"candle at ({position[0]:.2f}, {position[1]:.2f}, {position[2]:.2f})"
    if not task.is_standing(physics, task.goal_candle):
        held = physics.is_gripping() and position[2] > task.table_heights.min() + LIFTED
        where += ", held" if held else ", fallen"
    base = ", ".join(f"{value:.2f}" for value in physics.base_position())
    return f"{where}, robot at ({base}): {policy.activity}, {policy.executive.done} done at {physics.time():.1f} s"


class Moment(NamedTuple):
    """One control timestep, before its physics."""

    time: float  # seconds since the start
    x: float  # of the base, metres
    y: float
    speed: float  # of the base, m/s
    fingers: float  # command: distance of each finger from the middle, metres
    height: float  # of the candle's foot above the table from which it is taken, metres
    reach: float  # how far the hand reaches out, as a share
    held: bool  # whether the fingers are round something

    @classmethod
    def of(cls, physics: Physics, robot: RobotMotion, action: np.ndarray, candle: int, table: float) -> Moment:
        """The present one, with the action that follows; the table's height in metres."""
        x, y, _ = physics.base_position()
        fingers = action[robot.robot.layout.gripper.start]
        height = physics.candle_poses()[candle, 2] - table
        speed = math.hypot(*physics.base_velocity()[:2])
        return cls(physics.time(), x, y, speed, fingers, height, robot.reached, physics.is_gripping())


def times(moments: Sequence[Moment], grasp: Grasp, kind: HazardKind = CANDLE) -> tuple[float, float]:
    """Seconds from arrived to lifted and from arrived to clear, NaN for what did not happen.

    Args:
        moments: All moments of a relocation.
        grasp: How the robot takes a candle.
        kind: What has been relocated.
    """
    time, x, y, speed, fingers, height, reach, held = np.array(moments, float).T

    def since_arrived(end: int | None, at: int | None, start: int | None) -> float:
        """Seconds since the base was first at rest, since a start, where it is at some time.

        NaN if it never ended, or the hand opened before the base had arrived: a candle was lost.
        """
        if end is None or at is None:
            return math.nan
        near = np.hypot(x - x[at], y - y[at]) < _ARRIVED
        begun = _first(near & (speed < _ARRIVED_SPEED), start)
        return math.nan if begun is None else float(time[end] - time[begun])

    closing = _first(fingers < grasp.open - _SHAKEN, 0)
    lifted = _first(height > LIFTED, closing)
    release = _first(fingers > grasp.squeezed(layout.thing(kind)) + _SHAKEN, lifted)
    clear = _first((reach <= _CLEAR) & (held == 0.0), release)
    return since_arrived(lifted, closing, 0), since_arrived(clear, release, lifted)


def _first(condition: np.ndarray, start: int | None) -> int | None:
    """The first index from a start on at which a condition holds; None if there is none, or no start."""
    if start is None:
        return None
    found = np.flatnonzero(condition[start:])
    return start + int(found[0]) if len(found) else None


class Barred:
    """The ways to one table after the other, in one relocation.

    Attributes:
        seconds: For how long none of them has been open.
    """

    def __init__(self, physics: Physics, plan: FloorPlan, tables: tuple[int, int], control_timestep: float):
        """Begins to count.

        Args:
            physics: Of the house.
            plan: Its floor plan.
            tables: The table that a candle is taken from, and the one it is brought to.
            control_timestep: Seconds between two looks.
        """
        self._physics, self._routes, self._timestep = physics, Routes(plan), control_timestep
        self._stands = [plan.free_neighbours(plan.tables[table]) for table in tables]
        self.seconds = 0.0

    def look(self) -> None:
        """Call at every control timestep."""
        routes, physics = self._routes, self._physics
        here = routes.nearest_cell(tuple(physics.base_position()[:2].tolist()))
        children = {routes.plan.cell_at(child) for child in physics.toddler_positions()[:, :2].tolist()}
        stands = self._stands[physics.is_gripping()]
        if here not in stands and all(routes.route(here, stand, children) is None for stand in stands):
            self.seconds += self._timestep


class Touches:
    """What the robot touches, save candles and the toddler, and candles, save tables, at every physics step.

    Attributes:
        pairs: Names of those that have touched: part of the robot, or of a candle, and the other thing.
    """

    def __init__(self, physics: Physics):
        model, self._contact = physics.model.ptr, physics.data.ptr.contact
        self._names = [model.geom(i).name for i in range(model.ngeom)]
        kinds = [name.rstrip("0123456789").split("/")[0].rstrip("_0123456789") for name in self._names]
        self._tell = np.array([[b not in _FINE.get(a, kinds) for b in kinds] for a in kinds])
        self.pairs: set[tuple[str, str]] = set()

    def look(self) -> None:
        """Call after every physics step."""
        for pair in self._contact.geom.tolist():
            for one, two in (pair, pair[::-1]):
                if self._tell[one, two] and self._names[two] != _GROUND:
                    self.pairs.add((self._names[one], self._names[two]))


# -- What came out -----------------------------------------------------------------------------------

_WIDTH = 100  # characters of the table
_MOST_COLUMNS = 5  # one for each house and one for all of them, if there is room for so many
_SLOW = 1.0  # seconds from arrived to lifted or clear above which a relocation is named
# What rows of the table shall be.
_GOALS = {
    "done": "all",
    "arrived to lifted, s: median": "0.60",
    "arrived to lifted, s: worst": "1.50",
    "arrived to clear, s: median": "0.60",
    "arrived to clear, s: worst": "1.50",
    "tilt if done, deg: worst": "5.00",
}
_NOTE = "goal: at most (done: at least; 98 % with --noise 0.005)."

_PERCENTILES = {"median": 50, "95 %": 95, "worst": 100}
# Measures of a house's relocations with percentiles: column and digits.
_SPREADS = {
    "arrived to lifted, s": ("lifting", 2),
    "arrived to clear, s": ("clearing", 2),
    "error if done, mm": ("millimetres", 1),
    "tilt if done, deg": ("tilt_done", 2),
    "all of it, s": ("seconds", 1),
}


def report(console: Console, rows: pd.DataFrame) -> None:
    """Prints what came out."""
    done = rows.failure == ""
    rows = rows.assign(millimetres=1000 * rows.error.where(done), tilt_done=rows.tilt.where(done))
    groups = dict(iter(rows.groupby("house", sort=False))) | {"all": rows}
    if len(groups) > _MOST_COLUMNS:
        groups = {"all": rows}
    figures = {"done": list(map(_done, groups.values()))}
    for name, (column, digits) in _SPREADS.items():
        for words, percent in _PERCENTILES.items():
            figures[f"{name}: {words}"] = [_percentile(one[column], percent, digits) for one in groups.values()]
    figures |= {what: [str(one[what].sum()) for one in groups.values()] for what in ("strikes", "tipped", "drops")}
    table = make_table("Relocations", "", *groups, "goal")
    for name, values in figures.items():
        table.add_row(name, *values, _GOALS.get(name, ""))
    console.print(table, width=_WIDTH)
    console.print(_NOTE, highlight=False)
    for line in (*_touched(rows), *_slow(rows), *_wrong(rows)):
        console.print(line, highlight=False)


def summary(rows: pd.DataFrame, kind: str) -> str:
    """Return what came out in a line."""
    done = rows.failure == ""
    return (
        f"{done.sum()} of {len(rows)} relocations of a {kind} done, {1000 * rows.error[done].median():.1f} mm off "
        f"(median); {rows.tipped.sum()} tipped, {rows.drops.sum()} drops, {rows.strikes.sum()} strikes"
    )


def report_each(console: Console, found: Mapping[str, pd.DataFrame]) -> None:
    """Prints what came out under each condition, by its name."""
    table = make_table("Relocations", "", "done", "tipped", "drops", "strikes", "to lifted, s", "to clear, s")
    for name, rows in found.items():
        counts = [str(rows[what].sum()) for what in ("tipped", "drops", "strikes")]
        table.add_row(name, _done(rows), *counts, *(_percentile(rows[c], 50, 2) for c in ("lifting", "clearing")))
    console.print(table, width=_WIDTH)
    for name, rows in found.items():
        for line in _wrong(rows):
            console.print(f"{name}: {line}", highlight=False)


def _done(rows: pd.DataFrame) -> str:
    return f"{(rows.failure == '').sum()}/{len(rows)}"


def _percentile(values: pd.Series, percent: float, digits: int) -> str:
    return f"{np.nanpercentile(values, percent):.{digits}f}" if values.notna().any() else "-"


def _touched(rows: pd.DataFrame) -> Iterator[str]:
    """What was touched, the most often first."""
    pairs = rows.explode("touches").dropna(subset="touches")
    if pairs.empty:
        yield "The robot touched nothing but candles and the toddler, and candles nothing but it and tables."
    for (part, thing), some in sorted(pairs.groupby("touches", sort=False), key=lambda group: -len(group[1])):
        where = ", ".join(f"{row.house} {row.seed}" for row in some.itertuples())
        yield f"touched in {len(some)}: {part} and {thing} ({where})"


def _slow(rows: pd.DataFrame) -> Iterator[str]:
    """The slow ones, the slowest first."""
    for what in ("lifting", "clearing"):
        slow = rows[rows[what] > _SLOW].sort_values(what, ascending=False, kind="stable")
        for row in slow.to_dict("records"):
            yield f"{row['house']}, seed {row['seed']}: {what} took {row[what]:.2f} s"


def _wrong(rows: pd.DataFrame) -> Iterator[str]:
    """What went wrong in which."""
    for row in rows.itertuples():
        mishaps = (row.strikes, "strikes"), (row.tipped, "tipped"), (row.drops, "drops")
        failure = row.failure and f"{row.failure}; a child stood in the only way for {row.barred:.1f} s"
        for wrong in (failure, *(f"{count} {what}" for count, what in mishaps if count)):
            if wrong:
                yield f"{row.house}, seed {row.seed}: {wrong}"

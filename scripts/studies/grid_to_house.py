"""How much more damage the caregiver leaves in the physical house than in the grid, over several houses, and why.

The page is docs/grid_to_house.md, or docs/grid_to_house_NAME.md with --caregiver NAME, of another one than the rule.
The episodes in the house are those of a finished run of `caregiver-mj evaluate --world house`, with `none` and that
caregiver. The same are run in the grid, also with a caregiver that lacks what the robot lacks: to
decide before each of three actions, to drive as fast, to be held up by the child no more than the grid's caregiver is.
How long the robot takes is seen in a few of the episodes, which it does again, watched from outside once a control
timestep. A phase is one skill: to block a stairwell (until the base is there), to fetch a candle (until it is off the
table) or to carry it (until it stands on another one and the hand is back). A phase that another target ends early
has no counterpart in the grid, and is only counted.
"""

from __future__ import annotations

import argparse
import collections
import dataclasses
import functools
import itertools
import math
import pathlib
import shlex
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.percept import Pace
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.family import Family
from caregiver_mj.children.tape import EPISODE_TIMESTEPS, Tape
from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import intervals, two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.settings import EPSILONS, Settings, episode_random, episode_seed
from caregiver_mj.grid.world import CAREGIVER_ACTIONS, GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import KINDS, NOTHING, Where
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.separation import FORESIGHT
from caregiver_mj.robot.skills import Block, Pick, Place, Skill
from caregiver_mj.robot.status import Status
from caregiver_mj.tasks import load
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.style import FAINT, INK, STYLE
from study import Page, Parser, read_run, run_all, run_episodes, run_in_grid

RULE = "paper"  # the caregiver if no other is named
GOAL = 0.15  # the house may leave this much more damage than the grid, relative, averaged over the epsilons
BLOCK, FETCH, CARRY = PHASES = ("block", "fetch", "carry")
DONE, FAILED, GIVEN_UP = "done", "failed", "given up"  # how they end

# What a phase's time in the house goes into, and what that is called.
PARTS = {
    "full": "driving at full rate",
    "slowed": "slowed",
    "stopped": "stopped",
    "aside": "stepping aside",
    "hand": "hand",
}
FULL_RATE, STOPPED_RATE = 0.97, 0.1  # shares of the planned speed: from there on it is full, below this it is stopped
# Levels between the grid and the house, each with all that those before it have, and what is new in it, in words.
GRID = "grid"
STEPS = {"once": "deciding once", "driving": "driving", "waiting": "waiting"}
REMAINDER = "not explained"
ALONE = {"driving alone": "driving", "waiting alone": "waiting"}  # one handicap without the others

AnyGrid = TypeVar("AnyGrid", bound="HandicappedGrid")

_ROUNDING = 1e-9  # of an action
_PHASE_OF = {Block: BLOCK, Pick: FETCH, Place: CARRY}
_ARRIVED = 0.05  # metres from the goal within which a base at rest does not wait for a way
_ROUNDS = 3  # to find how long an action near the child takes: that changes where the caregiver is, by a little

# An episode's damage, its phases, and what its time went into.
Watched = tuple[float, list[dict[str, Any]], Mapping[str, float]]
# What an episode's seconds go into, in words.
_BUDGET = {
    "block": "on the way to stairwells",
    "guard": "standing in them",
    "fetch": "fetching",
    "carry": "carrying",
    "unfinished": "in phases not completed",
    "idle": "out of the way with nothing to do",
}

_STYLE = STYLE | {"axes.grid": False, "axes.titlesize": 10, "axes.titlelocation": "left"}
_MOST = 2.5  # ratio up to which is drawn; houses above it are at the edge
_SPREAD = 0.28  # over how much of its place a column of houses is spread
_AREA = 60.0  # of the point of a house that has the mean share of the damage, points²
_GRID_COLOUR = (176, 184, 196)
_STEP_COLOURS = dict(
    zip((*STEPS, REMAINDER), (colours.BIN, colours.ROBOT, colours.TODDLER, (148, 156, 168)), strict=True)
)
_PART_COLOURS = dict(
    zip(PARTS, (colours.ROBOT, colours.TODDLER, colours.DAMAGE, colours.STAIRWELL, colours.BIN), strict=True)
)
_LEGEND: dict[str, Any] = {"loc": "upper left", "columnspacing": 1.2, "handlelength": 1.2, "handletextpad": 0.5}
_HEIGHT, _FILLED = 0.36, 0.92  # of a bar: its share of the place, and how much of that it fills


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("run", None, "a finished run in the house", type=pathlib.Path, metavar="DIR", required=True)
    parser.add("caregiver", RULE, "who protects the children")
    parser.add("watched", 2, "episodes to watch in each house for each epsilon")
    parser.add("many", 500, "episodes for the breakdown in the grid")
    parser.add_jobs()


def run(options: argparse.Namespace) -> Page:
    """Run the same in the grid; return the page."""
    rows = read_rows(options.run, options.caregiver)
    return page(measure(rows, options.watched, options.many, options.jobs), evaluation(rows.settings, options.run))


def evaluation(settings: Settings, folder: pathlib.Path) -> str:
    """What to type for a run in the house."""
    said = f"caregiver-mj evaluate --world house --houses {settings.place} --episodes {settings.episodes}"
    if settings.caregivers[-1] != RULE:
        said += f" --caregiver none {settings.caregivers[-1]}"
    if (epsilons := tuple(family.epsilon for family in settings.families)) != EPSILONS:
        said += f" --epsilon {' '.join(f'{e:g}' for e in epsilons)}"
    return f"{said}{f' --seed {settings.seed}' if settings.seed else ''} --out {shlex.quote(str(folder))}"


# -- Episodes in the house ---------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Rows:
    """Episodes of single novices in several houses, left alone and with one caregiver."""

    table: pd.DataFrame  # a row an episode, with the columns of `episodes.parquet`
    settings: Settings  # of the run in the house, with these two caregivers

    @property
    def houses(self) -> tuple[str, ...]:
        """Names of the houses."""
        return tuple(sorted(self.settings.plan_of))

    @property
    def epsilons(self) -> tuple[float, ...]:
        """The novices."""
        return tuple(family.epsilon for family in self.settings.families)

    @property
    def caregiver(self) -> str:
        """Name of the caregiver."""
        return self.settings.caregivers[-1]

    @property
    def cared(self) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Damage with the caregiver, in the house and in the grid."""
        return self.damage("house", self.caregiver), self.damage("grid", self.caregiver)

    def damage(self, world: str, caregiver: str) -> pd.DataFrame:
        """Damage in one world: a row a house and episode, a column an epsilon."""
        own = self.table[(self.table.world == world) & (self.table.caregiver == caregiver)]
        return own.pivot(index=["house", "episode"], columns="epsilon", values="damage")[list(self.epsilons)]


def read_rows(folder: pathlib.Path, caregiver: str = RULE) -> Rows:
    """Read those of a finished run in the house: of children left alone, and with a caregiver.

    Raises:
        CaregiverError: It has not got what is needed.
    """
    names = ("none", caregiver)
    table, settings = read_run(folder)
    settings = dataclasses.replace(settings, caregivers=names)
    rows = Rows(table[table.caregiver.isin(names)], settings)
    wanted = len(settings.plans) * len(settings.families) * settings.episodes
    if any((rows.table.caregiver == name).sum() != wanted for name in names):
        raise CaregiverError(f"the run in '{folder}' lacks episodes with {' and '.join(names)}")
    if settings.world != "house" or any(family != Family.of(family.epsilon) for family in settings.families):
        raise CaregiverError(f"the run in '{folder}' is not one of single novices in the physical house")
    seeds = rows.table.episode.map(lambda episode: episode_seed(settings.seed, episode))
    if (seeds != rows.table.seed).any():
        raise CaregiverError(f"the episodes in '{folder}' have other seeds than those of its run")
    return rows


def in_both_worlds(rows: Rows, jobs: int) -> Rows:
    """The house's episodes, and the same in the grid."""
    grid = run_episodes(dataclasses.replace(rows.settings, world="grid"), jobs)
    return dataclasses.replace(rows, table=pd.concat([grid, rows.table], ignore_index=True))


# -- The grid, with a caregiver that lacks what the robot lacks --------------------------------------


@dataclasses.dataclass(frozen=True)
class Handicap:
    """What a caregiver in the grid lacks. Times are in thirds of a novice timestep, which one of its actions takes."""

    # Whether it decides before the first action of a timestep only, and carries on with that for the rest of it;
    # else before each.
    once: bool = False
    pace: float = 1.0  # time that an action takes
    # Time that one takes in addition where a child is within `FORESIGHT`, as far as the robot minds it.
    near: float = 0.0


class HandicappedGrid(GridWorld):
    """The grid with a handicapped caregiver.

    Attributes:
        handicap: What it lacks.
        time: What is left of its time, in thirds of a timestep, (B,). It saves up what is not enough for an action.
    """

    def __init__(self, plan: FloorPlan, family: Family | float, caregiver: Caregiver, handicap: Handicap):
        super().__init__(plan, family, caregiver)
        self.handicap = handicap
        caregiver.pace = Pace(CAREGIVER_ACTIONS / handicap.pace)
        self._minds = minded_cells(plan)

    def reset(self, tapes: Sequence[Sequence[Tape]]) -> None:
        super().reset(tapes)
        self.time = np.zeros(len(tapes))

    def care(self, caregiver: Caregiver) -> None:
        decides = np.ones(len(self.time), bool)
        self.time += CAREGIVER_ACTIONS
        while True:
            cost = self.handicap.pace + self.handicap.near * self.is_near()
            acts = self.time >= cost - _ROUNDING
            if not acts.any():
                return
            self.time_left = self.time / CAREGIVER_ACTIONS
            self.act_caregiver(caregiver, acts, decides)
            self.time -= np.where(acts, cost, 0.0)
            if self.handicap.once:
                decides &= ~acts

    def is_near(self) -> np.ndarray:
        """Whether a child is near the caregiver, (B,)."""
        return self._minds[self.caregiver_cell[:, None], self.child_cell].any(axis=1)


@functools.lru_cache(maxsize=4)
def minded_cells(plan: FloorPlan) -> np.ndarray:
    """Whether the robot in each cell minds a child in each free cell, bool (caregiver cells, free cells)."""
    places = np.array([plan.position(cell) for cell in plan.caregiver_cells])
    apart = places[:, None] - places[: len(plan.free_cells)]
    return np.hypot(apart[..., 0], apart[..., 1]) < FORESIGHT


class WatchedGrid(HandicappedGrid):
    """The grid with a log of its caregiver's completed phases.

    Attributes:
        phases: A row a phase: actions that it took, how many of them near a child, and those of the shortest way
            without a child.
    """

    def reset(self, tapes: Sequence[Sequence[Tape]]) -> None:
        super().reset(tapes)
        graph, plan = self.plan.graph, self.plan
        self._to_landing = graph.distances_from([plan.cell_index[cell] for cell in plan.stairwells])
        self._to_table = graph.distances_from(graph.beside(plan.tables))
        self.phases: list[dict[str, Any]] = []
        self._under_way: list[tuple[int, bool] | None] = [None] * len(tapes)  # hazard, and whether it is in the hand
        self._actions, self._near, self._shortest = np.zeros((3, len(tapes)), int)

    def act_caregiver(
        self, caregiver: Caregiver, acts: np.ndarray | bool = True, decides: np.ndarray | bool = True
    ) -> None:
        cell, held, tables = self.caregiver_cell.copy(), self.holding.copy(), self.candle_table.copy()
        blocked, done, near = self.done.copy(), self.ledger.interventions_done.copy(), self.is_near()
        destination = self.orders.destination.copy()  # of the candle in the hand; forgotten once it is put down
        super().act_caregiver(caregiver, acts, decides)
        for i in np.flatnonzero(np.broadcast_to(acts, len(held))):
            was_held = bool(held[i] != NOTHING)
            hazard = self.plan.hazards.number(Where.ON_TABLE, held[i]) if was_held else int(self.orders.hazard[i])
            candle = self.plan.hazards.among(Where.ON_TABLE, hazard)
            if hazard == NOTHING or (candle == NOTHING and blocked[i] and self._under_way[i] is None):
                self._under_way[i] = None
                continue
            if self._under_way[i] != (hazard, was_held):
                self._under_way[i] = hazard, was_held
                self._actions[i] = self._near[i] = 0
                if candle == NOTHING:
                    self._shortest[i] = self._to_landing[hazard, cell[i]]
                else:
                    self._shortest[i] = self._to_table[destination[i] if was_held else tables[i, candle], cell[i]] + 1
            self._actions[i] += 1
            self._near[i] += near[i]
            taken = not was_held and self.holding[i] != NOTHING
            if taken or self.ledger.interventions_done[i] > done[i]:
                phase = CARRY if was_held else FETCH if taken else BLOCK
                took = {"actions": self._actions[i], "near": self._near[i]} if self._shortest[i] else {}  # else: there
                self.phases.append({"phase": phase, "actions": 0, "near": 0, "shortest": self._shortest[i]} | took)
                self._under_way[i] = None


# -- The robot in the house ----------------------------------------------------------------------------


def action_time(plan: FloorPlan) -> float:
    """Seconds of an action of the grid's caregiver."""
    return plan.cell_size / WALKING_SPEED / CAREGIVER_ACTIONS


class Watch:
    """Logs what a policy's robot does with its time in one episode.

    Attributes:
        phases: A row a phase: seconds in the grid, in the house, in an empty one and for each of `PARTS`, and how it
            ended.
        seconds: What the whole episode went into.
    """

    def __init__(self, env: Any, policy: CaregiverPolicy, navigator: Navigator):
        """Begins to watch.

        Args:
            env: An environment, at the start of an episode.
            policy: What acts in it.
            navigator: Of its house, to know the ways there are.
        """
        self._physics, self._policy, self._navigator = env.physics, policy, navigator
        self._timestep = env.control_timestep()
        self.phases: list[dict[str, Any]] = []
        self.seconds: collections.Counter[str] = collections.Counter()
        self._skill: Skill | None = None
        self._phase: dict[str, Any] | None = None
        self._done = 0

    def look(self) -> None:
        """Call after every action, before the physics go on."""
        policy, routine = self._policy, self._policy.executive.routine
        skill = routine.skill if routine else None
        if skill is not self._skill:
            self._change(skill)
        if isinstance(skill, Block) and skill.status is Status.DONE:
            self._end(done=True)
        self._done = policy.interventions_done
        if self._phase is None or skill is None:
            self.seconds["guard" if isinstance(skill, Block) else "idle"] += self._timestep
            return
        if self._phase["clear"] is None and skill.driver.goal is not None:
            self._phase["clear"] = self._clear_time(skill)
        self._phase[self._part(skill)] += self._timestep
        self._phase["house"] += self._timestep

    def finish(self) -> None:
        """Ends the episode."""
        self._end(done=False)

    def _change(self, skill: Skill | None) -> None:
        """Ends the phase of one skill and begins that of the next."""
        before, policy = self._skill, self._policy
        if isinstance(before, Pick):
            self._end(done=policy.executive.holding == before.candle)
        else:
            self._end(done=isinstance(before, Place) and policy.interventions_done > self._done)
        self._skill = skill
        if skill is not None and type(skill) in _PHASE_OF:
            self._begin(skill)

    def _begin(self, skill: Skill) -> None:
        navigator = self._navigator
        start = navigator.nearest_cell(self._physics.base_position()[:2])
        if isinstance(skill, Block):
            goals = [skill.cell]
        else:
            assert isinstance(skill, Pick | Place)
            goals = navigator.plan.free_neighbours(navigator.plan.tables[skill.table])
        routes = [route for goal in goals if (route := navigator.route(start, goal)) is not None]
        actions = min(len(route) - 1 for route in routes) + (not isinstance(skill, Block))
        self._phase = dict.fromkeys(("house", *PARTS), 0.0)
        self._phase |= {"phase": _PHASE_OF[type(skill)], "grid": actions * action_time(navigator.plan), "clear": None}

    def _end(self, done: bool) -> None:
        phase = self._phase
        if phase is None or self._skill is None:
            return
        phase["end"] = DONE if done else FAILED if self._skill.status.failed else GIVEN_UP
        if phase["clear"] is None:
            phase["clear"] = math.nan if phase["house"] else 0.0  # 0: it was there already
        self.seconds[phase["phase"] if done else "unfinished"] += phase["house"]
        self.phases.append(phase)
        self._phase = None

    def _clear_time(self, skill: Skill) -> float:
        """Seconds that the base would drive if there were no child, from rest."""
        x, y, yaw = self._physics.base_position()
        goal, cell = skill.driver.goal, skill.driver.cell
        assert goal is not None
        assert cell is not None
        points = self._navigator.path((x, y), goal, cell)
        if points is None:
            return math.nan
        motion = RobotMotion(self._policy.robot.robot, self._timestep)
        motion.reset((x, y, yaw))
        motion.drive_along(points, self._navigator.clearance.has_room)
        return motion.time_left

    def _part(self, skill: Skill) -> str:
        """What this timestep is for."""
        robot, driver = self._policy.robot, skill.driver
        if not skill.is_approaching:
            return "hand"
        if driver.stands_aside(robot.now):
            return "aside"
        if not robot.is_driving:
            off = math.dist(driver.goal, self._physics.base_position()[:2]) if driver.goal else 0.0
            return "hand" if off < _ARRIVED else "stopped"
        return "full" if robot.rate >= FULL_RATE else "slowed" if robot.rate >= STOPPED_RATE else "stopped"


# -- What the house costs, one thing after the other ---------------------------------------------------


def cared_for(kind: type[AnyGrid], settings: Settings, episodes: int, handicap: Handicap, house: str) -> AnyGrid:
    """A grid in which so many episodes of a run have been run, those of one epsilon after those of another."""
    plan = settings.plan_of[house]
    caregiver = make_caregiver(settings.caregivers[-1], plan, settings.seed)
    assert caregiver is not None  # it is one that acts
    make = functools.partial(kind, caregiver=caregiver, handicap=handicap)
    return run_in_grid(make, plan, settings.families, episodes, settings.seed)


def damages(settings: Settings, count: int, handicaps: Mapping[str, Handicap], house: str) -> dict[str, pd.DataFrame]:
    """Damage at every level in one house: a row an episode, a column an epsilon."""
    index = pd.MultiIndex.from_product([[house], range(count)], names=["house", "episode"])
    epsilons = [family.epsilon for family in settings.families]
    found = {}
    for level, handicap in handicaps.items():
        damage = cared_for(HandicappedGrid, settings, count, handicap, house).ledger.damage
        found[level] = pd.DataFrame(damage.reshape(-1, count).T, index, columns=epsilons)
    return found


def phases_in_grid(settings: Settings, handicap: Handicap, house: str) -> pd.DataFrame:
    """Phases in one house with the `time` that each took, in thirds of a timestep."""
    log = cared_for(WatchedGrid, settings, settings.episodes, handicap, house).phases
    table = pd.DataFrame(log, columns=["phase", "actions", "near", "shortest"])
    return table.assign(time=handicap.pace * table.actions + handicap.near * table.near)


def pace_of(phases: pd.DataFrame) -> float:
    """How much longer the robot takes for what the grid's caregiver does, with no child in the house.

    Args:
        phases: The house's phases.
    """
    done = phases[(phases.end == DONE) & phases.clear.notna()]
    return float((done.clear + done.hand).sum() / done.grid.sum())


def near_of(phases: pd.DataFrame, in_grid: pd.DataFrame, handicap: Handicap, action_time: float) -> float:
    """How much longer an action near the child must take for the child to cost the grid's caregiver what it costs.

    Args:
        phases: The house's phases.
        in_grid: The grid's phases with some handicap.
        handicap: That one.
        action_time: Seconds of an action.

    Returns:
        `Handicap.near`.
    """
    done = phases[(phases.end == DONE) & phases.clear.notna()]
    lost = (done.house - done.hand - done.clear).mean() / action_time
    own = in_grid.assign(lost=handicap.pace * (in_grid.actions - in_grid.shortest)).groupby("phase")
    alike = done.phase.map(own.lost.mean()).mean(), done.phase.map(own.near.mean()).mean()  # of as many of each phase
    return float(max(0.0, (lost - alike[0]) / alike[1]))


def ladder(pace: float, near: float) -> dict[str, Handicap]:
    """The handicap of every level, and those of one thing alone."""
    return {
        GRID: Handicap(),
        "once": Handicap(once=True),
        "driving": Handicap(True, pace),
        "waiting": Handicap(True, pace, near),
        "driving alone": Handicap(pace=pace),
        "waiting alone": Handicap(near=near),
    }


def delay_of(phases: pd.DataFrame, in_grid: pd.DataFrame, action_time: float) -> float:
    """Mean seconds by which a phase in the grid takes longer than on the shortest way, for as many of each phase.

    Args:
        phases: The house's phases.
        in_grid: The grid's phases.
        action_time: Seconds of an action.
    """
    done = phases[phases.end == DONE]
    extra = (in_grid.time - in_grid.shortest) * action_time
    return float(done.phase.map(extra.groupby(in_grid.phase).mean()).mean())


# -- All that is measured ------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Results:
    """All that was measured."""

    rows: Rows  # the episodes in both worlds
    # Damage in the grid at each level of the breakdown: a row a house and episode, a column an epsilon.
    levels: dict[str, pd.DataFrame]
    handicaps: dict[str, Handicap]  # the handicap of each level
    phases: pd.DataFrame  # the house's phases
    seconds: pd.DataFrame  # what the time of the watched episodes went into, a row an episode
    same: tuple[int, int]  # how many watched episodes have the damage that their row has, and how many there are
    # At the first and last level, mean seconds by which a phase takes longer than on the shortest way.
    delays: dict[str, float]

    @property
    def done(self) -> pd.DataFrame:
        """The house's completed phases."""
        return self.phases[self.phases.end == DONE]

    @property
    def many(self) -> int:
        """Episodes in each house with each novice at each level."""
        return len(next(iter(self.levels.values()))) // len(self.rows.houses)


def measure(rows: Rows, watched: int, many: int, jobs: int) -> Results:
    """Run everything.

    Args:
        rows: The episodes in the house.
        watched: Episodes in each house with each novice to watch, no more than there are.
        many: Episodes in each house with each novice in the grid for the breakdown.
        jobs: Worker processes.
    """
    settings, watched = rows.settings, min(watched, rows.settings.episodes)
    work = [(house, e, i) for house in rows.houses for e in rows.epsilons for i in range(watched)]
    found = run_all(functools.partial(run_watched, settings), work, jobs, "watched in the house")
    phases = pd.DataFrame([phase for _, log, _ in found for phase in log])
    own = rows.damage("house", rows.caregiver)
    same = sum(own.loc[(house, i), e] == damage for (house, e, i), (damage, _, _) in zip(work, found, strict=True))

    def in_grid(handicap: Handicap) -> pd.DataFrame:
        work = functools.partial(phases_in_grid, settings, handicap)
        return pd.concat(run_all(work, rows.houses, jobs, "phases in the grid"))

    seconds, pace, near = action_time(settings.plans[0]), pace_of(phases), 0.0
    for _ in range(_ROUNDS):  # until the grid's caregiver takes as long as the robot
        handicap = Handicap(True, pace, near)
        near = near_of(phases, in_grid(handicap), handicap, seconds)
    handicaps = ladder(pace, near)
    tables = run_all(
        functools.partial(damages, settings, many, handicaps), rows.houses, jobs, "in the grid, handicapped"
    )
    return Results(
        rows=in_both_worlds(rows, jobs),
        levels={level: pd.concat([table[level] for table in tables]) for level in handicaps},
        handicaps=handicaps,
        phases=phases,
        seconds=pd.DataFrame([spent for _, _, spent in found]).fillna(0.0),
        same=(int(same), len(work)),
        delays={level: delay_of(phases, in_grid(handicaps[level]), seconds) for level in (GRID, "waiting")},
    )


def run_watched(settings: Settings, job: tuple[str, float, int]) -> Watched:
    """Runs one episode in the house with the caregiver, by house, epsilon and number."""
    house, epsilon, episode = job
    env, policy, navigator = _house(settings, house, epsilon)
    env.task.reseed(episode_random(episode_seed(settings.seed, episode)))
    timestep = env.reset()
    watch = Watch(env, policy, navigator)
    while not timestep.last():
        action = policy(timestep)
        watch.look()
        timestep = env.step(action)
    watch.finish()
    return float(env.task.outcome()["damage"]), watch.phases, dict(watch.seconds)


@functools.lru_cache(maxsize=1)  # jobs of one house and epsilon follow each other
def _house(settings: Settings, house: str, epsilon: float) -> tuple[Any, CaregiverPolicy, Navigator]:
    plan, kwargs = settings.plan_of[house], {"embodiment": settings.embodiment}
    env = load("supervise", plan, epsilon, random=np.random.RandomState(0), task_kwargs=kwargs)
    return env, CaregiverPolicy(env, settings.caregivers[-1], settings.seed), Navigator(plan, env.task.embodiment)


# -- Ratios of mean damage over houses ---------------------------------------------------------------
#
# They are averaged over epsilons. Tables have a row a house and episode, columns epsilons. The house is the unit of
# chance. Every house counts the same at an epsilon, and every epsilon the same in the average.


def ratio(ours: pd.DataFrame, theirs: pd.DataFrame) -> Estimate[float]:
    """The mean over the epsilons of ours over theirs, with its interval; NaN where nothing happens in theirs.

    The ratios R_e are put together into one: mean_e (y_e - (R_e - R) x_e) / X_e over mean_e x_e / X_e, with y ours, x
    theirs, X the mean of x and R that of R_e. Its value is R, and its error for a house, mean_e (y_e - R_e x_e) / X_e,
    is that of the mean of the ratios.
    """
    weight = _weights(theirs)
    each = (ours.mean() / theirs.mean())[weight.index]
    if not len(weight):
        return Estimate(np.nan, np.nan, np.nan)
    # Relative to the greatest ratio, for no sample may be negative.
    above = (ours[weight.index] + (each.max() - each) * theirs[weight.index]) @ weight
    below = theirs[weight.index] @ weight
    found = two_level.of_ratio(_split(above), _split(below))
    shift = each.max() - each.mean()
    return Estimate(found.value - shift, max(0.0, found.low - shift), found.high - shift)


def by_house(ours: pd.DataFrame, theirs: pd.DataFrame) -> pd.DataFrame:
    """Of each house its ratio, averaged over the epsilons with `weight`, the share that it has in the whole."""
    weight = _weights(theirs)
    above, below = ((table[weight.index] @ weight).groupby("house").mean() for table in (ours, theirs))
    return pd.DataFrame({"ratio": above / below.where(below > 0), "weight": below / below.sum()})


def steps(results: Results) -> dict[str, tuple[Estimate[np.ndarray], Estimate[float]]]:
    """What leads from the grid to the house, in units of the grid's damage.

    Returns:
        For each of `STEPS` and the remainder, by epsilon with arrays (epsilons,), and in all.
    """
    linear = {level: _linear(results.levels[level], results.levels[GRID]) for level in (GRID, *STEPS)}
    linear[REMAINDER] = _linear(*results.rows.cared)
    return {now: difference(linear[now], linear[before]) for before, now in itertools.pairwise(linear)}


def alone(results: Results, level: str) -> Estimate[float]:
    """What a level adds to the grid."""
    grid = results.levels[GRID]
    return difference(_linear(results.levels[level], grid), _linear(grid, grid))[1]


def difference(ours: pd.DataFrame, theirs: pd.DataFrame) -> tuple[Estimate[np.ndarray], Estimate[float]]:
    """The mean difference of two tables (houses, epsilons) at each epsilon, and in all."""
    data = ours - theirs
    return intervals.of_mean(data.to_numpy()), intervals.of_mean(data.mean(axis=1).to_numpy())


def _linear(ours: pd.DataFrame, theirs: pd.DataFrame) -> pd.DataFrame:
    """Numbers (houses, epsilons) whose mean is the ratio of means, and whose chance is that of it (delta method)."""
    y, x = ours.groupby("house").mean(), theirs.groupby("house").mean()
    each = y.mean() / x.mean()
    return each + (y - each * x) / x.mean()


def _weights(theirs: pd.DataFrame) -> pd.Series:
    """What a damage counts at each epsilon at which there is any."""
    mean = theirs.mean()
    mean = mean[mean > 0]
    return 1 / (mean * len(mean))


def _split(values: pd.Series) -> list[np.ndarray]:
    return [part.to_numpy() for _, part in values.groupby("house")]


# -- The page ------------------------------------------------------------------------------------------


def page(results: Results, evaluated: str) -> Page:
    """The page; the command of the run that it is of stands in it."""
    rows, found = results.rows, steps(results)
    own = rows.table[rows.table.caregiver == rows.caregiver]
    alone_in = {world: rows.damage(world, "none") for world in ("grid", "house")}
    done = results.done.assign(extra=results.done.house - results.done.grid)
    named = {STEPS.get(name, name): whole for name, (_, whole) in found.items()}
    columns = [f"damage_{kind.name}" for kind in KINDS]
    damage = own.groupby("world")[columns].mean()
    counts = results.phases.groupby(["phase", "end"]).size()
    unfinished = results.phases[results.phases.end != DONE][list(PARTS)].sum() / len(results.seconds)
    name = "grid_to_house" if rows.caregiver == RULE else f"grid_to_house_{rows.caregiver}"
    values = {
        "name": name,
        "evaluated": evaluated,
        "rows": rows,
        "epsilons": [f"{epsilon:g}" for epsilon in rows.epsilons],
        "rule": rows.caregiver == RULE,
        "number": number,
        "goal": 1 + GOAL,
        "ratio": ratio(*rows.cared),
        "kinds": dict(zip((kind.name for kind in KINDS), damage.loc["house"] - damage.loc["grid"], strict=True)),
        "lines": [_line(results, epsilon) for epsilon in [[e] for e in rows.epsilons] + [list(rows.epsilons)]],
        "alike": int((alone_in["grid"] == alone_in["house"]).to_numpy().sum()),
        "alone": alone_in["grid"].size,
        "same": results.same,
        "steps": named,
        "total": sum(step.value for step in named.values()),
        "worse": [STEPS[one] for one in STEPS if round(found[one][1].low, 2) > 0],
        "rest": found[REMAINDER][1],
        "many": results.many,
        "last": results.handicaps["waiting"],
        "near": FORESIGHT,
        "without": {called: alone(results, level) for level, called in ALONE.items()},
        "delays": (results.delays[GRID], results.delays["waiting"]),
        "extra": done.extra,
        "slower": ((done.clear + done.hand - done.grid).mean(), (done.house - done.hand - done.clear).mean()),
        "rates": (FULL_RATE, STOPPED_RATE),
        "parts": PARTS,
        "phases": {phase: done[done.phase == phase] for phase in PHASES},
        "columns": ("grid", "house", "extra", "clear", *PARTS),
        "ends": {phase: [counts.get((phase, end), 0) for end in (DONE, GIVEN_UP, FAILED)] for phase in PHASES},
        "watched": len(results.seconds),
        "seconds": results.seconds.mean(),
        "budget": _BUDGET,
        "timesteps": EPISODE_TIMESTEPS,
        "unfinished": unfinished,
        "means": own.groupby(["epsilon", "world"])[
            [f"damage_{kind.name}" for kind in KINDS] + ["interventions_done"]
        ].mean(),
    }
    drawn = {name: draw_houses(results), f"{name}_steps": draw_steps(results), f"{name}_time": draw_time(results)}
    return Page(values, {f"{file}.png": figure for file, figure in drawn.items()}, name)


def _line(results: Results, epsilons: list[float]) -> dict[str, Any]:
    """What there is to tell of one epsilon, or of all of them."""
    rows, found = results.rows, steps(results)
    house, grid, alone = (table[epsilons] for table in (*rows.cared, rows.damage("house", "none")))
    return {
        "means": [table[epsilons[0]].mean() for table in (alone, grid, house)],
        "left": [ratio(table, alone).value for table in (grid, house)],
        "ratio": ratio(house, grid),
        "steps": [
            each.column(rows.epsilons.index(epsilons[0])) if len(epsilons) == 1 else whole
            for each, whole in found.values()
        ],
    }


def number(value: float, sign: str = "") -> str:
    """Two digits; a dash where there is no number, and a sign of infinity."""
    if math.isnan(value):
        return "–"
    return ("-∞" if value < 0 else "∞") if math.isinf(value) else f"{round(value, 2) + 0.0:{sign}.2f}"  # never -0.00


# -- Figures -------------------------------------------------------------------------------------------


def draw_houses(results: Results) -> Figure:
    """The ratio in every house, and over all of them."""
    epsilons = results.rows.epsilons
    with mpl.rc_context(_STYLE):
        figure = Figure((7.2, 3.8), layout="constrained", facecolor="white")
        axes = figure.subplots()
        axes.set_title("Damage in the house over damage in the grid, with the caregiver")
        axes.axhline(1, color=INK, linewidth=0.8)
        axes.axhline(1 + GOAL, color=INK, linewidth=0.8, linestyle=":")
        axes.text(len(epsilons) + 0.5, 1 + GOAL, f" {1 + GOAL:.2f}", va="center", color=INK)
        for i, chosen in enumerate([*([e] for e in epsilons), list(epsilons)]):
            ours, theirs = (damage[chosen] for damage in results.rows.cared)
            _draw_points(axes, i, by_house(ours, theirs).dropna())
            _draw_estimate(axes, i, ratio(ours, theirs))
        axes.set_xticks(range(len(epsilons) + 1), [*(f"epsilon {e:g}" for e in epsilons), "all"])
        axes.set_xlim(-0.5, len(epsilons) + 0.5)
        axes.set_ylim(0, _MOST * 1.03)
        axes.set_xlabel(
            "A point is a house with damage in the grid, its area the house's share of it; ^ is above.", color=INK
        )
    return figure


def _draw_points(axes: Axes, place: int, houses: pd.DataFrame) -> None:
    """The houses of `by_house`."""
    sideways = place + _SPREAD * np.linspace(-1, 1, max(2, len(houses)))[: len(houses)]
    area = _AREA * houses.weight * len(houses)
    outside = (houses.ratio > _MOST).to_numpy()
    for marker, shown in (("o", ~outside), ("^", outside)):
        height = houses.ratio.clip(upper=_MOST)[shown]
        axes.scatter(sideways[shown], height, area[shown], color=colours.unit(colours.ROBOT), alpha=0.45,
                     linewidths=0, marker=marker)  # fmt: skip


def _draw_estimate(axes: Axes, place: int, found: Estimate[float]) -> None:
    low, high = max(0.0, found.low), min(2 * _MOST, found.high)
    axes.vlines(place, low, high, color=INK, linewidth=1.6)
    axes.plot(place, found.value, "D", color=INK, markersize=5)
    axes.text(place + 0.06, found.value, f" {number(found.value)}", va="bottom", color=INK, fontweight="bold")


def draw_steps(results: Results) -> Figure:
    """What leads from the grid to the house, at each epsilon and in all."""
    epsilons, found = results.rows.epsilons, steps(results)
    with mpl.rc_context(_STYLE):
        figure = Figure((7.2, 4.8), layout="constrained", facecolor="white")
        grid = figure.subplots(-(-(len(epsilons) + 1) // 3), 3, sharex=True, sharey=True, squeeze=False)
        for axes in grid.flat:
            axes.set_visible(False)
        extent = [1.0, 1 + GOAL]
        for i, axes in zip(range(len(epsilons) + 1), grid.flat, strict=False):
            whole = i == len(epsilons)
            axes.set_visible(True)
            axes.set_title("all" if whole else f"epsilon {epsilons[i]:g}")
            extent += _draw_waterfall(
                axes, {name: each[1] if whole else each[0].column(i) for name, each in found.items()}
            )
        grid.flat[0].set_ylim(max(0.0, min(extent) - 0.15), min(_MOST, max(extent) + 0.25))
        figure.supylabel("damage, in units of the grid's", color=INK, fontsize=9)
    return figure


def _draw_waterfall(axes: Axes, found: dict[str, Estimate[float]]) -> list[float]:
    """What each step adds to the grid's damage, with its interval; returns the levels."""
    axes.axhline(1, color=INK, linewidth=0.6)
    axes.axhline(1 + GOAL, color=INK, linewidth=0.6, linestyle=":")
    levels, last = [1.0], len(found) + 1
    for i, (name, step) in enumerate(found.items(), 1):
        level, value = levels[-1], float(np.nan_to_num(step.value))
        axes.bar(i, value, bottom=level, color=colours.unit(_STEP_COLOURS[name]))
        axes.vlines(i, *(np.clip(level + end, -9, 9) for end in (step.low, step.high)), color=INK, linewidth=1.0)
        _write_above(axes, i, number(step.value, "+"))
        axes.hlines(level + value, i - 0.4, i + 1.4 * (i < last), color=FAINT, linewidth=0.6)
        levels.append(level + value)
    for place, level in ((0, 1.0), (last, levels[-1])):
        axes.plot(place, level, "D", color=INK, markersize=4.5)
        _write_above(axes, place, number(level))
    names = [GRID, *(STEPS.get(name, name) for name in found), "house"]
    axes.set_xticks(range(last + 1), names, rotation=60, ha="right", rotation_mode="anchor", fontsize=7)
    return levels


def _write_above(axes: Axes, place: float, text: str) -> None:
    """Writes below the upper edge, where no interval makes it illegible."""
    axes.text(place, 0.94, text, transform=axes.get_xaxis_transform(), ha="center", color=INK, fontsize=7,
              bbox={"facecolor": "white", "edgecolor": "none", "pad": 1})  # fmt: skip


def draw_time(results: Results) -> Figure:
    """The phases' time beside the grid's."""
    with mpl.rc_context(_STYLE):
        figure = Figure((6.4, 3.4), layout="constrained", facecolor="white")
        axes = figure.subplots()
        axes.set_title("Mean seconds of a completed phase")
        for i, phase in enumerate(PHASES):
            own = results.done[results.done.phase == phase]
            above, below = i - _HEIGHT / 2, i + _HEIGHT / 2
            grid, clear = own.grid.mean(), own.clear.mean()
            colour = colours.unit(_GRID_COLOUR)
            axes.barh(above, grid, _FILLED * _HEIGHT, color=colour, label=None if i else "grid, shortest way")
            axes.text(grid + 0.1, above, f"{grid:.1f}", va="center", color=INK)
            left = 0.0
            for part, title in PARTS.items():
                mean, colour = own[part].mean(), colours.unit(_PART_COLOURS[part])
                axes.barh(below, mean, _FILLED * _HEIGHT, left=left, color=colour, label=None if i else title)
                left += mean
            axes.vlines(clear, below - _HEIGHT / 2, below + _HEIGHT / 2, color=INK, linewidth=1.8,
                        label="" if i else "drive in an empty house")  # fmt: skip
            axes.text(left + 0.1, below, f"{left:.1f}", va="center", color=INK)
        axes.set_yticks(range(len(PHASES)), PHASES)
        axes.invert_yaxis()
        axes.margins(x=0.08)
        axes.grid(axis="x")
        axes.legend(bbox_to_anchor=(-0.1, -0.08), ncols=3, **_LEGEND)
    return figure

"""How fast everything is: the closed loop beside its physics alone, and where the time goes."""

from __future__ import annotations

import argparse
import contextlib
import copy
import dataclasses
import functools
import json
import logging
import math
import os
import pathlib
import statistics
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any, ClassVar, ParamSpec, TypeVar
from unittest import mock

import dm_env
import mink
import mujoco
import numpy as np
import pandas as pd
from rich.console import Console
from ruckig import ControlInterface, InputParameter, Ruckig, Synchronization, Trajectory

from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.errors import RenderingError
from caregiver_mj.experiments.cluster import DaskExecutor
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.provenance import versions
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.workers import Executor, LocalExecutor, run_jobs
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.rendering import control
from caregiver_mj.house.scene import child_joints
from caregiver_mj.house.touch import Touch
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.generator import generate
from caregiver_mj.plans.sets import house_set
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.robot import kinematics, reach
from caregiver_mj.robot.base_path import BasePath
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.kinematics import Arm
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.scalar_motion import ScalarMotion
from caregiver_mj.tasks import load
from caregiver_mj.viz import hud
from caregiver_mj.viz.cameras import Camera, StillCamera, TileLayer
from caregiver_mj.viz.episode import Episode as FilmedEpisode
from caregiver_mj.viz.film import DEFAULT_FPS, DEFAULT_SIZE, Studio, film_writer
from studies.relocations import Knock
from study import HOUSES, Parser, load_house, make_console, make_table, tapes

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


@dataclasses.dataclass(frozen=True)
class Effort:
    """How long to measure.

    Attributes:
        seconds: Simulated seconds of an episode.
        repeats: How often everything that is compared is repeated.
        large_seconds: Simulated seconds in the large houses.
        frames: Frames to draw with each camera.
        calls: Calls of what takes microseconds.
        jobs: Episodes for the scaling over processes.
        houses: Houses to run on each executor.
    """

    seconds: float = 340.0
    repeats: int = 5
    large_seconds: float = 100.0
    frames: int = 30
    calls: int = 2000
    jobs: int = 6
    houses: int = 100


QUICK = Effort(seconds=60.0, repeats=3, large_seconds=20.0, frames=6, calls=300, jobs=4, houses=10)
EPSILON = 0.5  # of the child in all episodes


# -- A prototype's figures, measured before this project, on 2 cores without a GPU -------------------


# Names of what is compared with it.
HOUSE = "paper"
MANIPULATOR = "manipulator:bring_ball"  # dm_control's
SOLVE, PLAN, SAMPLE = "mink: one iteration (solve_ik)", "ruckig: plan, 1 axis to a position", "ruckig: sample"
RENDERING = "rendering"

PROTOTYPE = {
    HOUSE: 108.0,  # x real time: the closed loop, an episode of 270 s with 44 candles taken and put down
    MANIPULATOR: 35.0,  # x real time, zero action
    SOLVE: 86.0,  # us
    PLAN: 4.4,  # us
    SAMPLE: 0.5,  # us
    RENDERING: 49.0,  # ms for a frame of 640 x 480 with shadows and 4 x MSAA
}


def prototype(name: str) -> str:
    """Its figure as text; empty where there is none."""
    return f"{PROTOTYPE[name]:g}" if name in PROTOTYPE else ""


# -- Clocks for parts of a program -------------------------------------------------------------------


class Clock:
    """Measures the time spent in functions. It stands still while another clock runs within them.

    Attributes:
        own: Seconds in all, without those of the clocks within.
        times: Seconds of every call, with them. Calls of the same clock within calls are none of their own.
    """

    _running: ClassVar[list[Clock]] = []

    def __init__(self, timer: Callable[[], float] = time.perf_counter):
        """Begins with nothing.

        Args:
            timer: What tells the time, in seconds.
        """
        self._timer = timer
        self.own = 0.0
        self.times: list[float] = []

    def around(self, function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
        """The same function, timed."""

        @functools.wraps(function)
        def timed(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
            if self in self._running:
                return function(*args, **kwargs)
            self._running.append(self)
            start = self._timer()
            try:
                return function(*args, **kwargs)
            finally:
                seconds = self._timer() - start
                self._running.pop()
                self.times.append(seconds)
                self.own += seconds
                if self._running:
                    self._running[-1].own -= seconds

        return timed

    @contextlib.contextmanager
    def of(self, owner: Any, *names: str) -> Iterator[Clock]:
        """Times methods of a class or of an object meanwhile."""
        with contextlib.ExitStack() as stack:
            for name in names:
                stack.enter_context(mock.patch.object(owner, name, self.around(getattr(owner, name))))
            yield self


def seconds_of(function: Callable[[], Any]) -> float:
    """Seconds that a call takes."""
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


# -- A house with the scripted caregiver, and an episode of it on tape -------------------------------


class Scene:
    """A house with the scripted caregiver, and an episode of it on tape.

    Attributes:
        env: The environment.
        policy: What acts in it.
        steps: Control timesteps of the episode.
    """

    def __init__(self, house: str | FloorPlan, seconds: float):
        self.env = load("supervise", house, EPSILON, random=0, task_kwargs={"time_limit": float("inf")})
        self.policy = CaregiverPolicy(self.env)
        self.steps = round(seconds / self.env.control_timestep())

    def play(self, act: Callable[[dm_env.TimeStep], np.ndarray] | None = None) -> float:
        """Plays the episode from its start, with the policy or what is given in its place; returns its seconds."""
        act = act or self.policy
        self.env.task.reseed(0)
        timestep = self.env.reset()
        start = time.perf_counter()
        for _ in range(self.steps):
            timestep = self.env.step(act(timestep))
        return time.perf_counter() - start

    def run(self) -> tuple[float, float, float]:
        """Plays the episode: seconds in all, in the physics, in the policy."""
        physics, policy = Clock(), Clock()
        with physics.of(self.env.physics, "step"):
            total = self.play(policy.around(self.policy))
        return total, physics.own, policy.own

    def record(self) -> None:
        """Plays the episode once, and keeps what drives the physics in it."""
        physics = self.env.physics
        model, data, step = physics.model.ptr, physics.data.ptr, physics.step
        joints = [model.joint(name) for name in child_joints(0)]
        self._q = np.array([joint.qposadr[0] for joint in joints])
        # The task writes the wheels' speeds as well; with them the replay is the same to the last bit.
        wheels = [model.joint(f"robot/{name}") for name in self.env.task.embodiment.names.wheels]
        self._v = np.array([joint.dofadr[0] for joint in (*joints, *wheels)])
        self._tape: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

        def taped(nstep: int) -> None:
            if not self._tape:
                self._start = copy.copy(data)
            driven = data.qpos[self._q], data.qvel[self._v]
            touches: list[Touch] = []
            controls = np.empty((nstep, model.nu))
            for i in range(nstep):  # what the actuators are told changes with every step
                step(1)
                controls[i], touches = data.ctrl, touches + physics.touches
            physics.touches = touches
            self._tape.append((controls, *driven))

        with mock.patch.object(physics, "step", taped):
            self.play()
        self._end = data.qpos.copy()

    def replay(self) -> tuple[float, float]:
        """Replays the tape through bare `mj_step`.

        Returns:
            Seconds that it took, and by how much the end differs from that of the episode.
        """
        model, data = self.env.physics.model.ptr, mujoco.MjData(self.env.physics.model.ptr)
        mujoco.mj_copyData(data, model, self._start)
        ctrl, qpos, qvel = data.ctrl, data.qpos, data.qvel
        start = time.perf_counter()
        for controls, positions, velocities in self._tape:
            qpos[self._q], qvel[self._v] = positions, velocities
            for ctrl[:] in controls:
                mujoco.mj_step(model, data)
        return time.perf_counter() - start, float(np.abs(data.qpos - self._end).max())


# -- The closed loop in the houses of the package; bare physics and dm_control's own tasks beside it -


_LOOP_HOUSES = (HOUSE, "apartment")
_SUITE = (MANIPULATOR, "humanoid:walk")  # of dm_control
_SUITE_SECONDS = 30.0  # simulated, at most, for each of those


def closed_loop(effort: Effort, console: Console) -> dict[str, Any]:
    """Measures all of it in turn, over and over."""
    scenes = {house: Scene(house, effort.seconds) for house in _LOOP_HOUSES}
    for scene in scenes.values():
        scene.record()
    suite = {name: _suite_task(*name.split(":")) for name in _SUITE}
    runs: dict[str, list[tuple[float, ...]]] = {house: [] for house in scenes}
    factors: dict[str, list[float]] = {name: [] for name in suite}
    for _ in range(effort.repeats):
        for house, scene in scenes.items():
            runs[house].append((*scene.run(), *scene.replay()))
        for name, run in suite.items():
            factors[name].append(run(min(effort.seconds, _SUITE_SECONDS)))
    houses = {house: _summary(effort.seconds, repeats) for house, repeats in runs.items()}
    for house, row in houses.items():
        row["parts"] = dissect(scenes[house])
    figures = {"houses": houses, "dm_control": {name: statistics.median(each) for name, each in factors.items()}}
    _print_loops(console, figures)
    for house, row in houses.items():
        print_parts(console, house, row["parts"], scenes[house].steps)
    return figures


def _summary(seconds: float, repeats: list[tuple[float, ...]]) -> dict[str, Any]:
    """What comes of the repeats: seconds in all, in physics, in the policy, of the replay; and its deviation."""
    total, physics, policy, bare, _ = map(statistics.median, zip(*repeats, strict=True))
    return {
        "real_time_factor": seconds / total,
        "bare_real_time_factor": seconds / bare,
        # The ratio of each repeat's two runs, which follow each other: a load that comes and goes hits both.
        "ratio": statistics.median(run[0] / run[3] for run in repeats),
        "share_physics": physics / total,
        "share_policy": policy / total,
        "share_task": 1 - (physics + policy) / total,
        "replay_deviation": max(run[4] for run in repeats),
    }


def _print_loops(console: Console, figures: dict[str, Any]) -> None:
    title = "Closed loop: supervise, one core; beside it dm_control's tasks with zero action"
    table = make_table(title, "house", "x real time", "prototype", "bare mj_step", "ratio",
                       "physics", "policy", "task")  # fmt: skip
    for house, row in figures["houses"].items():
        shares = (f"{row[f'share_{part}']:.0%}" for part in ("physics", "policy", "task"))
        table.add_row(house, f"{row['real_time_factor']:.0f}", prototype(house), f"{row['bare_real_time_factor']:.0f}",
                      f"{row['ratio']:.2f}", *shares)  # fmt: skip
    for name, factor in figures["dm_control"].items():
        table.add_row(name, f"{factor:.0f}", prototype(name))
    console.print(table)
    ratio = figures["houses"][HOUSE]["real_time_factor"] / figures["dm_control"][MANIPULATOR]
    console.print(f"{HOUSE} is {ratio:.1f} x as fast as {MANIPULATOR}")
    deviation = max(row["replay_deviation"] for row in figures["houses"].values())
    console.print(f"replayed through bare mj_step, the episodes end within {deviation:.1g} m or rad of themselves\n")


def _suite_task(domain: str, task: str) -> Callable[[float], float]:
    """One of dm_control's tasks with zero action: a function from simulated seconds to the real-time factor."""
    from dm_control import suite  # here, for it loads all of them

    env = suite.load(domain, task, task_kwargs={"random": 0})
    action = np.zeros(env.action_spec().shape)

    def run(seconds: float) -> float:
        steps = round(seconds / env.control_timestep())
        env.reset()
        start = time.perf_counter()
        for _ in range(steps):
            if env.step(action).last():
                env.reset()
        return steps * env.control_timestep() / (time.perf_counter() - start)

    return run


# -- Where the closed loop's time goes ---------------------------------------------------------------


_TASK, _DECISION = "task: toddler, observation, reward", "caregiver: a decision"


def _parts(scene: Scene) -> dict[str, list[tuple[Any, ...]]]:
    """The methods of each part: their owner, then their names."""
    env = scene.env
    return {
        "physics": [(env.physics, "step")],
        "contacts of the toddler": [(env.physics.touch_reader, "read")],
        _TASK: [(env.task, "before_step", "after_step", "get_reward", "get_observation", "get_termination")],
        "dm_control's environment": [(env, "step")],
        _DECISION: [(PaperCaregiver, "watch", "assess", "decide")],
        "inverse kinematics": [(kinematics.Arm, "solve")],
        "trajectories: planned": [(BasePath, "__init__"), (ScalarMotion, "move_to", "run_at")],
        "trajectories: sampled": [(RobotMotion, "action")],
        "paths over the floor": [(Navigator, "path")],
        "skills and the rest": [(type(scene.policy), "__call__")],
    }


def dissect(scene: Scene) -> dict[str, dict[str, float]]:
    """Plays the episode with a clock in every part: its share of the whole loop, and its time a call.

    The clocks take time as well, so that small parts look somewhat larger than they are.
    """
    parts = _parts(scene)
    clocks = {part: Clock() for part in parts}
    reach.reach_path.cache_clear()  # inverse kinematics is solved once for each height
    with contextlib.ExitStack() as stack:
        for part, owners in parts.items():
            for owner, *names in owners:
                stack.enter_context(clocks[part].of(owner, *names))
        scene.play()
    whole = sum(clock.own for clock in clocks.values())
    calls = {part: len(clock.times) for part, clock in clocks.items()}
    # These two consist of several methods: count a call for each control step, and for each novice timestep.
    calls |= {_TASK: scene.steps, _DECISION: scene.env.task.timestep}
    return {
        part: {
            "share": clock.own / whole,
            "calls": calls[part],
            "microseconds_a_call": 1e6 * clock.own / max(calls[part], 1),
        }
        for part, clock in clocks.items()
    }


def print_parts(console: Console, house: str, parts: dict[str, dict[str, float]], steps: int) -> None:
    """Prints what `dissect` has found in an episode of so many control timesteps."""
    titles = ("part", "share of the loop", "us a control step", "calls", "us a call")
    table = make_table(f"Where the time goes: {house}", *titles)
    for part, spent in parts.items():
        call, calls = spent["microseconds_a_call"], spent["calls"]
        table.add_row(part, f"{spent['share']:.1%}", f"{call * calls / steps:.1f}", f"{calls}", f"{call:.1f}")
    console.print(table)


# -- The worst control step: how long the policy makes the robot wait for an action, at most ---------


_STEP_GOAL = 0.050  # seconds of computing
_CAREGIVERS = ("paper", "foresight")


@dataclasses.dataclass(frozen=True)
class Step:
    """A control step.

    Attributes:
        seconds: Of computing in the policy.
        at: When, in simulated seconds.
        activity: What the robot was doing.
    """

    seconds: float
    at: float
    activity: str


def hitches(effort: Effort, console: Console) -> dict[str, dict[str, float | str]]:
    """Worst control steps, without the first of an episode, at which the robot stands."""
    table = make_table("Worst control step", "episodes", "steps", "worst ms", "over 50 ms", "at s", "while it would")
    figures: dict[str, dict[str, float | str]] = {}
    for name, episodes in _kinds(effort):
        worst, steps, over = Step(0.0, 0.0, ""), 0, 0  # and not all steps, for the garbage collector would count those
        for env, policy, knock in episodes:
            for step in _play(env, policy, knock, effort.seconds):
                worst, steps = max(worst, step, key=lambda step: step.seconds), steps + 1
                over += step.seconds > _STEP_GOAL
        figures[name] = {"worst": worst.seconds, "over": over, "steps": steps, "activity": worst.activity}
        row = (f"{1e3 * worst.seconds:.1f}", str(over), f"{worst.at:.1f}", worst.activity)
        table.add_row(name, str(steps), *row)
    console.print(table)
    console.print(f"goal: none takes more than {1e3 * _STEP_GOAL:g} ms of computing, other processes not counted\n")
    return figures


Episode = tuple[control.Environment, CaregiverPolicy, Knock | None]


def _kinds(effort: Effort) -> Iterable[tuple[str, Iterable[Episode]]]:
    """Kinds of episodes by their names: whole ones, and candles that are knocked over at the start."""
    for caregiver in _CAREGIVERS:
        yield f"supervise, {caregiver}", (_supervised(house, caregiver) for house in HOUSES[:2])
    yield "candles knocked over", map(_knocked, range(effort.jobs))


def _supervised(house: str, caregiver: str) -> Episode:
    env = load("supervise", load_house(house), EPSILON, random=0, visuals=False)
    return env, CaregiverPolicy(env, caregiver), None


def _knocked(seed: int) -> Episode:
    env = load("relocate_candle", load_house(HOUSES[seed % len(HOUSES)]), EPSILON, random=seed, visuals=False)
    policy = CaregiverPolicy(env)
    env.reset()
    knock = Knock(env.physics, env.task.goal_candle, seed)
    env.task.reseed(seed)
    return env, policy, knock


def _play(env: control.Environment, policy: CaregiverPolicy, knock: Knock | None, most: float) -> Iterator[Step]:
    """The control steps of an episode, or of its first seconds, without the very first."""
    timestep = env.reset()
    while not timestep.last() and env.physics.time() < most:
        start = time.process_time()
        action = policy(timestep)
        if not timestep.first():
            yield Step(time.process_time() - start, env.physics.time(), policy.activity)
        if knock:
            knock.apply()
        timestep = env.step(action)
        if knock and policy.interventions_done:
            most = -math.inf


# -- Inverse kinematics and trajectories on their own ------------------------------------------------


_AHEAD, _HEIGHT = (0.5, 0.62), (0.7, 0.9)  # metres: where the poses that are solved for lie


def parts(effort: Effort, console: Console) -> dict[str, float]:
    """Medians in microseconds."""
    found = _solving(effort.calls) | _planning(effort.calls)
    medians = {name: 1e6 * statistics.median(seconds) for name, seconds in found.items()}
    table = make_table("Parts", "call", "us", "prototype")
    for name, microseconds in medians.items():
        table.add_row(name, f"{microseconds:.1f}", prototype(name))
    console.print(table)
    return medians


def _solving(calls: int) -> dict[str, list[float]]:
    """Seconds of every call of inverse kinematics."""
    robot, random, iterations = find_embodiment(), np.random.default_rng(0), Clock()
    arm = Arm(robot)
    start = arm.solve(*robot.postures.carry)
    with iterations.of(mink, "solve_ik"):
        nearest, farthest = np.array([_AHEAD, _HEIGHT]).T
        places = random.uniform(nearest, farthest, size=(calls, 2))
        solves = [seconds_of(functools.partial(arm.solve, x, z, guess=start)) for x, z in places]
    return {"mink: inverse kinematics of a pose": solves, SOLVE: iterations.times}


def _planning(calls: int) -> dict[str, list[float]]:
    """Seconds of every call of the trajectories' solver, with the base's limits."""

    def inputs(axes: int) -> InputParameter:
        base, parameters = find_embodiment().limits.base, InputParameter(axes)
        parameters.max_velocity = [base.velocity] * axes
        parameters.max_acceleration, parameters.max_jerk = [base.acceleration] * axes, [base.jerk] * axes
        return parameters

    straight, corner = inputs(1), inputs(2)
    straight.target_position = [3.0]
    corner.control_interface, corner.synchronization = ControlInterface.Velocity, Synchronization.Phase
    corner.current_velocity, corner.target_velocity = [1.0, 0.0], [0.0, 1.0]
    trajectory, solver = Trajectory(1), Ruckig(1)
    functions = {
        PLAN: lambda: Ruckig(1).calculate(straight, trajectory),
        "ruckig: plan again with the same solver": lambda: solver.calculate(straight, trajectory),
        "ruckig: plan, corner of 2 axes": lambda: Ruckig(2).calculate(corner, Trajectory(2)),
        SAMPLE: lambda: trajectory.at_time(1.0),
    }
    return {name: [seconds_of(function) for _ in range(calls)] for name, function in functions.items()}


# -- How long it takes to build a house, and everything round it -------------------------------------


_BUILDING_GOAL = 1.0  # seconds for the model of a 12 x 10 house


def _small() -> FloorPlan:
    return generate(0, (12, 10), stairwells=2, candles=2, tables=3, bins=3)


def _large() -> FloorPlan:
    return generate(0, (40, 40), stairwells=6, candles=40, tables=40, bins=6)


_PLANS = {"12 x 10, 2 candles": _small, "40 x 40, 40 candles": _large}


def building(effort: Effort, console: Console) -> dict[str, dict[str, float]]:
    """Seconds for the model, the environment, and the caregiver up to its first action."""
    table = make_table("Building a house", "house", "model s", "environment s", "caregiver s")
    # Pictures of wood and grass are painted once in a process.
    [(_, first)] = run_jobs(build_first, [0], 2)
    figures = {"first in a process": {"model": first}}
    table.add_row("12 x 10, the first in a process", f"{first:.2f}")
    for name, make in _PLANS.items():
        times: list[tuple[float, float, float]] = []
        for _ in range(effort.repeats):  # a new plan each time: plans keep what they have worked out
            other, fresh = make(), make()
            model = seconds_of(functools.partial(Physics.from_plan, other))
            start = time.perf_counter()
            env = load("supervise", fresh, EPSILON, random=0)
            ready = time.perf_counter()
            policy = CaregiverPolicy(env)
            policy(env.reset())
            times.append((model, ready - start, time.perf_counter() - ready))
        row = [statistics.median(column) for column in zip(*times, strict=True)]
        figures[name] = dict(zip(("model", "environment", "caregiver_to_first_action"), row, strict=True))
        table.add_row(name, *(f"{seconds:.2f}" for seconds in row))
    console.print(table)
    verdict = "as it shall be" if first < _BUILDING_GOAL else "TOO SLOW"
    console.print(f"a 12 x 10 house in less than {_BUILDING_GOAL:g} s, even the first in a process: {verdict}\n")
    return figures


def build_first(_: int) -> float:
    """Builds a house in a worker that has built none."""
    plan = _small()
    return seconds_of(lambda: Physics.from_plan(plan))


# -- The closed loop as houses, tables and candles get more ------------------------------------------


_LARGE_SIDE = 40  # cells a side of the houses in which only tables and candles grow
# Cells a side, candles, bare tables.
_SIZES = ((12, 2, 2), (20, 10, 10), (30, 20, 20), (_LARGE_SIDE, 5, 5), (_LARGE_SIDE, 20, 20), (_LARGE_SIDE, 40, 40))


def growth(effort: Effort, console: Console) -> dict[str, Any]:
    """Measures all sizes in turn, over and over."""
    scenes = [
        Scene(generate(0, (side, side), stairwells=4, candles=candles, tables=tables, bins=4), effort.large_seconds)
        for side, candles, tables in _SIZES
    ]
    for scene in scenes:
        scene.record()
    runs: list[list[tuple[float, ...]]] = [[] for _ in scenes]
    for _ in range(effort.repeats):
        for scene, repeats in zip(scenes, runs, strict=True):
            repeats.append((*scene.run(), scene.replay()[0]))
    rows = [_row(*each) for each in zip(_SIZES, scenes, runs, strict=True)]
    table = make_table("The closed loop as houses grow", "cells", "tables", "candles", "x real time",
                       "us a control step", "physics", "policy", "task", "bare mj_step")  # fmt: skip
    for row in rows:
        table.add_row(f"{row['side']} x {row['side']}", *(f"{value:.0f}" for value in list(row.values())[1:]))
    console.print(table)
    large = [row for row in rows if row["side"] == _LARGE_SIDE]
    in_all, at_large = _ratios(rows[0], rows[-1]), _ratios(large[0], large[-1])
    verdict = "at most linear, as it shall be" if at_large["time"] <= at_large["objects"] else "MORE THAN LINEAR"
    for where, ratio in (
        (f"{in_all['cells']:.0f} x the cells", in_all),
        (f"{_LARGE_SIDE} x {_LARGE_SIDE} cells", at_large),
    ):
        console.print(f"{ratio['objects']:.0f} x the tables and candles in {where} take {ratio['time']:.1f} x the time")
    console.print(f"growth with the tables and candles at one size of house: {verdict}\n")
    return {"houses": rows, "ratios": in_all, "ratios_at_one_size": at_large}


def _row(size: tuple[int, int, int], scene: Scene, repeats: list[tuple[float, ...]]) -> dict[str, float]:
    """What comes of a scene's repeats: seconds in all, in physics, in the policy, and of the replay."""
    side, candles, tables = size
    columns = zip(*repeats, strict=True)
    total, physics, policy, bare = (1e6 * statistics.median(column) / scene.steps for column in columns)
    return {
        "side": side,
        "tables": candles + tables,
        "candles": candles,
        "real_time_factor": 1e6 * scene.env.control_timestep() / total,
        "microseconds_a_step": total,
        "microseconds_physics": physics,
        "microseconds_policy": policy,
        "microseconds_task": total - physics - policy,
        "microseconds_bare": bare,
    }


def _ratios(few: dict[str, float], many: dict[str, float]) -> dict[str, float]:
    """By how much more there is of everything."""
    return {
        "cells": (many["side"] / few["side"]) ** 2,
        "objects": (many["tables"] + many["candles"]) / (few["tables"] + few["candles"]),
        "time": many["microseconds_a_step"] / few["microseconds_a_step"],
    }


# -- What foresight costs as houses grow, in time of the processor: preparation, memory, decisions ---


_BATCH = 400  # episodes at once
_SECONDS = 4  # for which they run, times the repeats, if they do not end before
_HALF, _LARGE_HOUSE = "20 x 20", "40 x 40, 40 candles"


@dataclasses.dataclass(frozen=True)
class Budget:
    """What foresight may cost in a house, on one core: seconds, milliseconds, megabytes, timesteps a second."""

    preparation: float = np.inf
    decision: float = np.inf
    memory: float = 2000.0
    speed: float = 0.0


_FORESIGHT_HOUSES = {
    "paper": "paper",
    "apartment": "apartment",
    _HALF: "house-0-20x20",
    _LARGE_HOUSE: "house-0-40x40-stairwells6-candles40-tables20-bins6",
}
_BUDGETS = {"paper": Budget(5.0, 20.0, speed=20_000.0), _LARGE_HOUSE: Budget(60.0, 100.0)}


def foresight(effort: Effort, console: Console) -> dict[str, dict[str, float]]:
    """Every house in a process of its own, in the grid."""
    jobs = [(house, _SECONDS * effort.repeats) for house in _FORESIGHT_HOUSES.values()]
    figures = {}
    for name, job in zip(_FORESIGHT_HOUSES, jobs, strict=True):
        [(_, figures[name])] = run_jobs(cost, [job], 2)
    table = make_table("Foresight in the grid, one core", "house", "cells", "preparation s", "peak MB", "ms a decision",
                       "of 100 the longest", "timesteps/s", "as it shall be")  # fmt: skip
    for name, row in figures.items():
        budget = _BUDGETS.get(name, Budget())
        kept = (
            row["preparation"] <= budget.preparation
            and row["decision_99"] <= budget.decision
            and row["megabytes"] <= budget.memory
            and row["timesteps_a_second"] >= budget.speed
        )
        table.add_row(name, f"{row['cells']}", f"{row['preparation']:.1f}", f"{row['megabytes']:.0f}",
                      f"{row['decision']:.1f}", f"{row['decision_99']:.1f}", f"{row['timesteps_a_second']:,.0f}",
                      "yes" if kept else "NO")  # fmt: skip
    console.print(table)
    return figures


def cost(job: tuple[str, int]) -> dict[str, Any]:
    """Measures a house in a worker.

    Args:
        job: The name of the house, and for how many seconds at least to run the batch.
    """
    house, seconds = job
    plan = FloorPlan.load(house)
    start = time.process_time()
    caregiver = ForesightCaregiver(plan)
    preparation = time.process_time() - start
    world, clock = GridWorld(plan, EPSILON, caregiver), Clock(time.process_time)
    with clock.of(caregiver, "decide"):
        world.run(tapes(1))
    milliseconds = [1000 * call for call in clock.times]
    _speed(world, seconds)  # finds the ways round children, which a house keeps
    return {
        "cells": len(plan.free_cells),
        "preparation": preparation,
        "decision": statistics.median(milliseconds),
        "decision_99": float(np.percentile(milliseconds, 99)),
        "timesteps_a_second": _speed(world, seconds),
        "megabytes": _peak(),  # after all the rest
    }


def _speed(world: GridWorld, seconds: float) -> float:
    """Novice timesteps a second of a batch, which runs for so many seconds, or to its end."""
    chance = tapes(_BATCH)
    world.reset(chance)
    start = time.process_time()
    while world.timestep < len(chance[0][0].steps) and time.process_time() - start < seconds:
        world.step()
    return _BATCH * world.timestep / (time.process_time() - start)


def _peak() -> float:
    """The most memory that the process has had, in MB. What `resource` says counts the parent's, too."""
    status = pathlib.Path("/proc/self/status").read_text(encoding="ascii")
    return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")) * 1.024e-3


# -- Frames a second of every camera -----------------------------------------------------------------


_FRAME = (480, 640)  # height, width
_CAMERAS = ("overview", "follow", "wrist")


def rendering(effort: Effort, console: Console) -> dict[str, float] | None:
    """Frames a second by camera; None where nothing can be drawn."""
    env = load("supervise", "paper", EPSILON, random=0)
    env.reset()
    height, width = _FRAME
    table = make_table(f"Rendering, {width} x {height}", "camera", "frames a second", "ms a frame")
    figures = {}
    try:
        for camera in _CAMERAS:
            draw = functools.partial(env.physics.render, height, width, camera_id=camera)
            draw()
            figures[camera] = 1 / statistics.median(seconds_of(draw) for _ in range(effort.frames))
            table.add_row(camera, f"{figures[camera]:.1f}", f"{1e3 / figures[camera]:.1f}")
    except RenderingError as error:
        console.print(f"Rendering was skipped: {error}\n")
        return None
    table.add_row("prototype, as large", f"{1e3 / PROTOTYPE[RENDERING]:.1f}", prototype(RENDERING))
    console.print(table)
    return figures


# -- What a frame of a film costs, and of what that is made up ---------------------------------------


_FRAMES = 4  # times those of the cameras' section, for no frame is like the next
_TRAIL = 600  # looks
_ROUGH = {"offsamples": 0, "shadowsize": 1024}  # without antialiasing, and shadows half as fine


def filming(effort: Effort, console: Console) -> dict[str, dict[str, float]] | None:
    """Milliseconds of a frame by part, on the clock and of all processor cores; None where nothing can be drawn."""
    frames = _FRAMES * effort.frames
    figures = {}
    try:
        for title, overlay, quality in (("plain", False, {}), ("overlay", True, {}), ("rough", False, _ROUGH)):
            figures[title] = _film(frames, overlay, quality, time.perf_counter)
            figures[f"{title}, processor"] = _film(frames, overlay, quality, time.process_time)
    except RenderingError as error:
        console.print(f"Filming was skipped: {error}\n")
        return None
    width, height = DEFAULT_SIZE
    table = make_table(f"A frame of a film, {width} x {height}, {frames} frames; ms", "part", *figures)
    for part in next(iter(figures.values())):
        table.add_row(part, *(f"{column[part]:.1f}" for column in figures.values()))
    table.add_row("in all", *(f"{sum(column.values()):.1f}" for column in figures.values()))
    console.print(table)
    return figures


def _film(frames: int, overlay: bool, quality: dict[str, int], timer: Callable[[], float]) -> dict[str, float]:
    """Films, and tells how long each part of a frame takes, ms."""
    episode = FilmedEpisode.load(
        children=EPSILON, caregiver="paper-predictive" if overlay else "paper", foresees=overlay
    )
    for name, value in quality.items():
        setattr(episode.env.physics.model.vis.quality, name, value)
    studio = Studio(episode, *DEFAULT_SIZE, "overview", _TRAIL)
    episode.run_until(0.0)
    studio.frame()  # the first one is drawn whole
    clocks = {name: Clock(timer) for name in ("simulation", "house", "insets", "overlay", "display", "rest", "film")}
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        write = stack.enter_context(film_writer(pathlib.Path(folder) / "film.mp4", *DEFAULT_SIZE, DEFAULT_FPS))
        write(studio.frame())
        for name, owner, method in (
            ("simulation", episode, "run_until"),
            ("house", StillCamera, "render"),
            ("insets", Camera, "render"),
            ("overlay", TileLayer, "lay"),
            ("display", hud, "draw"),
            ("rest", studio, "frame"),
        ):
            stack.enter_context(clocks[name].of(owner, method))
        encode = clocks["film"].around(write)
        for number in range(1, frames + 1):
            episode.run_until(number / DEFAULT_FPS)
            encode(studio.frame())
    episode.env.close()
    return {name: 1e3 * clock.own / frames for name, clock in clocks.items()}


# -- Episodes in 1 process and in 2 workers, and the memory of a worker ------------------------------


def processes(effort: Effort, console: Console) -> dict[str, Any]:
    """Real-time factors of all processes together, building not counted, and megabytes."""
    jobs = [(seed, effort.seconds) for seed in range(effort.jobs)]
    results = {count: [result for _, result in run_jobs(run_episode, jobs, count)] for count in (1, 2)}
    factor = {
        count: count * sum(r["simulated"] for r in rows) / sum(r["seconds"] for r in rows)
        for count, rows in results.items()
    }
    figures = {
        "real_time_factor_1": factor[1],
        "real_time_factor_2": factor[2],
        "speed_up": factor[2] / factor[1],
        "megabytes_a_worker": statistics.median(row["megabytes"] for row in results[2]),
    }
    table = make_table("Jobs", "jobs", "x real time, together")
    for count in results:
        table.add_row(str(count), f"{factor[count]:.0f}")
    console.print(table)
    console.print(
        f"2 workers do {figures['speed_up']:.2f} x as much as 1; each takes {figures['megabytes_a_worker']:.0f} MB\n"
    )
    return figures


def run_episode(job: tuple[int, float]) -> dict[str, float]:
    """Runs an episode of a seed, for some simulated seconds, in a worker."""
    import psutil  # here, for it comes with the tests' packages only

    seed, length = job
    env = load("supervise", "paper", EPSILON, random=seed)
    policy = CaregiverPolicy(env)
    timestep = env.reset()
    start = time.perf_counter()
    while not timestep.last() and env.physics.time() < length:
        timestep = env.step(policy(timestep))
    seconds = time.perf_counter() - start
    return {
        "seconds": seconds,
        "simulated": env.physics.time(),
        "megabytes": psutil.Process().memory_info().rss / 1e6,
    }


# -- The same run on our own pool and on a Dask cluster, both of this machine with two workers each --


_WORKERS = 2
_EPISODES = 20  # of `paper` in each house, in the grid: a job each


def executors(effort: Effort, console: Console) -> dict[str, Any]:
    """Houses a second on each, in turns so that both have the machine at its best and worst; starting workers counts.

    Raises:
        AssertionError: The rows are not the same.
    """
    import distributed  # here, for all other sections do without

    logging.getLogger("distributed").setLevel(logging.ERROR)  # of this process; workers talk on standard error
    plans = house_set(f"train-{effort.houses}")
    settings = Settings(plans, "grid", ("paper",), (EPSILON,), _EPISODES)
    seconds: dict[str, float] = {"local": 0.0, "dask": 0.0}
    tables = []

    def measure(name: str, executor: Executor, start: float) -> None:
        tables.append(evaluate(settings, executor=executor).episodes.drop(columns="wall_seconds"))
        seconds[name] += time.perf_counter() - start

    for name in ("local", "dask", "dask", "local"):
        start = time.perf_counter()
        if name == "local":
            measure(name, LocalExecutor(_WORKERS), start)
            continue
        options = {"n_workers": _WORKERS, "threads_per_worker": 1, "dashboard_address": "127.0.0.1:0"}
        with distributed.LocalCluster(**options) as cluster, DaskExecutor(cluster.scheduler_address) as executor:
            measure(name, executor, start)
    for found in tables[1:]:
        pd.testing.assert_frame_equal(found, tables[0], check_exact=True)
    rate = {name: 2 * effort.houses / taken for name, taken in seconds.items()}
    table = make_table(f"Executors, {_WORKERS} workers each", "executor", "houses", "houses/s", "x local")
    for name, houses in rate.items():
        table.add_row(name, str(effort.houses), f"{houses:.1f}", f"{houses / rate['local']:.2f}")
    console.print(table)
    console.print(f"{len(tables[0])} episodes on each, twice: the same rows\n")
    return {"houses": effort.houses, "houses_a_second": rate, "dask_over_local": rate["dask"] / rate["local"]}


# -- The command -------------------------------------------------------------------------------------

SECTIONS = {
    "closed_loop": closed_loop,
    "hitches": hitches,
    "parts": parts,
    "building": building,
    "growth": growth,
    "foresight": foresight,
    "rendering": rendering,
    "filming": filming,
    "processes": processes,
    "executors": executors,
}


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("quick", False, "shorter episodes and fewer repeats: about a minute")
    parser.add("only", list(SECTIONS), "only these sections", choices=SECTIONS)
    parser.add("houses", None, "houses to run on each executor", type=int, metavar="N")
    parser.add_file("json", "also write the figures to a file")


def run(options: argparse.Namespace) -> None:
    """Measure and print."""
    effort = QUICK if options.quick else Effort()
    if options.houses is not None:
        effort = dataclasses.replace(effort, houses=options.houses)
    console = make_console()
    load = os.getloadavg()[0]
    figures: dict[str, Any] = {
        "versions": versions(),
        "cores": os.cpu_count(),
        "load_before": load,
        "effort": dataclasses.asdict(effort),
        "prototype": PROTOTYPE,
    }
    console.print(f"{os.cpu_count()} cores; load before the start {load:.1f}: figures are low if that is not near 0\n")
    for name in options.only:
        figures[name] = SECTIONS[name](effort, console)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")

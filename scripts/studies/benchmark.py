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
import mujoco
import numpy as np
import pandas as pd
from rich.console import Console

from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.errors import RenderingError
from caregiver_mj.experiments.cluster import DaskExecutor
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.provenance import versions
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.workers import Executor, LocalExecutor, run_jobs
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.house.rendering import control
from caregiver_mj.house.scene import child_joints
from caregiver_mj.house.touch import Touch
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import house_set
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.robot import kinematics, reach
from caregiver_mj.robot.base_path import BasePath
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
    """How long to measure."""

    seconds: float = 340.0  # simulated seconds of an episode
    repeats: int = 5  # how often everything that is compared is repeated
    knocked: int = 6  # episodes in which a candle is knocked over
    frames: int = 120  # frames of a film
    houses: int = 100  # houses to run on each executor


QUICK = Effort(seconds=60.0, repeats=3, knocked=4, frames=24, houses=10)
EPSILON = 0.5  # of the child in all episodes
HOUSE = "paper"
MANIPULATOR = "manipulator:bring_ball"  # dm_control's
# Times real time of a prototype, measured before this project on 2 cores without a GPU: the closed loop, in an episode
# of 270 s with 44 candles taken and put down; and zero action.
PROTOTYPE = {HOUSE: "108", MANIPULATOR: "35"}


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


# -- A house with the scripted caregiver, and an episode of it on tape -------------------------------


class Scene:
    """A house with the scripted caregiver, and an episode of it on tape.

    Attributes:
        env: The environment.
        policy: What acts in it.
        steps: Control timesteps of the episode.
    """

    def __init__(self, house: str, seconds: float):
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
        factors = f"{row['real_time_factor']:.0f}", PROTOTYPE.get(house, ""), f"{row['bare_real_time_factor']:.0f}"
        table.add_row(house, *factors, f"{row['ratio']:.2f}", *shares)
    for name, factor in figures["dm_control"].items():
        table.add_row(name, f"{factor:.0f}", PROTOTYPE.get(name, ""))
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

Episode = tuple[control.Environment, CaregiverPolicy, Knock | None]
Step = tuple[float, float, str]  # seconds of computing in the policy; when, in simulated seconds; the robot's activity


def hitches(effort: Effort, console: Console) -> dict[str, dict[str, float | str]]:
    """Worst control steps, without the first of an episode, at which the robot stands."""
    table = make_table("Worst control step", "episodes", "steps", "worst ms", "over 50 ms", "at s", "while it would")
    figures: dict[str, dict[str, float | str]] = {}
    for name, episodes in _kinds(effort):
        worst, steps, over = (0.0, 0.0, ""), 0, 0  # and not all steps, for the garbage collector would count those
        for step in (step for episode in episodes for step in _play(*episode, effort.seconds)):
            worst, steps, over = max(worst, step, key=lambda step: step[0]), steps + 1, over + (step[0] > _STEP_GOAL)
        seconds, at, activity = worst
        figures[name] = {"worst": seconds, "over": over, "steps": steps, "activity": activity}
        table.add_row(name, str(steps), f"{1e3 * seconds:.1f}", str(over), f"{at:.1f}", activity)
    console.print(table)
    console.print(f"goal: none takes more than {1e3 * _STEP_GOAL:g} ms of computing, other processes not counted\n")
    return figures


def _kinds(effort: Effort) -> Iterable[tuple[str, Iterable[Episode]]]:
    """Kinds of episodes by their names: whole ones, and candles that are knocked over at the start."""
    for caregiver in _CAREGIVERS:
        yield f"supervise, {caregiver}", (_supervised(house, caregiver) for house in HOUSES[:2])
    yield "candles knocked over", map(_knocked, range(effort.knocked))


def _supervised(house: str, caregiver: str) -> Episode:
    env = load("supervise", load_house(house), EPSILON, random=0, visuals=False)
    return env, CaregiverPolicy(env, caregiver), None


def _knocked(seed: int) -> Episode:
    env = load("relocate_candle", load_house(HOUSES[seed % len(HOUSES)]), EPSILON, random=seed, visuals=False)
    policy = CaregiverPolicy(env)
    env.reset()
    knock = Knock(env.physics, env.task.goal_candle, "candle", seed)
    env.task.reseed(seed)
    return env, policy, knock


def _play(env: control.Environment, policy: CaregiverPolicy, knock: Knock | None, most: float) -> Iterator[Step]:
    """The control steps of an episode, or of its first seconds, without the very first."""
    timestep = env.reset()
    while not timestep.last() and env.physics.time() < most:
        start = time.process_time()
        action = policy(timestep)
        if not timestep.first():
            yield time.process_time() - start, env.physics.time(), policy.activity
        if knock:
            knock.apply()
        timestep = env.step(action)
        if knock and policy.interventions_done:
            most = -math.inf


# -- What foresight costs as houses grow, in time of the processor: preparation, memory, decisions ---


_BATCH = 400  # episodes at once
_SECONDS = 4  # for which they run, times the repeats, if they do not end before
_LARGE_HOUSE = "40 x 40, 40 candles"
_FORESIGHT_HOUSES = {
    "paper": "paper",
    "apartment": "apartment",
    "20 x 20": "house-0-20x20",
    _LARGE_HOUSE: "house-0-40x40-stairwells6-candles40-tables20-bins6",
}
_MEMORY = 2000.0  # MB that it may take anywhere, and the most of other figures, by house
_MOST = {
    "paper": {"preparation": 5.0, "decision_99": 20.0, "seconds_a_timestep": 1 / 20_000},
    _LARGE_HOUSE: {"preparation": 60.0, "decision_99": 100.0},
}


def foresight(effort: Effort, console: Console) -> dict[str, dict[str, float]]:
    """Every house in a process of its own, in the grid."""
    figures = {}
    table = make_table("Foresight in the grid, one core", "house", "cells", "preparation s", "peak MB", "ms a decision",
                       "of 100 the longest", "timesteps/s", "as it shall be")  # fmt: skip
    for name, house in _FORESIGHT_HOUSES.items():
        [(_, row)] = run_jobs(cost, [(house, _SECONDS * effort.repeats)], 2)
        most = {"megabytes": _MEMORY} | _MOST.get(name, {})
        kept = all(row[what] <= limit for what, limit in most.items())
        table.add_row(name, f"{row['cells']}", f"{row['preparation']:.1f}", f"{row['megabytes']:.0f}",
                      f"{row['decision']:.1f}", f"{row['decision_99']:.1f}", f"{1 / row['seconds_a_timestep']:,.0f}",
                      "yes" if kept else "NO")  # fmt: skip
        figures[name] = row
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
        "seconds_a_timestep": _speed(world, seconds),
        "megabytes": _peak(),  # after all the rest
    }


def _speed(world: GridWorld, seconds: float) -> float:
    """Seconds of a novice timestep of an episode in a batch, which runs for so many seconds, or to its end."""
    chance = tapes(_BATCH)
    world.reset(chance)
    start = time.process_time()
    while world.timestep < len(chance[0][0].steps) and time.process_time() - start < seconds:
        world.step()
    return (time.process_time() - start) / (_BATCH * world.timestep)


def _peak() -> float:
    """The most memory that the process has had, in MB. What `resource` says counts the parent's, too."""
    status = pathlib.Path("/proc/self/status").read_text(encoding="ascii")
    return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")) * 1.024e-3


# -- What a frame of a film costs, and of what that is made up ---------------------------------------


_TRAIL = 600  # looks
_ROUGH = {"offsamples": 0, "shadowsize": 1024}  # without antialiasing, and shadows half as fine


def filming(effort: Effort, console: Console) -> dict[str, dict[str, float]] | None:
    """Milliseconds of a frame by part, on the clock and of all processor cores; None where nothing can be drawn."""
    figures = {}
    try:
        for title, overlay, quality in (("plain", False, {}), ("overlay", True, {}), ("rough", False, _ROUGH)):
            figures[title] = _film(effort.frames, overlay, quality, time.perf_counter)
            figures[f"{title}, processor"] = _film(effort.frames, overlay, quality, time.process_time)
    except RenderingError as error:
        console.print(f"Filming was skipped: {error}\n")
        return None
    width, height = DEFAULT_SIZE
    table = make_table(f"A frame of a film, {width} x {height}, {effort.frames} frames; ms", "part", *figures)
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
    "foresight": foresight,
    "filming": filming,
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
    }
    console.print(f"{os.cpu_count()} cores; load before the start {load:.1f}: figures are low if that is not near 0\n")
    for name in options.only:
        figures[name] = SECTIONS[name](effort, console)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")

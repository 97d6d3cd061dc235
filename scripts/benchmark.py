"""How fast everything is: prints tables, and writes the figures as JSON if asked to.

Figures that are to be compared are measured in turn, within one run, and every one is the median of its repeats:
machines and their load differ, ratios much less.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import dataclasses
import functools
import json
import os
import pathlib
import statistics
import time
from collections.abc import Callable, Iterator
from typing import Any, ClassVar
from unittest import mock

import mink
import mujoco
import numpy as np
import psutil
from display import make_console, make_table
from houses import generated
from rich.console import Console
from ruckig import ControlInterface, InputParameter, Ruckig, Synchronization, Trajectory

import caregiver_mj
from caregiver_mj.caregivers.caregiver import PaperCaregiver
from caregiver_mj.errors import RenderingError
from caregiver_mj.experiments.versions import versions
from caregiver_mj.experiments.workers import run_jobs
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.robot_body import WHEELS
from caregiver_mj.house.scene import child_joints
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot import kinematics, limits
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.trajectories import BasePath, ScalarMotion

_EPSILON = 0.5
_HOUSES = ("paper", "apartment")
_FRAME = (480, 640)  # height, width
_LARGE = 40  # cells a side of the houses in which only tables and candles grow
_BUILDING_GOAL = 1.0  # seconds for the model of a 12 x 10 house

_MANIPULATOR, _HUMANOID = "manipulator:bring_ball", "humanoid:walk"  # dm_control's, to compare with
_TASK, _DECISION = "task: toddler, observation, reward", "caregiver: a decision"
_SOLVE, _PLAN, _SAMPLE = "mink: one iteration (solve_ik)", "ruckig: plan, 1 axis to a position", "ruckig: sample"

# Prototype: measured before this project, on 2 cores without a GPU.
_PROTOTYPE = {
    "paper": 108.0,  # x real time: the closed loop, an episode of 270 s with 44 candles taken and put down
    _MANIPULATOR: 35.0,  # x real time, zero action
    _SOLVE: 86.0,  # us
    _PLAN: 4.4,  # us
    _SAMPLE: 0.5,  # us
    "rendering": 49.0,  # ms for a frame of 640 x 480 with shadows and 4 x MSAA
}


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
    """

    seconds: float = 340.0
    repeats: int = 5
    large_seconds: float = 100.0
    frames: int = 30
    calls: int = 2000
    jobs: int = 6


_QUICK = Effort(seconds=60.0, repeats=3, large_seconds=20.0, frames=6, calls=300, jobs=4)


class Clock:
    """Measures the time spent in functions. It stands still while another clock runs within them.

    Attributes:
        own: Seconds in all, without those of the clocks within.
        times: Seconds of every call, with them. Calls of the same clock within calls are none of their own.
    """

    _running: ClassVar[list[Clock]] = []

    def __init__(self):
        self.own = 0.0
        self.times: list[float] = []

    def around(self, function: Callable) -> Callable:
        """The same function, timed."""

        @functools.wraps(function)
        def timed(*args, **kwargs):
            if self in self._running:
                return function(*args, **kwargs)
            self._running.append(self)
            start = time.perf_counter()
            try:
                return function(*args, **kwargs)
            finally:
                seconds = time.perf_counter() - start
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


# -- The closed loop, and the physics in it alone ------------------------------------------------------


class Scene:
    """A house with the scripted caregiver, and an episode of it on tape."""

    def __init__(self, house: str | FloorPlan, seconds: float):
        self.env = caregiver_mj.load("supervise", house, _EPSILON, random=0, task_kwargs={"time_limit": float("inf")})
        self.policy = caregiver_mj.CaregiverPolicy(self.env)
        self.steps = round(seconds / self.env.control_timestep())

    def run(self) -> tuple[float, float, float]:
        """Runs the episode: seconds in all, in the physics, in the policy."""
        physics, policy = Clock(), Clock()
        act = policy.around(self.policy)
        timestep = self._begin()
        with physics.of(self.env.physics, "step"):
            start = time.perf_counter()
            for _ in range(self.steps):
                timestep = self.env.step(act(timestep))
            total = time.perf_counter() - start
        return total, physics.own, policy.own

    def record(self) -> None:
        """Runs the episode once, and keeps what drives the physics in it."""
        physics = self.env.physics
        model, data, step = physics.model.ptr, physics.data.ptr, physics.step
        joints = [model.joint(name) for name in child_joints(0)]
        self._q = np.array([joint.qposadr[0] for joint in joints])
        # The task writes the wheels' speeds as well; with them the replay is the same to the last bit.
        self._v = np.array([joint.dofadr[0] for joint in (*joints, *(model.joint(name) for name in WHEELS))])
        self._tape: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

        def taped(nstep: int) -> None:
            if not self._tape:
                self._start = copy.copy(data)
            self._tape.append((data.ctrl.copy(), data.qpos[self._q], data.qvel[self._v]))
            step(nstep)

        timestep = self._begin()
        with mock.patch.object(physics, "step", taped):
            for _ in range(self.steps):
                timestep = self.env.step(self.policy(timestep))
        self._end = data.qpos.copy()

    def replay(self) -> tuple[float, float]:
        """Replays the tape through bare `mj_step`.

        Returns:
            Seconds that it took, and by how much the end differs from that of the episode.
        """
        model, data = self.env.physics.model.ptr, mujoco.MjData(self.env.physics.model.ptr)
        mujoco.mj_copyData(data, model, self._start)
        substeps = round(self.env.control_timestep() / model.opt.timestep)
        ctrl, qpos, qvel = data.ctrl, data.qpos, data.qvel
        start = time.perf_counter()
        for controls, positions, velocities in self._tape:
            ctrl[:], qpos[self._q], qvel[self._v] = controls, positions, velocities
            mujoco.mj_step(model, data, substeps)
        return time.perf_counter() - start, float(np.abs(data.qpos - self._end).max())

    def dissect(self) -> dict[str, dict[str, float]]:
        """Runs the episode with a clock in every part: its share of the whole loop, and its time a call.

        The clocks take time as well, so that small parts look somewhat larger than they are.
        """
        env, policy = self.env, type(self.policy)
        parts = {
            "physics": [(env.physics, "step")],
            "contacts of the toddler": [(env.physics.touch_reader, "read")],
            _TASK: [(env.task, "before_step", "after_step", "get_reward", "get_observation", "get_termination")],
            "dm_control's environment": [(env, "step")],
            _DECISION: [(PaperCaregiver, "watch", "assess", "decide")],
            "inverse kinematics": [(kinematics.Arm, "solve")],
            "trajectories: planned": [(BasePath, "__init__"), (ScalarMotion, "move_to", "run_at")],
            "trajectories: sampled": [(RobotMotion, "action")],
            "paths over the floor": [(Navigator, "path")],
            "skills and the rest": [(policy, "__call__")],
        }
        clocks = {part: Clock() for part in parts}
        kinematics.reach_path.cache_clear()  # inverse kinematics is solved once for each height
        timestep = self._begin()
        with contextlib.ExitStack() as stack:
            for part, owners in parts.items():
                for owner, *names in owners:
                    stack.enter_context(clocks[part].of(owner, *names))
            for _ in range(self.steps):
                timestep = env.step(self.policy(timestep))
        whole = sum(clock.own for clock in clocks.values())
        calls = {part: len(clock.times) for part, clock in clocks.items()}
        # These two consist of several methods: count a call for each control step, and for each novice timestep.
        calls |= {_TASK: self.steps, _DECISION: env.task.timestep}
        return {
            part: {
                "share": clock.own / whole,
                "calls": calls[part],
                "microseconds_a_call": 1e6 * clock.own / max(calls[part], 1),
            }
            for part, clock in clocks.items()
        }

    def _begin(self):
        self.env.task.reseed(0)
        return self.env.reset()


def closed_loop(effort: Effort, console: Console) -> dict[str, Any]:
    """The closed loop in the houses of the package, bare physics and dm_control's own tasks beside it."""
    scenes = {house: Scene(house, effort.seconds) for house in _HOUSES}
    for scene in scenes.values():
        scene.record()
    suite = {name: _suite_task(*name.split(":")) for name in (_MANIPULATOR, _HUMANOID)}
    runs = {house: [] for house in scenes}
    factors: dict[str, list[float]] = {name: [] for name in suite}
    for _ in range(effort.repeats):
        for house, scene in scenes.items():
            runs[house].append((*scene.run(), *scene.replay()))
        for name, run in suite.items():
            factors[name].append(run(min(effort.seconds, 30.0)))

    figures: dict[str, Any] = {"houses": {}, "dm_control": {}}
    title = "Closed loop: supervise, one core; beside it dm_control's tasks with zero action"
    table = make_table(title, "house", "x real time", "prototype", "bare mj_step", "ratio",
                   "physics", "policy", "task")  # fmt: skip
    for house, repeats in runs.items():
        total, physics, policy, bare = (statistics.median(column) for column in list(zip(*repeats, strict=True))[:4])
        row = {
            "real_time_factor": effort.seconds / total,
            "bare_real_time_factor": effort.seconds / bare,
            # The ratio of each repeat's two runs, which follow each other: a load that comes and goes hits both.
            "ratio": statistics.median(run[0] / run[3] for run in repeats),
            "share_physics": physics / total,
            "share_policy": policy / total,
            "share_task": 1 - (physics + policy) / total,
            "replay_deviation": max(run[4] for run in repeats),
            "parts": scenes[house].dissect(),
        }
        figures["houses"][house] = row
        shares = (f"{row[f'share_{part}']:.0%}" for part in ("physics", "policy", "task"))
        table.add_row(house, f"{row['real_time_factor']:.0f}", _prototype(house), f"{row['bare_real_time_factor']:.0f}",
                      f"{row['ratio']:.2f}", *shares)  # fmt: skip
    for name, values in factors.items():
        figures["dm_control"][name] = statistics.median(values)
        table.add_row(name, f"{figures['dm_control'][name]:.0f}", _prototype(name))
    console.print(table)
    paper, manipulator = figures["houses"]["paper"], figures["dm_control"][_MANIPULATOR]
    console.print(f"paper is {paper['real_time_factor'] / manipulator:.1f} x as fast as {_MANIPULATOR}")
    deviation = max(row["replay_deviation"] for row in figures["houses"].values())
    console.print(f"replayed through bare mj_step, the episodes end within {deviation:.1g} m or rad of themselves\n")

    for house, row in figures["houses"].items():
        table = make_table(f"Where the time goes: {house}", "part", "share of the loop", "us a control step", "calls",
                       "us a call")  # fmt: skip
        for part, spent in row["parts"].items():
            call, calls = spent["microseconds_a_call"], spent["calls"]
            step = call * calls / scenes[house].steps
            table.add_row(part, f"{spent['share']:.1%}", f"{step:.1f}", f"{calls}", f"{call:.1f}")
        console.print(table)
    return figures


def _prototype(name: str) -> str:
    """The prototype's figure as text; empty where there is none."""
    return f"{_PROTOTYPE[name]:g}" if name in _PROTOTYPE else ""


def _suite_task(domain: str, task: str) -> Callable[[float], float]:
    """One of dm_control's tasks with zero action: a function from simulated seconds to the real-time factor."""
    from dm_control import suite  # after caregiver_mj.house.rendering, which caregiver_mj has imported by now

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


# -- Parts ---------------------------------------------------------------------------------------------


def parts(effort: Effort, console: Console) -> dict[str, float]:
    """Inverse kinematics and trajectories on their own: medians in microseconds."""
    arm = kinematics.Arm()
    random = np.random.default_rng(0)
    iterations = Clock()
    solves = []
    start = arm.solve(*kinematics.CARRY)
    with iterations.of(mink, "solve_ik"):
        for x, z in random.uniform((0.5, 0.62), (0.7, 0.9), size=(effort.calls, 2)):
            solves.append(_seconds(lambda x=x, z=z: arm.solve(x, z, guess=start)))

    base = limits.BASE

    def inputs(axes: int) -> InputParameter:
        parameters = InputParameter(axes)
        parameters.max_velocity = [base.velocity] * axes
        parameters.max_acceleration, parameters.max_jerk = [base.acceleration] * axes, [base.jerk] * axes
        return parameters

    straight, corner = inputs(1), inputs(2)
    straight.target_position = [3.0]
    corner.control_interface, corner.synchronization = ControlInterface.Velocity, Synchronization.Phase
    corner.current_velocity, corner.target_velocity = [1.0, 0.0], [0.0, 1.0]
    trajectory, solver = Trajectory(1), Ruckig(1)
    figures = {
        "mink: inverse kinematics of a pose": solves,
        _SOLVE: iterations.times,
        _PLAN: [_seconds(lambda: Ruckig(1).calculate(straight, trajectory)) for _ in range(effort.calls)],
        "ruckig: plan again with the same solver": [
            _seconds(lambda: solver.calculate(straight, trajectory)) for _ in range(effort.calls)
        ],
        "ruckig: plan, corner of 2 axes": [
            _seconds(lambda: Ruckig(2).calculate(corner, Trajectory(2))) for _ in range(effort.calls)
        ],
        _SAMPLE: [_seconds(lambda: trajectory.at_time(1.0)) for _ in range(effort.calls)],
    }
    medians = {name: 1e6 * statistics.median(seconds) for name, seconds in figures.items()}
    table = make_table("Parts", "call", "us", "prototype")
    for name, microseconds in medians.items():
        table.add_row(name, f"{microseconds:.1f}", _prototype(name))
    console.print(table)
    return medians


def building(effort: Effort, console: Console) -> dict[str, dict[str, float]]:
    """How long it takes to build a house, and everything round it."""
    plans = {
        "12 x 10, 2 candles": _small_plan,
        "40 x 40, 40 candles": lambda: generated(40, 40, candles=40, tables=40, stairwells=6, bins=6),
    }
    table = make_table("Building a house", "house", "model s", "environment s", "caregiver s")
    # Pictures of wood and grass are painted once in a process.
    [(_, first)] = run_jobs(build_first, [0], 2)
    figures = {"first in a process": {"model": first}}
    table.add_row("12 x 10, the first in a process", f"{first:.2f}")
    for name, plan in plans.items():
        times: list[tuple[float, float, float]] = []
        for _ in range(effort.repeats):  # a new plan each time: plans keep what they have worked out
            model = _seconds(lambda plan=plan: Physics.from_plan(plan()))
            fresh, start = plan(), time.perf_counter()
            env = caregiver_mj.load("supervise", fresh, _EPSILON, random=0)
            ready = time.perf_counter()
            policy = caregiver_mj.CaregiverPolicy(env)
            policy(env.reset())
            times.append((model, ready - start, time.perf_counter() - ready))
        row = [statistics.median(column) for column in zip(*times, strict=True)]
        figures[name] = dict(zip(("model", "environment", "caregiver_to_first_action"), row, strict=True))
        table.add_row(name, *(f"{seconds:.2f}" for seconds in row))
    console.print(table)
    verdict = "as it shall be" if first < _BUILDING_GOAL else "TOO SLOW"
    console.print(f"a 12 x 10 house in less than {_BUILDING_GOAL:g} s, even the first in a process: {verdict}\n")
    return figures


def _small_plan() -> FloorPlan:
    return generated(10, 12, candles=2, tables=3)


def build_first(_: int) -> float:
    """Builds a house in a worker that has built none."""
    plan = _small_plan()
    return _seconds(lambda: Physics.from_plan(plan))


def growth(effort: Effort, console: Console) -> dict[str, Any]:
    """The closed loop as houses, tables and candles get more."""
    sizes = ((12, 2, 2), (20, 10, 10), (30, 20, 20), (_LARGE, 5, 5), (_LARGE, 20, 20), (_LARGE, 40, 40))
    scenes = [
        Scene(generated(side, side, candles, tables, stairwells=4, bins=4), effort.large_seconds)
        for side, candles, tables in sizes
    ]
    for scene in scenes:
        scene.record()
    runs = [[] for _ in scenes]
    for _ in range(effort.repeats):
        for scene, repeats in zip(scenes, runs, strict=True):
            repeats.append((*scene.run(), scene.replay()[0]))
    table = make_table("The closed loop as houses grow", "cells", "tables", "candles", "x real time",
                       "us a control step", "physics", "policy", "task", "bare mj_step")  # fmt: skip
    rows = []
    for (side, candles, tables), scene, repeats in zip(sizes, scenes, runs, strict=True):
        columns = zip(*repeats, strict=True)
        total, physics, policy, bare = (1e6 * statistics.median(column) / scene.steps for column in columns)
        row = {
            "side": side, "tables": candles + tables, "candles": candles,
            "real_time_factor": 1e6 * scene.env.control_timestep() / total, "microseconds_a_step": total,
            "microseconds_physics": physics, "microseconds_policy": policy,
            "microseconds_task": total - physics - policy, "microseconds_bare": bare,
        }  # fmt: skip
        rows.append(row)
        table.add_row(f"{side} x {side}", *(f"{value:.0f}" for value in list(row.values())[1:]))
    console.print(table)

    def ratios(few: dict[str, float], many: dict[str, float]) -> dict[str, float]:
        return {
            "cells": (many["side"] / few["side"]) ** 2,
            "objects": (many["tables"] + many["candles"]) / (few["tables"] + few["candles"]),
            "time": many["microseconds_a_step"] / few["microseconds_a_step"],
        }

    in_all, large = ratios(rows[0], rows[-1]), [row for row in rows if row["side"] == _LARGE]
    at_large = ratios(large[0], large[-1])
    verdict = "at most linear, as it shall be" if at_large["time"] <= at_large["objects"] else "MORE THAN LINEAR"
    for where, ratio in ((f"{in_all['cells']:.0f} x the cells", in_all), (f"{_LARGE} x {_LARGE} cells", at_large)):
        console.print(f"{ratio['objects']:.0f} x the tables and candles in {where} take {ratio['time']:.1f} x the time")
    console.print(f"growth with the tables and candles at one size of house: {verdict}\n")
    return {"houses": rows, "ratios": in_all, "ratios_at_one_size": at_large}


def rendering(effort: Effort, console: Console) -> dict[str, float] | None:
    """Frames a second of every camera."""
    env = caregiver_mj.load("supervise", "paper", _EPSILON, random=0)
    env.reset()
    height, width = _FRAME
    table = make_table(f"Rendering, {width} x {height}", "camera", "frames a second", "ms a frame")
    figures = {}
    try:
        for camera in ("overview", "follow", "robot/wrist"):
            draw = functools.partial(env.physics.render, height, width, camera_id=camera)
            draw()
            figures[camera] = 1 / statistics.median(_seconds(draw) for _ in range(effort.frames))
            table.add_row(camera, f"{figures[camera]:.1f}", f"{1e3 / figures[camera]:.1f}")
    except RenderingError as error:
        console.print(f"Rendering was skipped: {error}\n")
        return None
    table.add_row("prototype, as large", f"{1e3 / _PROTOTYPE['rendering']:.1f}", _prototype("rendering"))
    console.print(table)
    return figures


# -- Processes -----------------------------------------------------------------------------------------


def run_episode(job: tuple[int, float]) -> dict[str, float]:
    """Runs an episode of a seed, for some simulated seconds, in a worker."""
    seed, length = job
    env = caregiver_mj.load("supervise", "paper", _EPSILON, random=seed)
    policy = caregiver_mj.CaregiverPolicy(env)
    timestep = env.reset()
    start = time.perf_counter()
    while not timestep.last() and env.physics.time() < length:
        timestep = env.step(policy(timestep))
    memory = psutil.Process().memory_info().rss / 1e6
    seconds = time.perf_counter() - start
    return {"seconds": seconds, "simulated": env.physics.time(), "megabytes": memory}


def processes(effort: Effort, console: Console) -> dict[str, Any]:
    """Episodes in 1 process and in 2 workers, building not counted, and the memory of a worker."""
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


# -- The rest ------------------------------------------------------------------------------------------


def _seconds(function: Callable[[], Any]) -> float:
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


_SECTIONS = {
    "closed_loop": closed_loop,
    "parts": parts,
    "building": building,
    "growth": growth,
    "rendering": rendering,
    "processes": processes,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="shorter episodes and fewer repeats: about a minute")
    parser.add_argument("--only", nargs="+", choices=_SECTIONS, default=list(_SECTIONS), help="only these sections")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="also write the figures to a file")
    args = parser.parse_args()
    effort = _QUICK if args.quick else Effort()
    console = make_console()
    load = os.getloadavg()[0]
    figures: dict[str, Any] = {
        "versions": versions(),
        "cores": os.cpu_count(),
        "load_before": load,
        "effort": dataclasses.asdict(effort),
        "prototype": _PROTOTYPE,
    }
    console.print(f"{os.cpu_count()} cores; load before the start {load:.1f}: figures are low if that is not near 0\n")
    for name in args.only:
        figures[name] = _SECTIONS[name](effort, console)
    if args.json:
        args.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

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
from typing import Any
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
from caregiver_mj.caregiver import PaperCaregiver
from caregiver_mj.errors import RenderingError
from caregiver_mj.evaluation import versions
from caregiver_mj.floor_plan import FloorPlan
from caregiver_mj.robot import kinematics, limits
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.trajectories import BasePath, ScalarMotion
from caregiver_mj.tasks.base import WHEELS, Physics
from caregiver_mj.workers import run_jobs

_EPSILON = 0.5
_HOUSES = ("paper", "apartment")
_FRAME = (480, 640)  # height, width


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
    """Adds up the time spent in functions; calls within calls count once."""

    def __init__(self):
        self.seconds, self.calls, self._depth = 0.0, 0, 0

    def around(self, function: Callable) -> Callable:
        """The same function, timed."""

        @functools.wraps(function)
        def timed(*args, **kwargs):
            self._depth += 1
            start = time.perf_counter()
            try:
                return function(*args, **kwargs)
            finally:
                self._depth -= 1
                if not self._depth:
                    self.seconds += time.perf_counter() - start
                    self.calls += 1

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
        return total, physics.seconds, policy.seconds

    def record(self) -> None:
        """Runs the episode once, and keeps what drives the physics in it."""
        physics = self.env.physics
        model, data, step = physics.model.ptr, physics.data.ptr, physics.step
        joints = [model.joint(name) for name in ("toddler/x", "toddler/y", "toddler/yaw")]
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
        """Runs the episode with clocks in the policy: for each part its share of the policy and time a call."""
        parts = {
            "caregiver": [(PaperCaregiver, "watch", "assess", "decide")],
            "inverse kinematics": [(kinematics.Arm, "solve")],
            "trajectories: planned": [(BasePath, "__init__"), (ScalarMotion, "move_to", "run_at")],
            "trajectories: sampled": [(RobotMotion, "action")],
            "paths over the floor": [(Navigator, "path")],
        }
        clocks = {part: Clock() for part in parts}
        kinematics.reach_path.cache_clear()  # inverse kinematics is solved once for each height
        timestep = self._begin()
        policy = Clock()
        act = policy.around(self.policy)
        with contextlib.ExitStack() as stack:
            for part, owners in parts.items():
                for owner, *names in owners:
                    stack.enter_context(clocks[part].of(owner, *names))
            for _ in range(self.steps):
                timestep = self.env.step(act(timestep))
        figures = {
            part: {
                "share_of_policy": clock.seconds / policy.seconds,
                "calls": clock.calls,
                "microseconds_a_call": 1e6 * clock.seconds / max(clock.calls, 1),
            }
            for part, clock in clocks.items()
        }
        # As a caregiver decides once a novice timestep, count that instead of its methods' calls.
        figures["caregiver"] |= {"calls": self.env.task.timestep}
        figures["caregiver"]["microseconds_a_call"] = 1e6 * clocks["caregiver"].seconds / self.env.task.timestep
        rest = policy.seconds - sum(clock.seconds for clock in clocks.values())
        figures["skills and the rest"] = {
            "share_of_policy": rest / policy.seconds,
            "calls": self.steps,
            "microseconds_a_call": 1e6 * rest / self.steps,
        }
        return figures

    def _begin(self):
        self.env.task.reseed(0)
        return self.env.reset()


def closed_loop(effort: Effort, console: Console) -> dict[str, Any]:
    """The closed loop in the houses of the package, bare physics and dm_control's own tasks beside it."""
    scenes = {house: Scene(house, effort.seconds) for house in _HOUSES}
    for scene in scenes.values():
        scene.record()
    suite = {name: _suite_task(*name.split(":")) for name in ("manipulator:bring_ball", "humanoid:walk")}
    runs = {house: [] for house in scenes}
    factors: dict[str, list[float]] = {name: [] for name in suite}
    for _ in range(effort.repeats):
        for house, scene in scenes.items():
            runs[house].append((*scene.run(), *scene.replay()))
        for name, run in suite.items():
            factors[name].append(run(min(effort.seconds, 30.0)))

    figures: dict[str, Any] = {"houses": {}, "dm_control": {}}
    table = make_table("Closed loop: supervise, one core", "house", "x real time", "bare mj_step", "ratio",
                   "physics", "policy", "task", "replay off by")  # fmt: skip
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
            "policy_parts": scenes[house].dissect(),
        }
        figures["houses"][house] = row
        table.add_row(house, f"{row['real_time_factor']:.0f}", f"{row['bare_real_time_factor']:.0f}",
                      f"{row['ratio']:.2f}", *(f"{row[f'share_{part}']:.0%}" for part in ("physics", "policy", "task")),
                      f"{row['replay_deviation']:.1g}")  # fmt: skip
    for name, values in factors.items():
        figures["dm_control"][name] = statistics.median(values)
        table.add_row(f"dm_control {name}, zero action", f"{figures['dm_control'][name]:.0f}")
    console.print(table)
    paper, manipulator = figures["houses"]["paper"], figures["dm_control"]["manipulator:bring_ball"]
    console.print(f"paper is {paper['real_time_factor'] / manipulator:.1f} x as fast as manipulator:bring_ball\n")

    title = "Inside the policy (the caregiver: decisions; the rest: calls)"
    table = make_table(title, "part", *(f"{h}: {c}" for h in _HOUSES for c in ("share", "calls", "us a call")))
    for part in figures["houses"]["paper"]["policy_parts"]:
        cells = []
        for house in _HOUSES:
            row = figures["houses"][house]["policy_parts"][part]
            cells += [f"{row['share_of_policy']:.1%}", f"{row['calls']}", f"{row['microseconds_a_call']:.1f}"]
        table.add_row(part, *cells)
    console.print(table)
    return figures


def _suite_task(domain: str, task: str) -> Callable[[float], float]:
    """One of dm_control's tasks with zero action: a function from simulated seconds to the real-time factor."""
    from dm_control import suite  # after caregiver_mj.rendering, which caregiver_mj has imported by now

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
    trajectory = Trajectory(1)
    figures = {
        "mink: inverse kinematics of a pose": solves,
        "ruckig: calculate, 1 axis to a position": [
            _seconds(lambda: Ruckig(1).calculate(straight, trajectory)) for _ in range(effort.calls)
        ],
        "ruckig: calculate, corner of 2 axes": [
            _seconds(lambda: Ruckig(2).calculate(corner, Trajectory(2))) for _ in range(effort.calls)
        ],
        "ruckig: sample": [_seconds(lambda: trajectory.at_time(1.0)) for _ in range(effort.calls)],
    }
    medians = {name: 1e6 * statistics.median(seconds) for name, seconds in figures.items()}
    medians["mink: one iteration (solve_ik)"] = 1e6 * iterations.seconds / iterations.calls
    table = make_table("Parts", "call", "us")
    for name, microseconds in medians.items():
        table.add_row(name, f"{microseconds:.1f}")
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
    return figures


def _small_plan() -> FloorPlan:
    return generated(10, 12, candles=2, tables=3)


def build_first(_: int) -> float:
    """Builds a house in a worker that has built none."""
    plan = _small_plan()
    return _seconds(lambda: Physics.from_plan(plan))


def growth(effort: Effort, console: Console) -> list[dict[str, float]]:
    """The closed loop as houses, tables and candles get more."""
    sizes = ((12, 2, 2), (20, 10, 10), (30, 20, 20), (40, 5, 5), (40, 20, 20), (40, 40, 40))
    table = make_table("The closed loop as houses grow", "cells", "tables", "candles", "x real time",
                       "us a control step", "physics", "policy", "task", "bare mj_step")  # fmt: skip
    figures = []
    for side, candles, tables in sizes:
        scene = Scene(generated(side, side, candles, tables, stairwells=4, bins=4), effort.large_seconds)
        scene.record()
        runs = [(*scene.run(), scene.replay()[0]) for _ in range(effort.repeats)]
        total, *rest = (1e6 * statistics.median(column) / scene.steps for column in zip(*runs, strict=True))
        physics, policy, bare = rest
        row = {
            "side": side, "tables": candles + tables, "candles": candles,
            "real_time_factor": 1e6 * scene.env.control_timestep() / total, "microseconds_a_step": total,
            "microseconds_physics": physics, "microseconds_policy": policy,
            "microseconds_task": total - physics - policy, "microseconds_bare": bare,
        }  # fmt: skip
        figures.append(row)
        table.add_row(f"{side} x {side}", *(f"{value:.0f}" for value in list(row.values())[1:]))
    console.print(table)
    least, most = min(figures, key=lambda row: row["tables"]), max(figures, key=lambda row: row["tables"])
    objects, sides, cost = (most[key] / least[key] for key in ("tables", "side", "microseconds_a_step"))
    console.print(f"{objects:.0f} x the tables and candles in {sides**2:.0f} x the cells take {cost:.1f} x the time\n")
    return figures


def rendering(effort: Effort, console: Console) -> dict[str, float] | None:
    """Frames a second of every camera."""
    env = caregiver_mj.load("supervise", "paper", _EPSILON, random=0)
    env.reset()
    height, width = _FRAME
    table = make_table(f"Rendering, {width} x {height}", "camera", "frames a second")
    figures = {}
    try:
        for camera in ("overview", "follow", "robot/wrist"):
            draw = functools.partial(env.physics.render, height, width, camera_id=camera)
            draw()
            figures[camera] = 1 / statistics.median(_seconds(draw) for _ in range(effort.frames))
            table.add_row(camera, f"{figures[camera]:.1f}")
    except RenderingError as error:
        console.print(f"Rendering was skipped: {error}\n")
        return None
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
    }
    console.print(f"{os.cpu_count()} cores; load before the start {load:.1f}: figures are low if that is not near 0\n")
    for name in args.only:
        figures[name] = _SECTIONS[name](effort, console)
    if args.json:
        args.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

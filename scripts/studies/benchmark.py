"""How fast everything is: the closed loop beside its physics alone, where its time goes, and what grows with what."""

from __future__ import annotations

import argparse
import contextlib
import copy
import functools
import gc
import itertools
import os
import pathlib
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from typing import Any, ClassVar
from unittest import mock

import dm_env
import mujoco
import numpy as np
import pandas as pd

from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.experiments.runner import HouseRollout
from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.experiments.workers import run_jobs
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.house.scene import child_joints
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.recording.ledger import Touch
from caregiver_mj.robot import kinematics, reach
from caregiver_mj.robot.base_path import BasePath
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.scalar_motion import ScalarMotion
from caregiver_mj.tasks import load
from caregiver_mj.viz import hud
from caregiver_mj.viz.cameras import StillCamera
from caregiver_mj.viz.episode import Episode
from caregiver_mj.viz.film import Picture, Studio, render_episode
from study import Parser, streams, table

Row = dict[str, float]

EPSILON = 0.5  # of the child in all episodes
# Of the closed loop: two homes, the second with a gate and three batteries, and the largest of the plans below.
HOUSES = ("paper", "apartment", "home-600000", "home-600003", "house-0-40x40-stairwells6-candles40-tables20-bins6")
# One after the other in a process; the first are as above.
MANY = (*HOUSES, *(f"{kind}-{seed}" for seed in range(600_010, 600_060) for kind in ("house", "home")))
SIGHTS = ("all", "walls", "camera")
SUITE = ("manipulator:bring_ball", "humanoid:walk")  # tasks of dm_control
_SUITE_SECONDS = 30.0  # simulated, at most, for each of those
# Where foresight plans, from little to much.
PLANS = ("paper", "apartment", "house-0-20x20", "house-0-40x40-stairwells6-candles40-tables20-bins6")
# Options in the place of the model's own, which the first is, and one of dense and sparse Jacobians; then without
# sleep, nativeccd, multiccd, and any contact at all; at last other timesteps.
CHOICES = [("iterations", 20), ("iterations", 5), ("iterations", 50), ("tolerance", 1e-4), ("tolerance", 1e-10)]
CHOICES += [("cone", 0), ("integrator", 0), ("integrator", 3), ("jacobian", 0), ("jacobian", 1), ("enableflags", 0)]
CHOICES += [("disableflags", 1 << 17), ("disableflags", 1 << 19), ("disableflags", 1 << 4)]
CHOICES += [("timestep", 0.0025), ("timestep", 0.01)]
_BATCH = 400  # episodes at once
_SECONDS = 4  # for which they run, times the repeats, if they do not end before
GROWTH = {  # what grows, all else being the same: the side of a house, candles beside its two stairwells, and children
    "cells": [(side, 4, 1) for side in (10, 20, 40, 70, 100)],
    "hazards": [(40, candles, 1) for candles in (0, 18, 78)],
    "children": [(40, 4, children) for children in (1, 3, 8)],
}
_GROWN_BATCH, _GROWN_TIMESTEPS = 100, 4  # in the grid


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("seconds", 340.0, "simulated seconds of an episode")
    parser.add("repeats", 5, "how often everything that is compared is repeated")
    parser.add("only", list(SECTIONS), "only these sections", choices=SECTIONS)


def run(options: argparse.Namespace) -> None:
    """Measure and print."""
    load = f"{os.cpu_count()} cores; load before {os.getloadavg()[0]:.1f}: figures are low if that is not near 0"
    print(load, file=sys.stderr)
    for name in options.only:
        for title, figures in SECTIONS[name](options.seconds, options.repeats):
            rows = [[str(name), *map(_shown, row)] for name, *row in figures.itertuples(name=None)]
            print(f"\n{title}\n\n{table(['', *map(str, figures)], rows)}", flush=True)


def _shown(value: Any) -> str:
    return ("" if np.isnan(value) else f"{value:.4g}") if isinstance(value, float) else str(value)


# -- Clocks for parts of a program -------------------------------------------------------------------


class Clock:
    """Measures functions: all seconds without those of clocks within (`own`), and those of each call (`times`)."""

    _running: ClassVar[list[Clock]] = []

    def __init__(self, timer: Callable[[], float] = time.perf_counter):
        self._timer, self.own = timer, 0.0
        self.times: list[float] = []

    def around(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the same function, timed."""

        @functools.wraps(function)
        def timed(*args: Any, **kwargs: Any) -> Any:
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
        """Time methods of a class or of an object meanwhile."""
        with contextlib.ExitStack() as stack:
            for name in names:
                stack.enter_context(mock.patch.object(owner, name, self.around(getattr(owner, name))))
            yield self


# -- The closed loop; bare physics and dm_control's own tasks beside it ------------------------------


class Scene:
    """A house with the scripted caregiver, and a recorded episode of it."""

    def __init__(
        self,
        house: str,
        seconds: float,
        caregiver: str = "expected-danger",
        sight: str = "all",
        children: int = 1,
        visuals: bool = True,
    ):
        family, forever = [EPSILON] * children, {"time_limit": float("inf")}
        self.env = load("supervise", house, family, 0, task_kwargs=forever, sight=sight, visuals=visuals)
        self.policy = CaregiverPolicy(self.env, caregiver)
        self.steps = round(seconds / self.env.control_timestep())

    def play(self, act: Callable[[dm_env.TimeStep], np.ndarray] | None = None) -> float:
        """Play the episode from its start, with the policy or what is given in its place; return its seconds."""
        rollout = HouseRollout(self.env, act or self.policy)
        rollout.begin(0)
        start = time.perf_counter()
        rollout.run_on(until=lambda: rollout.steps == self.steps)
        return time.perf_counter() - start

    def record(self) -> None:
        """Play the episode once, and keep what drives the physics in it."""
        physics = self.env.physics
        model, data, step = physics.model.ptr, physics.data.ptr, physics.step
        joints = [model.joint(name) for name in child_joints(0)]
        self._q = np.array([joint.qposadr[0] for joint in joints])
        # The task writes the wheels' speeds as well; with them the replay is the same to the last bit.
        wheels = [model.joint(f"robot/{name}") for name in self.env.task.embodiment.names.wheels]
        self._v = np.array([joint.dofadr[0] for joint in (*joints, *wheels)])
        self._recorded: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

        def recording(nstep: int) -> None:
            if not self._recorded:
                self._start = copy.copy(data)
            driven = data.qpos[self._q], data.qvel[self._v]
            touches: list[Touch] = []
            controls = np.empty((nstep, model.nu))
            for i in range(nstep):  # the actuators' commands change with every step
                step(1)
                controls[i], touches = data.ctrl, touches + physics.touches
            physics.touches = touches
            self._recorded.append((controls, *driven))

        with mock.patch.object(physics, "step", recording):
            self.play()
        self._end, self._timestep = data.qpos.copy(), model.opt.timestep

    def replay(self) -> tuple[float, float]:
        """Replay the recording through bare `mj_step`; return its seconds, and how far the end is from the episode's.

        With another timestep than the recording's, it uses the commands in force at the end of each step.
        """
        model, data = self.env.physics.model.ptr, mujoco.MjData(self.env.physics.model.ptr)
        mujoco.mj_copyData(data, model, self._start)
        ctrl, qpos, qvel = data.ctrl, data.qpos, data.qvel
        steps = len(self._recorded[0][0])
        count = round(steps * self._timestep / model.opt.timestep)
        which = np.ceil(np.arange(1, count + 1) * steps / count).astype(int) - 1
        recording = [(controls[which], *driven) for controls, *driven in self._recorded]  # before the clock starts
        start = time.perf_counter()
        for controls, positions, velocities in recording:
            qpos[self._q], qvel[self._v] = positions, velocities
            for ctrl[:] in controls:
                mujoco.mj_step(model, data)
        return time.perf_counter() - start, float(np.abs(data.qpos - self._end).max())

    def measure(self, seconds: float) -> dict[str, float]:
        """Play the episode of so many simulated seconds and replay it: a row of figures."""
        total = self.play()
        bare, deviation = self.replay()
        policy = Clock(time.process_time)  # other processes do not count; it takes 5 us a step, so on its own
        self.play(policy.around(self.policy))
        return {
            "x real time": seconds / total,
            "bare mj_step": seconds / bare,
            # Of two runs that follow each other: a load that comes and goes hits both.
            "ratio": total / bare,
            "longest decision, ms": 1e3 * max(policy.times[1:]),  # in the first step of an episode the robot stands
            "replay's deviation": deviation,
        }


def closed_loop(seconds: float, repeats: int) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield how fast the loop is, of all in turn, over and over."""
    scenes = {house: Scene(house, seconds) for house in HOUSES}
    plain = {house: Scene(house, seconds, visuals=False) for house in HOUSES}  # as evaluation and training have them
    for scene in scenes.values():
        scene.record()
    suite = {name: _suite_task(*name.split(":")) for name in SUITE}
    rows: list[dict[str, Any]] = []
    for _ in range(repeats):
        for house, scene in scenes.items():
            rows.append({"": house, **scene.measure(seconds), "x, without visuals": seconds / plain[house].play()})
        rows += [{"": name, "x real time": play(min(seconds, _SUITE_SECONDS))} for name, play in suite.items()]
    title = "Closed loop: supervise, one core, and dm_control's tasks with zero action; median of the repeats"
    yield title, pd.DataFrame(rows).groupby("", sort=False).median()


def parts(seconds: float, _repeats: int) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield where the time of the loop goes in each house."""
    found = {}
    for house in HOUSES:
        (scene := Scene(house, seconds)).record()
        found[house] = dissect(scene)
    yield "Where the time goes: us a control step, of which bare `mj_step` takes the last row", pd.DataFrame(found)


def _suite_task(domain: str, task: str) -> Callable[[float], float]:
    """One of dm_control's tasks with zero action: a function from simulated seconds to the real-time factor."""
    from dm_control import suite  # here, for it loads all of them

    env = suite.load(domain, task, task_kwargs={"random": 0})
    action = np.zeros(env.action_spec().shape)

    def play(seconds: float) -> float:
        steps = round(seconds / env.control_timestep())
        start = time.perf_counter()
        for _ in range(steps):
            env.step(action)  # after an episode's last step it begins another
        return steps * env.control_timestep() / (time.perf_counter() - start)

    return play


def dissect(scene: Scene) -> dict[str, float]:
    """Play the episode with a clock in every part; return how many us each takes of a control step, and bare physics.

    The clocks take time as well, so that small parts look somewhat larger than they are.
    """
    env = scene.env
    parts: dict[str, list[tuple[Any, ...]]] = {  # its methods: their owner, then their names
        "physics": [(env.physics, "step")],
        "contacts of the toddler": [(env.physics.touch_reader, "read")],
        "task": [(env.task, "before_step", "after_step", "get_reward", "get_termination")],
        "observation": [(env.task, "get_observation")],
        "loop": [(HouseRollout, "step")],
        "perception": [(scene.policy, "see")],
        "caregiver: decisions": [(PaperCaregiver, "watch", "assess", "decide")],
        "inverse kinematics": [(kinematics.Arm, "solve")],
        "trajectories: planned": [(BasePath, "__init__"), (ScalarMotion, "move_to", "run_at")],
        "governor, trajectories sampled": [(RobotMotion, "action")],
        "paths over the floor": [(Navigator, "path")],
        "skills and the rest": [(type(scene.policy), "act")],
    }
    reach.reach_path.cache_clear()  # inverse kinematics is solved once for each height
    own = timed(parts, scene.play, time.perf_counter)
    found = own | {"all": sum(own.values()), "bare mj_step": scene.replay()[0]}
    return {part: 1e6 * seconds / scene.steps for part, seconds in found.items()}


def timed(parts: dict[str, list[tuple[Any, ...]]], play: Callable[[], object], timer: Callable[[], float]) -> Row:
    """Play with a clock in every part, given the owners and names of its methods; return the seconds of each."""
    clocks = {part: Clock(timer) for part in parts}
    with contextlib.ExitStack() as stack:
        for part, owners in parts.items():
            for owner, *names in owners:
                stack.enter_context(clocks[part].of(owner, *names))
        play()
    return {part: clock.own for part, clock in clocks.items()}


def films(_seconds: float, repeats: int) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield where the time of a film's frame goes."""
    parts: dict[str, list[tuple[Any, ...]]] = {
        "simulation and caregiver": [(Episode, "run_until")],
        "what has moved, scene": [(StillCamera, "boxes", "set_scene")],
        "rendering": [(mujoco, "mjr_render")],
        "reading pixels": [(mujoco, "mjr_readPixels")],
        "display": [(Episode, "hud_state"), (hud, "draw")],
        "the rest": [(Studio, "frame")],
    }
    figures = pd.DataFrame()
    with tempfile.TemporaryDirectory() as folder:
        for house in HOUSES[:3]:
            spec, picture = EpisodeSpec(FloorPlan.load(house)), Picture(640, 480)
            film = functools.partial(render_episode, f"{folder}/film.mp4", spec, seconds=repeats, picture=picture)
            own = timed(parts, functools.partial(film, quiet=True), time.process_time)
            figures[house] = pd.Series(own) * 1e3 / (repeats * picture.fps)
    figures.loc["all"] = figures.sum()
    yield "Films of 640 x 480: ms of the processor a frame, without its encoder's", figures


def physics(seconds: float, repeats: int) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield what another value of an option costs in the replay of an episode, and how far off its end then is."""
    for house in HOUSES:
        scene, rows = Scene(house, seconds), []
        scene.record()
        option = scene.env.physics.model.ptr.opt
        for name, value in CHOICES * repeats:
            now, before = scene.replay()[0], getattr(option, name)
            setattr(option, name, value)
            other, end = scene.replay()
            setattr(option, name, before)
            rows.append({"": f"{name}={value:g}", "us": 1e6 * other / scene.steps, "over now": other / now, "end": end})
        yield (
            f"Another option in {house}: us a control step, over now, and the end's deviation",
            pd.DataFrame(rows).groupby("", sort=False).median(),
        )


# -- The longest control steps -----------------------------------------------------------------------


def control_steps(seconds: float, repeats: int) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield how long decisions and control steps take at most with each sight, in as many houses as repeats."""
    rows = []
    for house, sight, caregiver in itertools.product(MANY[:repeats], SIGHTS, ("expected-danger", "foresight")):
        scene, policy, step = Scene(house, seconds, caregiver, sight), *(Clock(time.process_time) for _ in range(2))
        gc.freeze()  # else a full pass of the garbage collector goes through all that has been loaded: 80 ms
        with step.of(HouseRollout, "step"):
            scene.play(policy.around(scene.policy))
        decisions, steps = 1e3 * np.array([policy.times[1:], step.times])  # the first one is before the first step
        worst = {"decision": decisions.max(), "of 1,000 the longest": np.percentile(steps, 99.9)}
        rows.append({"sight": sight, "caregiver": caregiver, **worst, "longest": steps.max()})
    episodes, most = f"{len(rows)} episodes of {seconds:g} s", pd.DataFrame(rows).groupby(["sight", "caregiver"])
    yield f"Longest control steps of {episodes}, the most in a house, ms of the processor", most.max()


# -- Cost of foresight as houses grow: processor time of preparation and decisions, memory -----------


def foresight(_seconds: float, repeats: int) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield the cost of `foresight` in the grid, with each house in a separate process to measure its memory."""
    rows = [row for house in PLANS for _, row in run_jobs(cost, [(house, _SECONDS * repeats)], 2)]
    yield "Foresight in the grid, one core", pd.DataFrame(rows).set_index("house")


def cost(job: tuple[str, int]) -> dict[str, Any]:
    """Measure in a house, and run a batch for so many seconds at most, both named by the job; return a row."""
    house, seconds = job
    plan = FloorPlan.load(house)
    start = time.process_time()
    caregiver = ForesightCaregiver(plan)
    preparation = time.process_time() - start
    world, clock = GridWorld(plan, EPSILON, caregiver), Clock(time.process_time)
    with clock.of(caregiver, "decide"):
        world.run(streams(1))
    _speed(world, seconds)  # finds the ways round children, which a house keeps
    return {
        "house": house,
        "cells": len(plan.free_cells),
        "preparation, s": preparation,
        "ms a decision": 1e3 * np.median(clock.times),
        "of 100 the longest": 1e3 * np.percentile(clock.times, 99),
        "timesteps/s": _speed(world, seconds),
        "peak, MB": _peak(),  # after all the rest
    }


def _speed(world: GridWorld, seconds: float) -> float:
    """Novice timesteps a second of a batch of episodes, which runs for so many seconds, or to its end."""
    chance = streams(_BATCH)
    world.reset(chance)
    start = time.process_time()
    while world.timestep < len(chance[0][0].steps) and time.process_time() - start < seconds:
        world.step()
    return _BATCH * world.timestep / (time.process_time() - start)


def _peak() -> float:
    """The most memory that the process has had, in MB. What `resource` says counts the parent's, too."""
    status = pathlib.Path("/proc/self/status").read_text(encoding="ascii")
    return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")) * 1.024e-3


# -- What grows with cells, hazards and children, for the rule ---------------------------------------


def growth(seconds: float, _repeats: int) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield the processor time and its slope in logarithms, each measured in a separate process."""
    for over, points in GROWTH.items():
        rows = [row for point in points for _, row in run_jobs(grown, [(*point, seconds)], 2)]
        figures = pd.DataFrame(rows).set_index(over).drop(columns=[name for name in GROWTH if name != over]).T
        at, found = np.log(figures.columns.to_numpy(float)), np.log(figures.to_numpy(float))
        yield f"What grows with {over}", figures.assign(exponent=np.polyfit(at, found.T, 1)[0])


def grown(job: tuple[int, int, int, float]) -> Row:
    """Measure both worlds of a house: its side, candles and children, and the seconds of an episode."""
    side, candles, children, seconds = job
    Scene("paper", 0.1).play()  # what is needed but once
    made, step, physics, act, grid = (Clock(time.process_time) for _ in range(5))
    house = f"house-0-{side}x{side}-stairwells2-candles{candles}-tables4-bins2"
    with made.of(Scene, "__init__"):
        scene = Scene(house, seconds, children=children)
    with step.of(HouseRollout, "step"), physics.of(scene.env.physics, "step"):
        scene.play(act.around(scene.policy))
    plan = FloorPlan.load(house)
    world = GridWorld(plan, ChildGroup.of([EPSILON] * children), PaperCaregiver(plan))
    world.reset(streams(_GROWN_BATCH, children=children))
    for _ in range(_GROWN_TIMESTEPS):
        grid.around(world.step)()
    return {
        "cells": len(plan.free_cells),
        "hazards": len(plan.hazards),
        "children": children,
        "made, s": made.own,
        "control step, us": 1e6 * np.median(step.times),
        "of which physics": 1e6 * np.median(physics.times),
        "longest decision, ms": 1e3 * max(act.times[1:]),
        f"grid, {_GROWN_BATCH} at once: first timesteps, ms": 1e3 * np.median(grid.times),
        "peak, MB": _peak(),
    }


SECTIONS = {made.__name__: made for made in (closed_loop, parts, control_steps, films, foresight, growth, physics)}

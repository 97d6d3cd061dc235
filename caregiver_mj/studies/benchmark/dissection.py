"""Where the closed loop's time goes."""

from __future__ import annotations

import contextlib
from typing import Any

from rich.console import Console

from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.robot import kinematics, reach
from caregiver_mj.robot.base_path import BasePath
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.scalar_motion import ScalarMotion
from caregiver_mj.studies.benchmark.clock import Clock
from caregiver_mj.studies.benchmark.scene import Scene
from caregiver_mj.studies.display import make_table

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

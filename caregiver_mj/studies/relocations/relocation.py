"""One relocation: how it is run, and what is told of it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from caregiver_mj.house.physics import Physics
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.recording.telemetry import each_physics_step
from caregiver_mj.studies.houses import HOUSES, load_house
from caregiver_mj.studies.relocations.barred import Barred
from caregiver_mj.studies.relocations.conditions import Conditions
from caregiver_mj.studies.relocations.course import LIFTED, Course
from caregiver_mj.studies.relocations.falls import Falls
from caregiver_mj.studies.relocations.knock import Knock
from caregiver_mj.studies.relocations.touches import Touches
from caregiver_mj.studies.trials import Trial, mishaps
from caregiver_mj.tasks import load

_EPSILON = 0.5
_AFTERWARDS = 1.0  # seconds that the candle must go on standing


@dataclasses.dataclass(frozen=True)
class Relocation(Trial):
    """How a relocation went.

    Attributes:
        failure: What went wrong, "" if nothing did.
        tipped: Candles that leaned by more than 30 degrees at some time.
        tilt: Of the candle at the end, degrees.
        error: Its distance from where the robot was to put it, on its map, metres.
        lifting: Seconds from arrived to lifted, NaN if it never was.
        clearing: Seconds from arrived to clear, likewise.
        seconds: How long all of it took.
        barred: For how much of that a child stood in the only way, seconds.
        touches: What the robot touched, save candles and the toddler, and candles, save tables: pairs of names.
    """

    failure: str
    tipped: int
    tilt: float
    error: float
    lifting: float
    clearing: float
    seconds: float
    barred: float
    touches: tuple[tuple[str, str], ...]


def relocate(conditions: Conditions, seed: int, houses: Sequence[str] = HOUSES) -> Relocation:
    """Runs the relocation of a seed; with each seed it is another house's turn."""
    plan = load_house(houses[seed % len(houses)])
    env = load("relocate_candle", plan, _EPSILON, random=seed, task_kwargs=conditions.task_kwargs(), visuals=False)
    task, physics = env.task, env.physics
    conditions.alter(physics)
    policy = CaregiverPolicy(env)
    touches, falls = Touches(physics), Falls(physics)
    timestep = env.reset()
    start = int(task.candles.starting_tables[task.goal_candle])
    table = float(task.table_heights[start])
    barred = Barred(physics, plan, (start, task.goal_table), env.control_timestep())
    course = Course(physics, policy.robot, task.goal_candle, table)
    knock = Knock(physics, task.goal_candle, seed)
    end = math.inf
    with each_physics_step(physics, touches.look):
        while not timestep.last() and physics.time() < end:
            action = policy(timestep)
            course.note(action)
            if conditions.knock:
                knock.apply()
            timestep = env.step(action)
            falls.look()
            barred.look()
            if policy.interventions_done and end == math.inf:
                end = physics.time() + _AFTERWARDS
    lifting, clearing = (math.nan, math.nan) if conditions.knock else course.times()
    position = physics.candle_poses()[task.goal_candle, :3]
    return Relocation(
        house=plan.name,
        seed=seed,
        **mishaps(task.outcome()),
        tipped=falls.tipped,
        failure=_failure(task, physics, policy, position),
        tilt=math.degrees(math.acos(min(1.0, float(physics.candle_upright()[task.goal_candle])))),
        error=math.dist(position[:2], plan.position(plan.tables[task.goal_table])),
        lifting=lifting,
        clearing=clearing,
        seconds=physics.time() - (_AFTERWARDS if policy.interventions_done else 0.0),
        barred=barred.seconds,
        touches=tuple(sorted(touches.pairs)),
    )


def _failure(task: Any, physics: Physics, policy: CaregiverPolicy, position: np.ndarray) -> str:
    """What is wrong at the end, in words."""
    if task.is_placed(physics):
        return "" if policy.interventions_done else "placed, but the robot does not know"
    where = f"candle at ({position[0]:.2f}, {position[1]:.2f}, {position[2]:.2f})"
    if not task.is_standing(physics, task.goal_candle):
        where += ", " + (
            "held" if physics.is_gripping() and position[2] > task.table_heights.min() + LIFTED else "fallen"
        )
    base = ", ".join(f"{value:.2f}" for value in physics.base_position())
    return f"{where}, robot at ({base}): {policy.activity}, {policy.interventions_done} done at {physics.time():.1f} s"

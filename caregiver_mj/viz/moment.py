"""What the display shows of a moment, read from task, policy and observation, or from the grid.

All that a display has to know of those is looked up here and nowhere else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from caregiver_mj.caregivers.percept import Assessment
from caregiver_mj.children.family import Family
from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.interventions.verb import Mark, verb_of
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import KINDS, NOTHING, State
from caregiver_mj.viz.hud.state import ChildState, HudState

if TYPE_CHECKING:
    from caregiver_mj.grid.world import GridWorld
    from caregiver_mj.policy.own import OwnPolicy
    from caregiver_mj.policy.policy import CaregiverPolicy
    from caregiver_mj.tasks.base import CareTask

_ABOVE = 0.5  # cells by which a candle in the caregiver's hand is drawn above it

Observation = Mapping[str, np.ndarray]


def child_positions(observation: Observation) -> np.ndarray:
    """Return where the children are, (children, 2), metres."""
    return np.atleast_2d(observation["toddler_position"])[:, :2].copy()


def candle_positions(observation: Observation) -> np.ndarray:
    """Return where the candles are, (candles, 3), metres."""
    return observation.get("candle_position", np.empty((0, 3)))


def hud_state(
    task: CareTask,
    policy: CaregiverPolicy | OwnPolicy | None,
    observation: Observation,
    family: Family,
    trails: Sequence[np.ndarray],
) -> HudState:
    """Return what the display shows.

    Args:
        task: The task, for what has happened.
        policy: The caregiver's, for what it knows and does; None where there is no robot.
        observation: What is to be seen now.
        family: The children.
        trails: Where they have been, (children, 2) each, oldest first.
    """
    outcome = task.outcome()
    assessment = policy.assessment if policy else None
    unsafe_danger, danger = _danger(assessment)
    return HudState(
        plan=task.plan,
        timestep=min(int(observation["clock"] + 1e-6), EPISODE_TIMESTEPS),
        family=str(family),
        children=_children(observation, assessment, trails, outcome["damage_by_child"]),
        candles=candle_positions(observation),
        damage=outcome["damage"],
        damages={kind.at.split()[-1]: outcome[f"damage_{kind.name}"] for kind in KINDS},
        robot=observation.get("base_position"),
        gates=observation.get("gate_position", np.zeros(0)).tolist(),
        danger=danger,
        unsafe_danger=unsafe_danger,
        target=policy.target if policy else NOTHING,
        mark=_mark(task.plan, policy) if policy else None,
        intervention=policy.activity if policy else "",
    )


def grid_state(world: GridWorld, family: Family, number: int = 0) -> HudState:
    """Return what the display shows of the grid.

    Args:
        world: The grid.
        family: The children.
        number: Which of its episodes.
    """
    plan, intervention = world.plan, world.orders[number]
    caregiver = plan.position(plan.caregiver_cells[world.caregiver_cell[number]]) if world.caregiver else None
    moves = zip(world.previous_cell[number], world.child_cell[number], strict=True)
    from_to = [[plan.position(plan.free_cells[cell]) for cell in move] for move in moves]
    hand = np.zeros(2) if caregiver is None else caregiver + np.array([0.0, _ABOVE * plan.cell_size])
    candles = [hand if table == NOTHING else plan.position(plan.tables[table]) for table in world.candle_table[number]]
    return HudState(
        plan=plan,
        timestep=world.timestep,
        family=str(family),
        children=tuple(ChildState(to, np.array([start])) for start, to in from_to),
        candles=np.array(candles).reshape(-1, 2),
        damage=float(world.ledger.damage[number]),
        robot=caregiver,
        gates=np.where(world.state[number] == State.SHUT, 0.0, layout.GATE_OPEN)[
            len(plan.landings) : len(plan.stairwells)
        ].tolist(),
        target=intervention.hazard,
        mark=verb_of(intervention.verb).mark(plan, intervention),
    )


def _children(
    observation: Observation,
    assessment: Assessment | None,
    trails: Sequence[np.ndarray],
    damage: Sequence[float],
) -> tuple[ChildState, ...]:
    positions = child_positions(observation)
    trail = np.array(trails).reshape(len(trails), len(positions), 2)
    safe = [None] * len(positions) if assessment is None else assessment.safe[0].tolist()
    return tuple(
        ChildState(position, trail[:, child], safe[child], damage[child]) for child, position in enumerate(positions)
    )


def _danger(assessment: Assessment | None) -> tuple[np.ndarray | None, np.ndarray | None]:
    """What decides between the hazards, (hazards,): as it would be with a child that is surely unsafe, and as it is."""
    if assessment is None:
        return None, None
    unsafe = assessment.urgency[0]
    return unsafe, unsafe * (1.0 - assessment.safe[0]).max()


def _mark(plan: FloorPlan, policy: CaregiverPolicy | OwnPolicy) -> Mark | None:
    """What the display points at."""
    intervention = policy.intervention
    return verb_of(intervention.verb).mark(plan, intervention) if intervention else None

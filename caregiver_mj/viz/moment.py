"""What the display shows of a moment, read from task, policy and observation, or from the grid.

All that a display has to know of those is looked up here and nowhere else.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from caregiver_mj.caregivers.percept import Assessment
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.interventions.verb import Mark, verb_of
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import KINDS, NOTHING, TABLE, State, Where
from caregiver_mj.viz import colours

if TYPE_CHECKING:
    from caregiver_mj.grid.world import GridWorld
    from caregiver_mj.house.physics import Physics
    from caregiver_mj.policy.own import OwnPolicy
    from caregiver_mj.policy.policy import CaregiverPolicy
    from caregiver_mj.tasks.base import CareTask

_ABOVE = 0.5  # cells by which a candle in the caregiver's hand is drawn above it

Observation = Mapping[str, np.ndarray]
SOON = 5  # timesteps in which a child may be somewhere; what may hurt it is told for `percept.HORIZON`
LEAST = 0.02  # probability that is drawn
_THICKNESS = 0.012  # metres, of a tile: above rugs and thresholds
_SIDE = 0.92  # of a tile, of a cell
_PILLAR = 0.75  # metres: the height of what stands on hazards, above the tables
_DENSEST = 0.75  # opacity of what is sure


@dataclasses.dataclass(frozen=True)
class ChildState:
    """A child. Positions are in metres, in the floor plan's frame."""

    position: np.ndarray  # where it is, (2,)
    # where it has been, (k, 2), newest last
    trail: np.ndarray = dataclasses.field(default_factory=lambda: np.empty((0, 2)))
    safe: float | None = None  # P(safe|tau), or None if nobody estimates it
    damage: float = 0.0  # damage that it has taken so far
    seen: bool = True  # whether the caregiver sees it


@dataclasses.dataclass(frozen=True)
class HudState:
    """A moment. Positions are in metres, in the floor plan's frame."""

    plan: FloorPlan  # the house
    timestep: int  # novice timesteps elapsed
    family: str  # who the children are, such as "0.5" or "1,0.25"
    children: tuple[ChildState, ...]  # the children, at least one
    candles: np.ndarray  # where the candles are, (candles, 2) or (candles, 3)
    damage: float = 0.0  # damage so far, of all children
    damages: dict[str, float] | None = None  # the same by kind, name to damage, shown if given
    robot: np.ndarray | None = None  # the caregiver's x, y and, of a robot, yaw in rad; None if there is none
    danger: np.ndarray | None = None  # expected danger of every hazard, over all children, (hazards,), or None
    # what that would be at P(safe|tau) = 0 of the least safe child, shown as outlines, or None
    unsafe_danger: np.ndarray | None = None
    target: int = NOTHING  # number of the hazard that is being dealt with, or NOTHING
    # what is pointed at on the plan: a cell is outlined, a candle gets a halo; None for nothing
    mark: Mark | None = None
    intervention: str = ""  # what the caregiver is doing, in words
    forecast: Forecast | None = None  # what may be coming, if that is to be shown
    gates: Sequence[float] = ()  # how far each gate stands open, radians, (gates,)
    gone: Sequence[int] = ()  # numbers of the hazards that are gone
    # which free cells the caregiver sees, bool (cells,); None for one that sees everything
    in_view: np.ndarray | None = None


def child_positions(observation: Observation, physics: Physics) -> np.ndarray:
    """Return where the children are, also those that are not seen, (children, 2), metres."""
    shown = physics.toddler_positions() if "toddler_seen" in observation else observation["toddler_position"]
    return np.atleast_2d(shown)[:, :2].copy()


def candle_positions(observation: Observation) -> np.ndarray:
    """Return where the candles are, (candles, 3), metres."""
    return observation.get("candle_position", np.empty((0, 3)))


def hud_state(
    task: CareTask,
    policy: CaregiverPolicy | OwnPolicy | None,
    observation: Observation,
    family: ChildGroup,
    trails: Sequence[np.ndarray],
    physics: Physics,
) -> HudState:
    """Return what the display shows of a task; without a robot the policy is None.

    The trails are where the children have been, (children, 2) each, oldest first.
    """
    outcome, assessment = task.outcome(), policy.assessment if policy else None
    positions = child_positions(observation, physics)
    seen = observation.get("toddler_seen", np.ones(len(positions)))
    trail = np.array(trails).reshape(len(trails), len(positions), 2)
    safe, danger, unsafe_danger = [None] * len(positions), None, None
    if assessment is not None:
        safe, unsafe_danger = assessment.safe[0].tolist(), assessment.urgency[0]
        danger = unsafe_danger * (1.0 - assessment.safe[0]).max()
    intervention = policy.intervention if policy else None
    return HudState(
        plan=task.plan,
        timestep=min(int(observation["clock"] + 1e-6), EPISODE_TIMESTEPS),
        family=str(family),
        children=tuple(
            ChildState(position, trail[:, child], safe[child], outcome["damage_by_child"][child], bool(seen[child]))
            for child, position in enumerate(positions)
        ),
        candles=candle_positions(observation),
        damage=outcome["damage"],
        damages={
            kind.at.split()[-1]: outcome[f"damage_{kind.name}"]
            for kind in KINDS
            if kind is TABLE or kind in task.plan.hazards.kinds  # there is little room
        },
        robot=observation.get("base_position"),
        gates=observation.get("gate_position", np.zeros(0)).tolist(),
        gone=np.flatnonzero(task.children.state == State.GONE).tolist(),
        danger=danger,
        unsafe_danger=unsafe_danger,
        target=policy.target if policy else NOTHING,
        mark=verb_of(intervention.verb).mark(task.plan, intervention) if intervention else None,
        intervention=policy.activity if policy else "",
        in_view=getattr(policy, "in_view", None),
    )


def grid_state(world: GridWorld, family: ChildGroup, number: int = 0) -> HudState:
    """Return what the display shows of one of the grid's episodes, by its number."""
    plan, intervention = world.plan, world.orders[number]
    caregiver = plan.position(plan.caregiver_cells[world.caregiver_cell[number]]) if world.caregiver else None
    moves = zip(world.previous_cell[number], world.child_cell[number], strict=True)
    from_to = [[plan.position(plan.free_cells[cell]) for cell in move] for move in moves]
    hand = np.zeros(2) if caregiver is None else caregiver + np.array([0.0, _ABOVE * plan.cell_size])
    candles = [hand if table == NOTHING else plan.position(plan.tables[table]) for table in world.candle_table[number]]
    eyes, every = world.eyes, [True] * len(from_to)
    return HudState(
        plan=plan,
        timestep=world.timestep,
        family=str(family),
        children=tuple(
            ChildState(to, np.array([start]), seen=bool(seen))
            for (start, to), seen in zip(from_to, eyes.tracker.seen[number] if eyes else every, strict=True)
        ),
        candles=np.array(candles).reshape(-1, 2),
        damage=float(world.ledger.damage[number]),
        robot=caregiver,
        gates=np.where(world.state[number] == State.SHUT, 0.0, layout.GATE_OPEN)[
            len(plan.landings) : len(plan.stairwells)
        ].tolist(),
        gone=np.flatnonzero(world.state[number] == State.GONE).tolist(),
        target=intervention.hazard,
        mark=verb_of(intervention.verb).mark(plan, intervention),
        in_view=eyes.in_view()[number] if eyes else None,
    )


@dataclasses.dataclass(frozen=True)
class Tile:
    """A translucent block on the floor."""

    centre: tuple[float, float]  # x and y of its middle, metres
    half: float  # half of its side, metres
    height: float  # metres
    colour: tuple[int, int, int]  # red, green, blue, of 255
    opacity: float  # share of 1


@dataclasses.dataclass(frozen=True, eq=False)
class Forecast:
    """What a caregiver expects of K children."""

    presence: np.ndarray  # probability that each comes to be in each free cell within `SOON` timesteps, (K, free cells)
    # probability that any of them runs into each hazard within `percept.HORIZON` timesteps, (hazards,)
    harm: np.ndarray
    # probability that each is on its way to each toy bin, (K, bins): what is left wants something else
    goal: np.ndarray
    epsilon: np.ndarray  # share of random moves that is to be expected of each, (K,)

    @classmethod
    def of(cls, assessment: Assessment | None) -> Forecast | None:
        """Return what follows from a caregiver's beliefs, None if it has none, for a batch of one."""
        if assessment is None or (prediction := assessment.prediction) is None:
            return None
        harm = 1.0 - np.prod(1.0 - assessment.reach[0], axis=0)
        epsilon = prediction.epsilon[0] @ prediction.chain.epsilons
        return cls(prediction.presence(SOON)[0], harm, prediction.toy_bin[0], epsilon)

    def tiles(self, plan: FloorPlan, candles: np.ndarray) -> list[Tile]:
        """Return tiles where children may be, and pillars where hazards may hurt them, the denser the more probable.

        The candles are at `candles`, (candles, 2) or more, metres.
        """
        half = _SIDE * plan.cell_size / 2
        found = []
        for cell in np.flatnonzero(self.presence.max(axis=0) >= LEAST).tolist():
            child = int(self.presence[:, cell].argmax())
            opacity = strength(self.presence[child, cell])
            place = tuple(plan.position(plan.free_cells[cell]))
            found.append(Tile(place, half, _THICKNESS, colours.of_child(child), _DENSEST * opacity))
        for number in np.flatnonzero(self.harm >= LEAST).tolist():
            x, y = place_of(plan, number, candles)[:2].tolist()
            found.append(Tile((x, y), half, _PILLAR, colours.HARM, _DENSEST * strength(self.harm[number])))
        return found


def place_of(plan: FloorPlan, hazard: int, candles: np.ndarray) -> np.ndarray:
    """Where a hazard is, by its number and where the candles are, metres."""
    stairwell = plan.hazards.among(Where.OPENING, hazard)
    if stairwell != NOTHING:
        return plan.position(plan.stairwells[stairwell])
    lying = plan.hazards.among(Where.FLOOR, hazard)
    if lying != NOTHING:
        return plan.position(plan.free_cells[plan.floor_cells[lying]])
    return candles[plan.hazards.among(Where.ON_TABLE, hazard)]


def strength(probability: float) -> float:
    """Return a probability's strength of colour: its root, so that small ones can be told from none."""
    return float(np.sqrt(probability))

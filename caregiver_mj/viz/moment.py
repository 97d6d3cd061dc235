"""The state shown in displays, with predictions. `Episode.hud_state` reads it from the house, `grid_state` here."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from caregiver_mj.caregivers.percept import Assessment
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.interventions.verb import Mark, verb_of
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, State, Where
from caregiver_mj.viz import colours

if TYPE_CHECKING:
    from caregiver_mj.grid.world import GridWorld

_ABOVE = 0.5  # cells; height of a candle in the caregiver's hand above it, in the grid's drawing
SOON = 5  # timesteps; horizon of predicted places; that of hazards is `percept.HORIZON`
LEAST = 0.02  # least probability to draw
_THICKNESS = 0.012  # m; thickness of a tile, above rugs and thresholds
_SIDE = 0.92  # cells; side of a tile
_PILLAR = 0.75  # m; height of the pillars on hazards, above the tables
_DENSEST = 0.75  # opacity of a certain event


@dataclasses.dataclass(frozen=True)
class ChildState:
    """A child. Positions are in metres, in the floor plan's frame."""

    position: np.ndarray  # (2,)
    # earlier positions, (k, 2), newest last
    trail: np.ndarray = dataclasses.field(default_factory=lambda: np.empty((0, 2)))
    safe: float | None = None  # P(safe|tau), or None without an estimate
    damage: float = 0.0  # damage so far
    seen: bool = True  # whether the caregiver sees it


@dataclasses.dataclass(frozen=True)
class HudState:
    """The state of a moment. Positions are in metres, in the floor plan's frame."""

    plan: FloorPlan  # the house
    timestep: int  # novice timesteps elapsed
    family: str  # the children, such as "0.5" or "1,0.25"
    children: tuple[ChildState, ...]  # the children, at least one
    candles: np.ndarray  # (candles, 2) or (candles, 3)
    damage: float = 0.0  # damage so far, of all children
    damages: dict[str, float] | None = None  # damage by kind; None to hide it
    robot: np.ndarray | None = None  # the caregiver's x, y and, of a robot, yaw, rad; None without one
    danger: np.ndarray | None = None  # expected danger of each hazard, over all children, (hazards,), or None
    # the same at P(safe|tau) = 0 of the least safe child, shown as outlines, or None
    unsafe_danger: np.ndarray | None = None
    target: int = NOTHING  # number of the hazard under intervention, or NOTHING
    # mark on the plan: a cell is outlined, a candle gets a halo
    mark: Mark | None = None
    intervention: str = ""  # the caregiver's activity in words
    forecast: Forecast | None = None  # the caregiver's predictions, if they are shown
    gates: Sequence[float] = ()  # opening angle of each gate, rad, (gates,)
    gone: Sequence[int] = ()  # numbers of the hazards that are gone
    # whether each free cell is in the caregiver's view, bool (cells,); None with full sight
    in_view: np.ndarray | None = None


def grid_state(world: GridWorld, family: ChildGroup, number: int = 0) -> HudState:
    """Return the display state of the grid's episode with a number."""
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


# -- Predictions -------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Tile:
    """A translucent block on the floor."""

    centre: tuple[float, float]  # x and y, m
    half: float  # half of its side, m
    height: float  # m
    colour: tuple[int, int, int]  # red, green, blue, 0 to 255
    opacity: float  # 0 to 1


@dataclasses.dataclass(frozen=True, eq=False)
class Forecast:
    """A caregiver's predictions for K children."""

    presence: np.ndarray  # probability of each child in each free cell within `SOON` timesteps, (K, free cells)
    # probability that any child runs into each hazard within `percept.HORIZON` timesteps, (hazards,)
    harm: np.ndarray
    # probability that each child is on its way to each toy bin, (K, bins); the rest is for other goals
    goal: np.ndarray
    epsilon: np.ndarray  # expected share of random moves of each, (K,)

    @classmethod
    def of(cls, assessment: Assessment | None) -> Forecast | None:
        """Return the predictions of an assessment, a batch of one; None without a belief."""
        if assessment is None or (prediction := assessment.prediction) is None:
            return None
        harm = 1.0 - np.prod(1.0 - assessment.reach[0], axis=0)
        epsilon = prediction.epsilon[0] @ prediction.chain.epsilons
        return cls(prediction.presence(SOON)[0], harm, prediction.toy_bin[0], epsilon)

    def places(self) -> Iterator[tuple[int, int, float]]:
        """Yield each free cell where a child may be, the likeliest child there, and the strength of its colour."""
        for cell in np.flatnonzero(self.presence.max(axis=0) >= LEAST).tolist():
            child = int(self.presence[:, cell].argmax())
            yield cell, child, _strength(self.presence[child, cell])

    def threats(self) -> Iterator[tuple[int, float]]:
        """Yield the number of each hazard that may hurt a child, and the strength of its colour."""
        for number in np.flatnonzero(self.harm >= LEAST).tolist():
            yield number, _strength(self.harm[number])

    def tiles(self, plan: FloorPlan, candles: np.ndarray) -> list[Tile]:
        """Return tiles for the children's predicted places, and pillars for hazards; opacity shows probability.

        `candles` are the places of the candles, (candles, 2) or more, m.
        """
        half, found = _SIDE * plan.cell_size / 2, []
        for cell, child, strength in self.places():
            place = tuple(plan.position(plan.free_cells[cell]))
            found.append(Tile(place, half, _THICKNESS, colours.of_child(child), _DENSEST * strength))
        for number, strength in self.threats():
            x, y = place_of(plan, number, candles)[:2].tolist()
            found.append(Tile((x, y), half, _PILLAR, colours.HARM, _DENSEST * strength))
        return found


def place_of(plan: FloorPlan, hazard: int, candles: np.ndarray) -> np.ndarray:
    """Return the place of the hazard with a number, given the candles' places, m."""
    stairwell = plan.hazards.among(Where.OPENING, hazard)
    if stairwell != NOTHING:
        return plan.position(plan.stairwells[stairwell])
    lying = plan.hazards.among(Where.FLOOR, hazard)
    if lying != NOTHING:
        return plan.position(plan.free_cells[plan.floor_cells[lying]])
    return candles[plan.hazards.among(Where.ON_TABLE, hazard)]


def _strength(probability: float) -> float:
    """Return the strength of colour for a probability: its square root, so that small ones are visible."""
    return float(np.sqrt(probability))

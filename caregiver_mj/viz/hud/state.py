"""What the display shows of a moment."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from caregiver_mj.interventions.verb import Mark
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.viz.forecast import Forecast


@dataclasses.dataclass(frozen=True)
class ChildState:
    """A child. Positions are in metres, in the floor plan's frame.

    Attributes:
        position: Where it is, (2,).
        trail: Where it has been, (k, 2), newest last.
        safe: P(safe|tau), or None if nobody estimates it.
        damage: Damage that it has taken so far.
    """

    position: np.ndarray
    trail: np.ndarray = dataclasses.field(default_factory=lambda: np.empty((0, 2)))
    safe: float | None = None
    damage: float = 0.0


@dataclasses.dataclass(frozen=True)
class HudState:
    """A moment. Positions are in metres, in the floor plan's frame.

    Attributes:
        plan: The house.
        timestep: Novice timesteps elapsed.
        family: Who the children are, such as "0.5" or "1,0.25".
        children: The children, at least one.
        candles: Where the candles are, (candles, 2) or (candles, 3).
        damage: Damage so far, of all children.
        damages: The same by kind, name to damage, shown if given.
        robot: The caregiver's x, y and, of a robot, yaw in rad; None if there is none.
        danger: Expected danger of every hazard, over all children, (hazards,), or None.
        unsafe_danger: What that would be at P(safe|tau) = 0 of the least safe child, shown as outlines, or None.
        target: Number of the hazard that is being dealt with, or NOTHING.
        mark: What is pointed at on the plan: a cell is outlined, a candle gets a halo; None for nothing.
        intervention: What the caregiver is doing, in words.
        forecast: What may be coming, if that is to be shown.
        gates: How far each gate stands open, radians, (gates,).
    """

    plan: FloorPlan
    timestep: int
    family: str
    children: tuple[ChildState, ...]
    candles: np.ndarray
    damage: float = 0.0
    damages: dict[str, float] | None = None
    robot: np.ndarray | None = None
    danger: np.ndarray | None = None
    unsafe_danger: np.ndarray | None = None
    target: int = NOTHING
    mark: Mark | None = None
    intervention: str = ""
    forecast: Forecast | None = None
    gates: Sequence[float] = ()

"""What may be coming, to be laid over the floor: where the children may be soon, and what may hurt them."""

from __future__ import annotations

import dataclasses

import numpy as np

from caregiver_mj.caregivers.percept import Assessment
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Where
from caregiver_mj.viz import colours

SOON = 5  # timesteps in which a child may be somewhere; what may hurt it is told for `percept.HORIZON`
LEAST = 0.02  # probability that is drawn
_THICKNESS = 0.012  # metres, of a tile: above rugs and thresholds
_SIDE = 0.92  # of a tile, of a cell
_PILLAR = 0.75  # metres: the height of what stands on hazards, above the tables
_DENSEST = 0.75  # opacity of what is sure


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

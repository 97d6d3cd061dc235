"""Where `paper` and `nearest` protect from different hazards, plan by plan."""

from __future__ import annotations

import dataclasses

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.studies.documents import table
from caregiver_mj.studies.sensitivity.conditions import NEAREST, OWN_WEIGHTS, PAPER, WEIGHTS
from caregiver_mj.studies.sensitivity.places import Place
from caregiver_mj.studies.sensitivity.results import Results
from caregiver_mj.studies.sensitivity.same_rule import cells_apart
from caregiver_mj.studies.sensitivity.tables import interval


def share_apart(house: str, weights: str) -> float:
    """Share of a child's cells in which the two protect from different hazards, with the candles where they begin."""
    plan = dataclasses.replace(FloorPlan.load(house), damage=DamageWeights.parse(weights))
    return float(cells_apart(plan).mean())


def plans_apart(results: Results) -> list[Place]:
    """The houses, each as a place, in which the two ever differ: at the start, or in an episode."""
    houses = [Place(house, (house,), place.episodes) for place in results.places for house in place.houses]
    return [one for one in houses if share_apart(one.name, OWN_WEIGHTS) or results.differs(one, PAPER)]


def same_rule_table(results: Results) -> str:
    """For each such house the share of cells, the share of timesteps, and how much damage that makes."""
    rows = []
    for one in plans_apart(results):
        shares = (f"{share_apart(one.name, weights):.0%}" for weights in WEIGHTS[1:])
        difference = results.mean_difference(one.name, PAPER, NEAREST)
        rows.append((str(one), *shares, f"{results.differs(one, PAPER):.1%}", interval(difference, "+")))
    titles = (*(f"cells, {weights}" for weights in WEIGHTS[1:]), "timesteps", "damage, `paper` less `nearest`")
    return table(("plan", *titles), rows)

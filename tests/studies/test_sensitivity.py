"""The study of sensitivity: where two rules differ, by hand and in any house."""

import dataclasses

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from random_plans import plan_texts

from caregiver_mj.caregivers.baselines import NearestCaregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, DamageWeights
from studies.sensitivity import cells_apart

# A corridor: wherever the child is, stairwell and candle are 11 moves away together. The bare table is by the stairs.
CORRIDOR = FloorPlan.parse("##############\n#S..........C#\n##T######B####\n##############")


def choices(plan, candle_table):
    """What the rule and `nearest` choose with a child in each cell."""
    cells = len(plan.free_cells)
    child = np.arange(cells)[:, None]
    percept = Percept(
        child, child, np.full_like(child, NOTHING), np.zeros(cells, int), np.tile(candle_table, (cells, 1)),
        np.full(cells, NOTHING),
    )  # fmt: skip
    return PaperCaregiver(plan).choose(percept), NearestCaregiver(plan).choose(percept)


@settings(max_examples=25, deadline=None)
@given(plan_texts(), st.sampled_from(["5:4:1", "20:4:1", "1:1:1", "4:5:1"]), st.randoms(use_true_random=False))
def test_the_rules_differ_just_where_the_derivation_says(text, weights, random):
    plan = FloorPlan.parse(text, damage=weights)
    tables = np.array(random.sample(range(len(plan.tables)), len(plan.candle_tables)), int)
    ours, theirs = choices(plan, tables)
    assert (ours != theirs).tolist() == cells_apart(plan, tables).tolist()
    if weights == "1:1:1":
        assert not cells_apart(plan).any()


def test_the_rules_differ_in_a_corridor_by_hand():
    east, west = (CORRIDOR.graph.table_distances[:, 0], CORRIDOR.graph.stairwell_distances[:, 0])
    assert (east + west == 11).all()
    apart = {(int(c), int(s)) for c, s, so in zip(east, west, cells_apart(CORRIDOR), strict=True) if so}
    assert apart == {(5, 6)}
    dear = dataclasses.replace(CORRIDOR, damage=DamageWeights(20.0, 4.0, 1.0))
    apart = {(int(c), int(s)) for c, s, so in zip(east, west, cells_apart(dear), strict=True) if so}
    assert apart == {(2, 9), (3, 8), (4, 7), (5, 6)}

"""Children that come after the caregiver, and what caregivers without foresight do about them."""

import pytest
from worlds import streams

from caregiver_mj.caregivers.baselines import NearestCaregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.grid.world import GridWorld, run_episodes
from caregiver_mj.interventions.verb import BLOCK, RELOCATE, STAND_ASIDE
from caregiver_mj.plans.floor_plan import FloorPlan

ROOM = FloorPlan.parse("##########\n#B......T#\n#........#\n#........#\n#.C.....S#\n##########", "room")


@pytest.mark.parametrize("maker", [PaperCaregiver, NearestCaregiver])
@pytest.mark.parametrize("child", ["seeker:0", "0", "1"])
def test_who_follows_is_found_out_and_led_away(maker, child):
    caregiver = maker(ROOM)
    world = GridWorld(ROOM, child, caregiver)
    world.reset(streams(10))
    for _ in range(60):
        world.step()
    follows = child == "seeker:0"
    assert (caregiver.followers.there == follows).all()
    verbs = set(caregiver.decide(world.percept()).verb)
    assert verbs == {STAND_ASIDE} if follows else verbs <= {BLOCK, RELOCATE}


def test_who_follows_is_not_drawn_to_where_it_is_hurt():
    """In this house a child that follows was hurt ten times as much beside the stairs that the caregiver stood in."""
    plan, child, seeds = FloorPlan.load("far-bins-300009"), "seeker:0.05", range(40)
    alone, rule = (run_episodes(plan, child, c, seeds).totals()["damage"] for c in (None, PaperCaregiver(plan)))
    assert rule.mean() < 3 * alone.mean()

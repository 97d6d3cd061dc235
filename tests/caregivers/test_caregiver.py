"""Caregivers: decisions worked by hand in small houses, and the registry."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_plans import plan_texts
from worlds import begun, percept

from caregiver_mj import FloorPlan
from caregiver_mj.caregivers import CAREGIVERS, Caregiver, Percept, make_caregiver
from caregiver_mj.caregivers.baselines import GuardCaregiver, NearestCaregiver, RandomCaregiver
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.caregivers.learned import LearnedCaregiver
from caregiver_mj.caregivers.paper import CandlesCaregiver, PaperCaregiver, StairsCaregiver
from caregiver_mj.children.novice import expert_trajectories
from caregiver_mj.children.random_stream import pick
from caregiver_mj.danger import safety
from caregiver_mj.grid.world import GridWorld, run_episodes
from caregiver_mj.interventions.verb import BLOCK, RELOCATE, STAND_ASIDE
from caregiver_mj.plans.hazards import NOTHING
from studies.ablations import Alike, Max

NORTH, EAST, SOUTH, WEST = range(4)
BY_NAME = tuple(name for name in CAREGIVERS if name != "none")

# A corridor of cells 0 to 4, the landing is cell 5. Tables: 0 bare, 1 with the candle, 2 bare. From cell i
# the novice is i + 1 moves from the stairwell and from table 0, |i - 2| + 1 from table 1 and 5 - i from table 2.
CORRIDOR = FloorPlan.parse("#########\n#S.....B#\n##T#C#T##\n#########")
STAIRWELL, CANDLE = 0, 1
PATIENT = ForesightCaregiver, LearnedCaregiver


def see(child_cell, candle_table=None, caregiver_cell=4, **more):
    return percept(CORRIDOR, child_cell, caregiver_cell, candle_table, **more)


def all_caregivers(plan, seed=0):
    return [make_caregiver(name, plan, seed) for name in BY_NAME]


def test_the_greatest_expected_danger_wins_by_hand_in_either_reading():
    # Stairwell 5/d, candle 4/d; the stairwell's table twin 0 has no candle and is no candidate.
    #   cell 0: 5/1 > 4/3   cell 1: 5/2 > 4/2   cell 2: 5/3 < 4/1   cell 3: 5/4 < 4/2   cell 4: 5/5 < 4/3
    caregiver = PaperCaregiver(CORRIDOR)
    caregiver.reset(5)
    assert caregiver.choose(see(range(5))).tolist() == [STAIRWELL, STAIRWELL, CANDLE, CANDLE, CANDLE]
    # The largest distance is 5: reach 1 - d/5.
    #   cell 0: 5 * 4/5 > 4 * 2/5   cell 1: 5 * 3/5 > 4 * 3/5   cell 2: 5 * 2/5 < 4 * 4/5   cell 3: 5 * 1/5 < 4 * 3/5
    caregiver = PaperCaregiver(CORRIDOR, reach="linear")
    caregiver.reset(4)
    assert caregiver.choose(see(range(4))).tolist() == [STAIRWELL, STAIRWELL, CANDLE, CANDLE]
    np.testing.assert_allclose(caregiver.assess(see(range(4))).reach[0, 0], [4 / 5, 2 / 5])


def test_the_numbers_behind_a_decision_by_hand():
    caregiver = PaperCaregiver(CORRIDOR)
    caregiver.action_prior = np.array([[0.1, 0.6, 0.1, 0.2]] * 5)
    caregiver.reset(1)
    seen = see(0, previous_cell=[[1]], previous_action=[[WEST]])
    caregiver.watch(seen)
    assessment = caregiver.assess(seen)
    # One move west: theta 1/5 against rho 1/4: P(safe) = (1/5) / (1/5 + 1/4) = 4/9.
    # Reach: 1/1 and 1/3 of 4/3. Danger: 5/9 * 3/4 * 5 = 25/12 and 5/9 * 1/4 * 4 = 5/9.
    np.testing.assert_allclose(assessment.safe, [[4 / 9]])
    np.testing.assert_allclose(assessment.reach, [[[3 / 4, 1 / 4]]])
    np.testing.assert_allclose(assessment.danger, [[[25 / 12, 5 / 9]]])


def test_moves_add_up_over_an_episode_and_reset_forgets_them():
    caregiver = PaperCaregiver(CORRIDOR)
    caregiver.action_prior = np.array([[0.125, 0.5, 0.125, 0.25]] * 5)
    caregiver.reset(1)
    caregiver.watch(see(1))  # before the first move: nothing
    assert caregiver.assess(see(1)).safe[0, 0] == pytest.approx(1 / 2)
    for action, safe in ((EAST, 2 / 3), (EAST, 4 / 5), (NORTH, 2 / 3), (WEST, 2 / 3)):
        caregiver.watch(see(1, previous_action=[[action]]))
        assert caregiver.assess(see(1)).safe[0, 0] == pytest.approx(safe)
    caregiver.reset(1)
    assert caregiver.assess(see(1)).safe[0, 0] == pytest.approx(1 / 2)


def test_equal_dangers_go_to_the_stairwell_whatever_the_rounding():
    # From column 11 the stairwell is 10 moves away, the candle south of column 18 is 8 and those beside column 23
    # are 13: 5/10 = 4/8 > 4/13. Divided by the sum of 1/10, 1/8, 1/13 and 1/13, the second comes out 1e-16 greater.
    north, south = ["#"] * 27, ["#"] * 27
    north[23] = south[18] = south[23] = "C"
    south[24] = "T"
    plan = FloorPlan.parse("\n".join(["#" * 27, "".join(north), "#S" + 23 * "." + "B#", "".join(south), "#" * 27]))
    seen = percept(plan, plan.cell_index[(2, 11)])
    caregiver = PaperCaregiver(plan)
    caregiver.reset(1)
    assert sorted(caregiver.hazard_distances(seen)[0, 0]) == [8, 10, 13, 13]
    assert caregiver.choose(seen).tolist() == [STAIRWELL]


def test_below_the_threshold_nothing_is_done():
    # At cell 2 the candle's danger is 1/2 * (1 / (1 + 1/3)) * 4 = 3/2.
    for threshold, decision in ((1.49, CANDLE), (1.51, NOTHING)):
        caregiver = PaperCaregiver(CORRIDOR, threshold=threshold)
        caregiver.reset(1)
        assert caregiver.choose(see(2)).tolist() == [decision]


def test_a_candle_that_is_safest_where_it_stands_is_left_there():
    # On table 2 (4 moves from cell 1) it is farther from the novice than on the bare tables 0 (2) and 1 (2).
    for caregiver in (PaperCaregiver(CORRIDOR), NearestCaregiver(CORRIDOR)):
        assert caregiver.worth_protecting(see([1, 4], 2)).tolist() == [[True, False], [True, True]]
    carried = see(2, NOTHING, holding=[0])  # nor is one in the hand a candidate
    assert PaperCaregiver(CORRIDOR).choose(carried).tolist() == [STAIRWELL]
    without_stairs = FloorPlan.parse("#########\n#......B#\n##T#C#T##\n#########")
    for caregiver in all_caregivers(without_stairs):
        caregiver.reset(1)
        if not isinstance(caregiver, LearnedCaregiver):  # which nothing holds to that
            assert caregiver.choose(see(1, 2)).tolist() == [NOTHING]


@pytest.mark.parametrize(
    ("rows", "hazards", "cannot", "rests"),
    [
        ("######\n#S..B#\n#T..S#\n######", {0, 1}, CandlesCaregiver, LearnedCaregiver),
        ("#########\n#......B#\n##T#C#T##\n#########", {0}, (GuardCaregiver, StairsCaregiver), PATIENT),
        ("####\n#..#\n#.B#\n####", set(), Caregiver, ()),
    ],
)
def test_houses_without_candles_without_stairwells_and_without_either(rows, hazards, cannot, rests):
    plan = FloorPlan.parse(rows)
    seen = percept(plan, [0, 1], 2)
    for caregiver in all_caregivers(plan):
        caregiver.reset(2)
        caregiver.watch(seen)
        decision = set(caregiver.choose(seen).tolist())
        if isinstance(caregiver, cannot):
            assert decision == {NOTHING}
        else:
            assert decision <= hazards | ({NOTHING} if isinstance(caregiver, rests) else set())


def test_nearest_ignores_the_damage():
    # From cell 1 stairwell and candle are both 2 moves away, from cell 2 the candle is nearer.
    caregiver = NearestCaregiver(CORRIDOR)
    caregiver.reset(3)
    assert caregiver.choose(see([0, 1, 2])).tolist() == [STAIRWELL, STAIRWELL, CANDLE]


def test_guard_keeps_to_the_stairwell_nearest_to_its_start():
    plan = FloorPlan.parse("#########\n#S.....S#\n##.###B##\n#########")
    caregiver = GuardCaregiver(plan)
    caregiver.reset(2)
    assert caregiver.choose(percept(plan, [2, 2], [1, 4])).tolist() == [0, 1]
    assert caregiver.choose(percept(plan, [2, 2], [4, 1])).tolist() == [0, 1]
    caregiver.reset(1)
    assert caregiver.choose(percept(plan, 2, 4)).tolist() == [1]


def test_random_draws_once_a_timestep_and_evenly_among_what_is_worth_protecting():
    caregiver = RandomCaregiver(CORRIDOR)
    batch = 4000
    caregiver.reset(batch, range(batch))
    seen = see(np.full(batch, 2))
    first = caregiver.choose(seen)
    assert (caregiver.choose(seen) == first).all()
    caregiver.watch(seen)
    second = caregiver.choose(seen)
    for decision in (first, second):
        assert np.mean(decision == CANDLE) == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(batch))
    assert np.mean(first == second) == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(batch))
    carried = see(np.full(batch, 2), NOTHING, holding=np.zeros(batch, int))
    assert (caregiver.choose(carried) == STAIRWELL).all()


@settings(max_examples=6, deadline=None)
@given(plan_texts(largest=12), st.integers(0, 2**31 - 1), st.integers(1, 3))
def test_every_caregiver_decides_for_each_world_alone_and_only_on_hazards(text, seed, children):
    plan = FloorPlan.parse(text)
    random = np.random.default_rng(seed)
    batch, candles = 6, len(plan.candle_tables)
    tables = [random.permutation(len(plan.tables))[:candles] for _ in range(batch)]
    seen = Percept(
        child_cell=pick(random.random((batch, children)), len(plan.free_cells)),
        previous_cell=pick(random.random((batch, children)), len(plan.free_cells)),
        previous_action=random.integers(-1, 4, size=(batch, children)),
        caregiver_cell=pick(random.random(batch), len(plan.caregiver_cells)),
        candle_table=np.reshape(tables, (batch, -1)),
        holding=np.full(batch, NOTHING),
        candle_cell=np.full((batch, candles), NOTHING),
        out_of_reach=random.random((batch, len(plan.hazards))) < 0.2,
        time_left=random.integers(0, 4, size=batch) / 3,
    )
    for caregiver in all_caregivers(plan):
        caregiver.reset(batch, range(batch), children)
        caregiver.watch(seen)
        decision = caregiver.choose(seen)
        worth = caregiver.worth_protecting(seen)
        assert worth.shape == (batch, len(plan.hazards))
        for i in range(batch):
            is_worth = decision[i] == NOTHING or worth[i, decision[i]]
            if isinstance(caregiver, PATIENT):  # which does not ask how far from the child a table is
                is_worth = decision[i] == NOTHING or not seen.out_of_reach[i, decision[i]]
            assert is_worth or isinstance(caregiver, GuardCaregiver)  # which stays at its post
            shown = (getattr(seen, field) for field in seen.__dataclass_fields__)
            one = Percept(*(None if values is None else values[i : i + 1] for values in shown))
            caregiver.reset(1, [i], children)
            caregiver.watch(one)
            assert caregiver.choose(one).tolist() == [decision[i]]
            if candles:
                safe = caregiver.destination(one, np.zeros(1, int))[0]
                assert safe not in seen.candle_table[i]


def several(*cells):
    """A percept of one world with several children."""
    together = {"child_cell": [cells], "previous_cell": [cells], "previous_action": [[NOTHING] * len(cells)]}
    return percept(CORRIDOR, 0, 4, **together)


def test_dangers_to_several_children_add_up_by_hand():
    # Distances to stairwell and candle: from cell 0 1 and 3, from cell 2 3 and 1; so reach is 3/4, 1/4 and 1/4, 3/4.
    # All as likely safe as not. Sums: 5 (3/4 + 1/4 + 1/4) = 6.25 against 4 (1/4 + 3/4 + 3/4) = 7. Greatest: 3.75, 3.
    seen = several(0, 2, 2)
    caregiver = PaperCaregiver(CORRIDOR)
    caregiver.reset(1, children=3)
    assessment = caregiver.assess(seen)
    np.testing.assert_allclose(assessment.reach, [[[3 / 4, 1 / 4], [1 / 4, 3 / 4], [1 / 4, 3 / 4]]])
    np.testing.assert_allclose(assessment.danger, assessment.reach * [5, 4] / 2)
    np.testing.assert_allclose(assessment.urgency, [[6.25, 7.0]])
    assert caregiver.choose(seen).tolist() == [CANDLE]
    greatest = Max(CORRIDOR)
    greatest.reset(1, children=3)
    np.testing.assert_allclose(greatest.assess(seen).urgency, [[3.75, 3.0]])
    assert greatest.choose(seen).tolist() == [STAIRWELL]


def test_the_child_that_is_not_safe_is_attended_to():
    """The one in cell 0 is beside the stairs, the one in cell 2 beside the candle: whoever behaves worse decides."""
    for careless, decision in ((0, STAIRWELL), (1, CANDLE)):
        weighing, alike = PaperCaregiver(CORRIDOR), Alike(CORRIDOR)
        for caregiver in (weighing, alike):
            caregiver.action_prior = np.array([[0.05, 0.85, 0.05, 0.05]] * 5)
            caregiver.reset(1, children=2)
            actions = [EAST, EAST]
            actions[careless] = WEST
            for _ in range(4):
                moved = dataclasses.replace(several(0, 2), previous_action=np.array([actions]))
                caregiver.watch(moved)
        assert weighing.choose(several(0, 2)).tolist() == [decision]
        assert alike.choose(several(0, 2)).tolist() == [STAIRWELL]


def test_the_candle_goes_to_the_table_farthest_from_the_nearest_child():
    # Bare tables 0 and 2: child in cell 0 is 1 and 5 moves from them, the one in cell 3 4 and 2.
    caregiver = PaperCaregiver(CORRIDOR)
    assert caregiver.destination(several(0, 3), np.zeros(1, int)).tolist() == [2]
    assert caregiver.destination(several(1, 4), np.zeros(1, int)).tolist() == [0]


def test_a_candle_is_worth_it_if_its_nearest_child_would_be_farther():
    # Children in cells 0 and 4: one is 1 move from table 0, one 1 from table 2, both 3 from table 1.
    caregiver, seen = PaperCaregiver(CORRIDOR), several(0, 4)
    for table, worth in ((1, False), (2, True)):
        there = dataclasses.replace(seen, candle_table=np.array([[table]]))
        assert caregiver.worth_protecting(there).tolist() == [[True, worth]]


@pytest.mark.parametrize(("child_cell", "moves"), [(0, 3), (1, 2), (2, 1), (3, 1), (4, 1)])
def test_a_candle_on_the_floor_is_protected_like_any_other_as_near_as_its_cell(child_cell, moves):
    """From cell 4 it is one move away, the stairwell five."""
    seen = see(4, NOTHING, candle_cell=[[3]])
    assert make_caregiver("paper", CORRIDOR).choose(seen).tolist() == [CANDLE]
    assert make_caregiver("paper", CORRIDOR).choose(see(4, NOTHING)).tolist() == [STAIRWELL]
    # It lies in cell 3: one runs into it by stepping there, or is there already.
    seen = see(child_cell, NOTHING, candle_cell=[[3]])
    caregiver = make_caregiver("nearest", CORRIDOR)
    assert caregiver.hazard_distances(seen).tolist() == [[[child_cell + 1, moves]]]


PAPER = FloorPlan.load("paper")


def test_it_is_learned_from_experts_in_the_house_and_by_default_from_1000_timesteps_of_them():
    experts = expert_trajectories(PAPER, random := np.random.default_rng(3), 500)
    alpha = safety.action_counts(experts, len(PAPER.free_cells), 2.0)
    expected = safety.action_prior_draw(alpha, random)
    assert (PaperCaregiver(PAPER, 3, expert_timesteps=500, hyperprior=2.0).action_prior == expected).all()
    default = PaperCaregiver(PAPER, 3, expert_timesteps=1000, hyperprior=1.0).action_prior
    assert (PaperCaregiver(PAPER, 3).action_prior == default).all()


def test_without_any_the_mean_tells_nothing_and_a_draw_is_noise():
    assert (PaperCaregiver(PAPER, prior="mean", expert_timesteps=0).action_prior == 0.25).all()
    drawn = PaperCaregiver(PAPER, expert_timesteps=0).action_prior
    assert drawn.sum(axis=1) == pytest.approx(1.0)
    assert drawn.std() > 0.1


ROOM = FloorPlan.parse("##########\n#B......T#\n#........#\n#........#\n#.C.....S#\n##########", "room")


@pytest.mark.parametrize("maker", [PaperCaregiver, NearestCaregiver])
@pytest.mark.parametrize("child", ["seeker:0", "0", "1"])
def test_who_follows_is_found_out_and_led_away(maker, child):
    caregiver = maker(ROOM)
    world = begun(GridWorld(ROOM, child, caregiver), 10)
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

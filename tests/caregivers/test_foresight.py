"""The caregiver with foresight: what it reckons with, against values worked by hand, and what it does about it."""

import dataclasses
import functools

import numpy as np
import pytest

from caregiver_mj.caregivers.foresight.child_model import EPSILONS, novice_chain
from caregiver_mj.caregivers.foresight.departure import Departure
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver, options_of
from caregiver_mj.caregivers.foresight.itineraries import Itineraries
from caregiver_mj.caregivers.foresight.knows_goal import KnowsGoalCaregiver
from caregiver_mj.caregivers.foresight.layouts import AllLayouts
from caregiver_mj.caregivers.foresight.options import Options
from caregiver_mj.caregivers.foresight.prospects import MOMENTS, prospects
from caregiver_mj.caregivers.foresight.reckoning import Reckoning
from caregiver_mj.caregivers.foresight.standing import each_on_a_table
from caregiver_mj.caregivers.foresight.travel import timesteps, travel
from caregiver_mj.caregivers.foresight.values import Values, values
from caregiver_mj.caregivers.pace import Pace
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.caregivers.predictive import PaperPredictiveCaregiver
from caregiver_mj.caregivers.registry import CAREGIVERS
from caregiver_mj.caregivers.told import ToldCaregiver, Truth
from caregiver_mj.children.family import Family
from caregiver_mj.children.side_by_side import side_by_side
from caregiver_mj.children.tape import EPISODE_TIMESTEPS, Tape
from caregiver_mj.errors import CaregiverError
from caregiver_mj.grid.world import GridWorld, run_episodes
from caregiver_mj.interventions.intervention import BLOCK, RELOCATE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.generator import generate
from caregiver_mj.plans.hazards import NOTHING

CORRIDOR = """
#######
#B...S#
#######
"""
TWO_ENDS = """
#########
#S.....S#
###.#####
###B#####
#########
"""
TABLES = """
########
#C....T#
#......#
#.B..B.#
########
"""
THREE_TABLES = """
########
#C....T#
#......#
#.B..BT#
########
"""
STAIRS_AND_TABLES = """
########
#C....T#
#......#
#.B..BS#
########
"""
FOUR_TABLES = """
########
#C....T#
#......#
#CB..BT#
########
"""
NO_CANDLE = """
#####
#B.T#
#..S#
#####
"""
ONLY_TOYS = """
#####
#B.B#
#####
"""


def tapes(count, children=1, timesteps=EPISODE_TIMESTEPS):
    return [Tape.draw_family(np.random.RandomState(seed), children, timesteps) for seed in range(count)]


def percept(plan, child, caregiver, candle_table=None, previous=None, action=-1):
    tables = plan.candle_tables if candle_table is None else candle_table
    return Percept(
        np.array([[child]]),
        np.array([[child if previous is None else previous]]),
        np.array([[action]]),
        np.array([caregiver]),
        np.array([tables], int).reshape(1, -1),
        np.array([-1]),
    )


class TestLayouts:
    def test_all_of_them(self):
        layouts = AllLayouts(3, 2)
        assert layouts.bears.astype(int).tolist() == [[1, 1, 0], [1, 0, 1], [0, 1, 1]]
        bare = np.array([[2], [0], [1]])
        tables = np.array([[1, 0], [2, 1], [0, 2]])
        assert layouts.now(tables).tolist() == [0, 2, 1]
        # Candle by candle: tables 0 and 2, then 0 and 1 ...
        assert layouts.later(tables, bare)[:, :, 0].tolist() == [[1, 2], [0, 1], [2, 0]]

    def test_what_comes_after(self):
        after = AllLayouts(3, 2).after
        assert after[0].tolist() == [[-1, -1, 2], [-1, -1, 1], [-1, -1, -1]]

    def test_no_candles(self):
        layouts = AllLayouts(2, 0)
        assert len(layouts) == 1
        assert layouts.now(np.empty((3, 0), int)).tolist() == [0, 0, 0]


class TestTravel:
    def test_moves_of_the_child_meanwhile(self):
        # Three actions a timestep: with all of them left, three take no move of the child and four take one.
        assert timesteps(np.array([0, 3, 4, 6, 7]), 3).tolist() == [0, 0, 1, 1, 2]
        assert timesteps(np.array([0, 1, 2, 4, 5]), 1).tolist() == [0, 0, 1, 1, 2]

    def test_moves_of_the_child_at_another_pace(self):
        slow = Pace(cells=2.5)
        assert timesteps(np.array([2.5, 2.6, 5.0, 5.1, 7.5]), 0.0, slow).tolist() == [1, 2, 2, 3, 3]
        assert timesteps(np.array([2.5, 2.6, 5.0]), 2.5, slow).tolist() == [0, 1, 1]

    def test_a_pace_between_two_numbers_of_cells_is_either_in_turn(self):
        plan = FloorPlan.parse(TWO_ENDS)
        # From cell 0 to the landing in the east, with the child before the bin: 2 cells or 3, 2.25 on an average.
        (first, two), (second, three) = travel(plan, Pace(cells=2.25)).in_a_timestep()
        assert (first, second) == pytest.approx((0.75, 0.25))
        assert (two[5, 1, 0], three[5, 1, 0]) == (2, 3)
        ((sure, after),) = travel(plan, Pace(cells=2)).in_a_timestep()
        assert (sure, after[5, 1, 0]) == (1.0, 2)

    def test_slower_is_later(self):
        fast, slow = (values(FloorPlan.parse(TWO_ENDS), Pace(cells)).transit.to_post[..., :-1] for cells in (3.0, 1.5))
        assert (slow >= fast).all()
        assert slow.mean() > 1.5 * fast.mean()

    def test_steps_round_the_child(self):
        ways = travel(FloorPlan.parse(TWO_ENDS))
        # Cells 0 to 4 from west to east, 5 before the bin, landings 6 and 7. From cell 0 to the east landing:
        assert ways.step[:, 5, 1, 0].tolist() == [0, 1, 2, 3]
        # With the child in cell 3 it comes no farther than cell 2.
        assert ways.step[:, 3, 1, 0].tolist() == [0, 1, 2, 2]

    def test_a_candle_is_got_one_action_after_it_is_there(self):
        ways = travel(FloorPlan.parse(TABLES))
        table = len(ways.posts)
        start = 1  # two cells east of the first table, whose neighbour is cell 0
        assert ways.step[:, 10, table, start].tolist() == [1, 0, ways.done, ways.done]


class TestValues:
    def test_a_child_at_its_goal_is_in_no_danger(self):
        # From the middle of the corridor an expert walks away from the stairs: no falls but by chance, and whoever
        # stands in the stairwell already has none to expect.
        found = values(FloorPlan.parse(CORRIDOR))
        assert found.arrival[0, found.post_column[0, 0]] == pytest.approx(0.0)

    def test_falls_while_the_caregiver_is_on_its_way(self):
        plan = FloorPlan.parse(CORRIDOR)
        found = values(plan)
        # The caregiver in cell 0 and the child, at random, in cell 2 before the stairs: it falls with probability 1/4
        # while the caregiver, which cannot pass, follows it.
        bins, epsilon = len(plan.bins), len(EPSILONS) - 1
        state = (bins - 1) * len(EPSILONS) + epsilon
        assert found.transit.cost[0, 2, state, 1] > 5 / 4
        # One move of the child until it is there, if it can pass at once: then only that move's danger.
        one_move = values(plan, reckoning=Reckoning(price=0.0)).transit.cost[0, 0, state, 1]
        assert one_move == pytest.approx(0.0)

    def test_more_rounds_find_no_worse(self):
        plan = FloorPlan.load("paper")
        few, many = (Values(plan, reckoning=Reckoning(rounds=n)) for n in (2, 4))
        posts = few.post_column.ravel()
        assert (many.arrival[0, posts] <= few.arrival[0, posts] + 1e-3).all()
        assert many.arrival[0, posts].mean() < few.arrival[0, posts].mean() - 0.01

    def test_they_are_what_happens(self):
        """The damage that is expected at first is about what comes, told everything."""
        plan, episodes = FloorPlan.load("train-100/6"), 80
        caregiver = KnowsGoalCaregiver(plan)
        world = GridWorld(plan, 0.5, caregiver)
        world.reset(tapes(episodes))
        world.step()
        free = np.flatnonzero((world.candle_table >= 0).all(axis=1))
        expected = caregiver.expected_damage(world.percept(), free)
        before, total = world.ledger.harm.sum(axis=1), np.zeros(episodes)
        for timestep in range(199):
            world.step()
            now = world.ledger.harm.sum(axis=1)
            harm = (now - before) @ [1.0, 0.75, 0.0]  # three of four that a candle does it does because it is there
            total, before = total + 0.985**timestep * harm, now
        assert 0.3 * expected.mean() < total[free].mean() < 1.1 * expected.mean()


class TestForesight:
    def test_goes_where_the_child_is_heading(self):
        """In a corridor with stairs at both ends, it takes the child's way for a hint, before it is near either."""
        plan = FloorPlan.parse(TWO_ENDS)
        caregiver = ForesightCaregiver(plan)
        for towards, stairwell in ((0, 0), (4, 1)):
            caregiver.reset(1)
            # Away from the bin again and again: a child at random, next to one of the ends.
            answer = caregiver.decide(percept(plan, towards, 2))
            assert (answer.verb[0], answer.hazard[0]) == (BLOCK, stairwell)

    def test_carries_the_candle_to_a_table_that_it_chooses(self):
        plan = FloorPlan.parse(TABLES)
        caregiver = ForesightCaregiver(plan)
        answer = caregiver.decide(percept(plan, 1, 9))
        assert (answer.verb[0], answer.hazard[0], answer.destination[0]) == (RELOCATE, 0, 1)
        away = caregiver.decide(percept(plan, 9, 5, candle_table=[1]))
        assert away.hazard[0] in (-1, 0)

    def test_every_world_tells_it_its_pace_and_the_time_left(self):
        plan, told = FloorPlan.parse(TABLES), []

        class Listener(ForesightCaregiver):
            def decide(self, percept):
                told.append(percept.time_left.tolist())
                return super().decide(percept)

        caregiver = Listener(plan)
        world = GridWorld(plan, 0.5, caregiver, caregiver_actions=2)
        world.reset(tapes(2))
        world.step()
        assert caregiver.pace == Pace(cells=2)
        assert told == [[1.0, 1.0], [0.5, 0.5]]

    def test_the_time_left_counts(self):
        """Who is in cell 0 is at the near end at once, and at the far end a timestep later; or each a move later."""
        found = values(FloorPlan.parse(TWO_ENDS))
        for cells, moves in ((3, [0, 1]), (2.8, [0, 1]), (0, [1, 2])):
            departure = Departure(found.ways, found.transit, np.array([5]), np.array([0]), cells)
            assert departure.to_post[:, 0, 0].tolist() == moves

    def test_puts_down_first_what_it_holds(self):
        plan = FloorPlan.parse(TABLES)
        held = percept(plan, 1, 9, candle_table=[-1])
        assert ForesightCaregiver(plan).decide(held).hazard[0] == -1

    def test_keeps_to_the_table_that_it_chose_when_the_candle_is_in_the_hand(self):
        plan = FloorPlan.parse(THREE_TABLES)
        caregiver, candle = ForesightCaregiver(plan), np.array([0])
        chosen = caregiver.decide(percept(plan, 1, 9)).destination[0]
        # The child goes to where the farthest table is another one.
        held = percept(plan, 3, 9, candle_table=[NOTHING])
        assert caregiver.destination(held, candle).tolist() == [chosen]
        farthest = PaperCaregiver(plan).destination(held, candle).tolist()
        assert farthest != [chosen]
        caregiver.reset(1)
        assert caregiver.destination(held, candle).tolist() == farthest  # nothing has been chosen

    def test_picks_up_a_candle_from_the_floor_before_anything_else(self):
        plan = FloorPlan.parse(STAIRS_AND_TABLES)
        lying = dataclasses.replace(
            percept(plan, 1, 9, candle_table=[NOTHING]),
            candle_cell=np.array([[4]]),
            out_of_reach=np.array([[False, False]]),
        )
        answer = ForesightCaregiver(plan).decide(lying)
        assert (answer.verb[0], answer.hazard[0]) == (RELOCATE, 1)
        # Where it does not get at it there is still the stairwell.
        beyond = dataclasses.replace(lying, out_of_reach=np.array([[False, True]]))
        answer = ForesightCaregiver(plan).decide(beyond)
        assert (answer.verb[0], answer.hazard[0]) == (BLOCK, 0)
        nothing = dataclasses.replace(lying, out_of_reach=np.array([[True, True]]))
        assert ForesightCaregiver(plan).decide(nothing).hazard[0] == NOTHING

    def test_reckons_with_every_candle_on_a_table_of_its_own(self):
        plan = FloorPlan.parse(FOUR_TABLES)  # tables 0 to 3 in the corners of the room
        one_lies = dataclasses.replace(
            percept(plan, 1, 9, candle_table=[0, NOTHING]), candle_cell=np.array([[NOTHING, 0]])
        )
        assert each_on_a_table(plan, one_lies).candle_table.tolist() == [[0, 2]]
        together = dataclasses.replace(one_lies, candle_table=np.array([[1, 1]]), candle_cell=np.full((1, 2), NOTHING))
        assert each_on_a_table(plan, together).candle_table.tolist() == [[1, 3]]
        held = dataclasses.replace(one_lies, candle_cell=np.full((1, 2), NOTHING), holding=np.array([1]))
        assert each_on_a_table(plan, held).candle_table.tolist() == [[0, NOTHING]]
        grid = percept(plan, 1, 9)
        assert each_on_a_table(plan, grid) is grid

    @pytest.mark.parametrize("text", [CORRIDOR, TWO_ENDS, TABLES, NO_CANDLE, ONLY_TOYS])
    def test_lives_in_every_house(self, text):
        plan = FloorPlan.parse(text)
        ledger = GridWorld(plan, "0.5", ForesightCaregiver(plan)).run(tapes(3, timesteps=60))
        assert ledger.timestep == 60

    def test_an_episode_does_not_depend_on_its_batch(self):
        plan = FloorPlan.load("paper")
        caregiver = ForesightCaregiver(plan)
        together = run_episodes(plan, "0.5", caregiver, range(3)).totals()
        alone = run_episodes(plan, "0.5", caregiver, [2]).totals()
        assert all(values[2] == alone[name][0] for name, values in together.items())

    def test_it_beats_the_rule_where_that_is_weak(self):
        plan, seeds = FloorPlan.load("train-100/6"), range(60)
        rule, ours = (run_episodes(plan, "0.5", c(plan), seeds).totals() for c in (PaperCaregiver, ForesightCaregiver))
        difference = ours["damage"] - rule["damage"]
        assert difference.mean() < -3 * difference.std() / len(seeds) ** 0.5

    def test_several_children(self):
        plan = FloorPlan.load("paper")
        ledger = run_episodes(plan, "0.5,0.75", ForesightCaregiver(plan), range(2))
        assert ledger.harm.shape[1] == 2


def composed(plan):
    """Options as a large house has them."""
    return functools.partial(Itineraries, prospects(plan))


class TestLargeHouses:
    MIDDLING = "house-0-20x20"

    def test_small_ones_have_values_of_all_layouts(self):
        assert options_of(FloorPlan.parse(TABLES)).func is Options
        assert options_of(FloorPlan.load(self.MIDDLING)).func is Itineraries

    def test_what_a_relocation_is_worth(self):
        """Where there are no stairs: what the candle does until it is got, and from when it is placed."""
        plan = FloorPlan.parse(TABLES)
        caregiver = ForesightCaregiver(plan, options=composed(plan))
        found = caregiver.options_in(percept(plan, 1, 9), np.array([0]))
        staying = values(plan).staying @ np.full(len(plan.bins) * len(EPSILONS), 1 / 10)  # (timesteps, tables, cells)
        # From cell 9 it is beside the first table after 4 actions and beside the other after 5 more: with three of them
        # left, it gets after 1 move of the child and places after 3.
        assert found.damage[0, 1] == pytest.approx(staying[3, 1, 1] - staying[1, 0, 1], rel=1e-4)

    @pytest.mark.parametrize("text", [CORRIDOR, TWO_ENDS, TABLES, NO_CANDLE, ONLY_TOYS])
    def test_lives_in_every_house(self, text):
        plan = FloorPlan.parse(text)
        world = GridWorld(plan, "0.5,0.75", ForesightCaregiver(plan, options=composed(plan)))
        assert world.run(tapes(3, children=2, timesteps=60)).timestep == 60

    def test_who_stands_in_the_only_stairwell_has_nothing_to_fear(self):
        plan = FloorPlan.parse(CORRIDOR)
        landing = len(plan.free_cells)
        there, small = (
            ForesightCaregiver(plan, options=each).options_in(percept(plan, 2, landing), np.array([0]))
            for each in (composed(plan), None)
        )
        assert there.damage[0, 0] == pytest.approx(0.0, abs=1e-5)
        assert there.inaction == pytest.approx(small.inaction, rel=1e-4)
        assert there.inaction > 1

    def test_it_goes_round_a_child_or_waits(self):
        plan = FloorPlan.parse(TWO_ENDS)
        detours = prospects(plan).detours
        # From cell 0 to the east landing it is 5 actions, and 4 moves of the child more if that is in between.
        found = detours.actions(np.array([0, 3, 5]), np.array([1, 0, 0]))
        assert found[:, 1].tolist() == [4, 5 + 12, 5]

    def test_what_can_follow_is_never_worse(self):
        plan = FloorPlan.load(self.MIDDLING)
        world = GridWorld(plan, 0.5, None)
        world.reset(tapes(20))
        belief = ForesightCaregiver(plan).belief.probability.repeat(20, axis=0)
        found = Itineraries(prospects(plan), world.percept(), np.arange(20), belief, 1.0)
        alone = Itineraries(prospects(plan), world.percept(), np.arange(20), belief, 1.0)
        alone.following = 0
        assert (found.damage <= alone.damage).all()
        assert (found.damage < alone.damage - 1e-3).any()

    def test_it_takes_little_memory(self):
        plan = FloorPlan.load(self.MIDDLING)
        columns = len(plan.tables) + 2 * len(plan.stairwells) + 1
        bins = len(plan.bins)
        shape = len(plan.free_cells), len(MOMENTS), columns, bins * len(EPSILONS)
        assert prospects(plan).ahead.shape == shape
        assert prospects(plan).ahead.nbytes < 2e7

    def test_it_beats_the_nearest_first(self):
        plan, seeds = FloorPlan.load(self.MIDDLING), range(40)
        theirs, ours = (
            np.concatenate(
                [run_episodes(plan, epsilon, caregiver, seeds).totals()["damage"] for epsilon in (0.75, 0.5)]
            )
            for caregiver in (CAREGIVERS["nearest"](plan), ForesightCaregiver(plan))
        )
        assert ours.mean() < theirs.mean() - 2 * (ours - theirs).std() / len(ours) ** 0.5

    def test_beyond_what_it_can_hold(self):
        plan = generate(0, (60, 60), stairwells=4, candles=40, tables=20, bins=10)
        with pytest.raises(CaregiverError, match=r"too large .* 10 toy bins, 60 tables and 4 stairwells"):
            ForesightCaregiver(plan)


class TestToldCaregivers:
    def test_only_bounds_are_told(self):
        told = {name for name, maker in CAREGIVERS.items() if maker and issubclass(maker, ToldCaregiver)}
        assert told == {"knows-goal", "clairvoyant"}

    def test_the_world_tells_the_truth(self):
        class Listener(PaperCaregiver, ToldCaregiver):
            def hear(self, truth):
                self.truth = truth

        plan = FloorPlan.load("paper")
        caregiver = Listener(plan)
        children = side_by_side(plan, [Family.of(0.25), Family.of(1.0)], 2)
        world = GridWorld(plan, children, caregiver)
        world.reset(tapes(4))
        world.step()
        assert caregiver.truth.epsilon[:, 0].tolist() == [0.25, 0.25, 1.0, 1.0]
        assert caregiver.truth.goal.tolist() == world.goal.tolist()

    def test_it_believes_what_it_is_told(self):
        caregiver = KnowsGoalCaregiver(FloorPlan.load("paper"))
        caregiver.hear(Truth(np.array([[2]]), np.array([[0.375]])))
        # Half way between two that it has plans for.
        assert caregiver.belief.goal[0, 0].tolist() == [0, 0, 1, 0]
        assert caregiver.belief.epsilon[0, 0].tolist() == pytest.approx([0, 0.5, 0.5, 0, 0])


class TestPredictive:
    def test_reach_is_a_first_passage(self):
        plan = FloorPlan.parse(CORRIDOR)
        caregiver = PaperPredictiveCaregiver(plan, horizon=1)
        # Before the stairs, with every epsilon as probable: only a random move leads there.
        assert caregiver.reach(percept(plan, 2, 0)) == pytest.approx(np.mean(EPSILONS) / 4)
        assert caregiver.reach(percept(plan, 1, 0)) == pytest.approx(0.0)

    def test_a_candle_in_the_hand_is_out_of_reach(self):
        plan = FloorPlan.parse(TABLES)
        caregiver = PaperPredictiveCaregiver(plan)
        assert caregiver.reach(percept(plan, 1, 9)) > 0
        assert caregiver.reach(percept(plan, 1, 9, candle_table=[-1])) == 0


def test_the_model_is_the_novice():
    chain = novice_chain(FloorPlan.load("paper"))
    assert chain.moves.sum(axis=-1) == pytest.approx(1.0)
    assert chain.transition.sum(axis=1) == pytest.approx(1.0)

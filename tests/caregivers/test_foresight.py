"""The caregiver with foresight: what it reckons with, against values worked by hand, and what it does about it."""

import dataclasses

import numpy as np
import pytest
from worlds import begun, percept

from caregiver_mj.caregivers.caregiver import PrivilegedCaregiver, Truth
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver, KnowsGoalCaregiver, each_on_a_table
from caregiver_mj.caregivers.foresight.motion import motion
from caregiver_mj.caregivers.foresight.options import Options, first_of_least
from caregiver_mj.caregivers.foresight.value_table import (
    AllLayouts,
    Objective,
    ValueTable,
    candles_at_a_time,
    value_tables,
)
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import Pace
from caregiver_mj.children.child_group import ChildGroup, side_by_side
from caregiver_mj.danger.child_model import EPSILONS
from caregiver_mj.grid.world import GridWorld, run_episodes
from caregiver_mj.interventions.verb import BLOCK, RELOCATE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from studies.ablations import Predictive

CORRIDOR = FloorPlan.parse("#######\n#B...S#\n#######")
TWO_ENDS = FloorPlan.parse("#########\n#S.....S#\n###.#####\n###B#####\n#########")
TABLES = FloorPlan.parse("########\n#C....T#\n#......#\n#.B..B.#\n########")
THREE_TABLES = FloorPlan.parse("########\n#C....T#\n#......#\n#.B..BT#\n########")
STAIRS = FloorPlan.parse("########\n#C....T#\n#......#\n#.B..BS#\n########")
FOUR_TABLES = FloorPlan.parse("########\n#C....T#\n#......#\n#CB..BT#\n########")  # 0 to 3 in the corners


def test_all_layouts_and_what_comes_after_them():
    layouts = AllLayouts(3, 2)
    assert layouts.bears.astype(int).tolist() == [[1, 1, 0], [1, 0, 1], [0, 1, 1]]
    assert layouts.now(np.array([[1, 0], [2, 1], [0, 2]])).tolist() == [0, 2, 1]
    assert layouts.after[0].tolist() == [[-1, -1, 2], [-1, -1, 1], [-1, -1, -1]]


class TestMotion:
    def test_moves_of_the_child_meanwhile(self):
        # Three steps a timestep: with all of them left, three take no move of the child and four take one.
        timesteps = motion(TWO_ENDS).timesteps
        assert timesteps(np.array([0, 3, 4, 6, 7]), 3).tolist() == [0, 0, 1, 1, 2]
        assert timesteps(np.array([0, 1, 2, 4, 5]), 1).tolist() == [0, 0, 1, 1, 2]

    def test_a_cell_that_is_not_reached_in_time_is_reached_with_the_share_of_its_time(self):
        ways = motion(TWO_ENDS, Pace(cells=2.25))
        here, then, share = ways.walk(1, 5, 0, np.array([2.25, 2.0, 0.0]))  # to the east landing, see below
        assert (here.tolist(), then[0], share.tolist()) == ([2, 2, 0], 3, [0.25, 0.0, 0.0])

    def test_a_cell_takes_longer_with_a_child_ahead_or_beside(self):
        way = Pace(beside=((9.0, 2.0), (5.0, 4.0))).way
        east, south = np.array([0, 1]), np.array([1, 0])
        assert way(east, np.array([1, 1])) == way(east, np.array([-1, 1])) == way(south, np.array([1, 1])) == 4.0
        assert (way(east, south), way(south, south)) == (2.0, 5.0)  # square to it, and straight ahead
        assert (way(-east, np.array([1, 1])), way(east, 2 * south), way(east, 2 * east)) == (1.0, 1.0, 1.0)

    def test_a_child_that_makes_it_slow_is_passed_all_the_same(self):
        """In a cell beside the way; the next cell takes four steps, and a timestep has one and a half."""
        plan = FloorPlan.parse("########\n#.....S#\n####.###\n####B###\n########")
        ways = motion(plan, Pace(cells=3, start=1.5, beside=((1.0, 3.0), (1.0, 4.0))))
        child, two = (plan.caregiver_cells.index(cell) for cell in ((2, 4), (1, 3)))
        here, then, share = ways.walk(0, child, two, ways.turn)
        assert (here, then) == (two, two + 1)
        assert share == pytest.approx(1.5 / 4)
        assert ways.distance[0, child, two] == 4 + 3 + 1  # towards it, past it, and on
        assert ways.distance[0, child, two - 1] == 1 + 4 + 3 + 1

    def test_a_robot_sets_off_in_each_timestep_to_come_and_twice_for_a_candle(self):
        slow, at_once = motion(TABLES, Pace(cells=3, start=1.5)), motion(TABLES, Pace(cells=3))
        assert (slow.turn, at_once.turn) == (1.5, 3.0)
        assert motion(TABLES, Pace(cells=3, start=5)).turn == 1.0  # it gets on all the same
        stand, table, left = at_once.stands[0][:1], np.array([0]), np.array([0.0])
        child = np.array([len(TABLES.free_cells) - 1])  # not there
        assert at_once.carry(stand, table, child, left).tolist() == [1]  # one step to put it down, of three
        assert slow.carry(stand, table, child, left).tolist() == [2]  # four, with twice 1.5 lost

    def test_steps_round_the_child(self):
        ways = motion(TWO_ENDS)
        # Cells 0 to 4 from west to east, 5 before the bin, landings 6 and 7. From cell 0 to the east landing:
        assert ways.walk(1, 5, 0, np.arange(4))[0].tolist() == [0, 1, 2, 3]
        # With the child in cell 3 it comes no farther than cell 1: there is a free cell between them.
        assert ways.walk(1, 3, 0, np.arange(4))[0].tolist() == [0, 1, 1, 1]
        assert ways.walk(ways.aside + 1, 3, np.arange(8), 3)[0].tolist() == [*range(8)]  # to stay

    def test_it_may_wait_wherever_it_comes_to_but_not_past_the_child(self):
        """Cells as above. From cell 1, with the child in cell 3: to its three neighbours, and the landing 6."""
        ways = motion(TWO_ENDS, Pace(cells=2.25))
        child, start = np.array([3, 3]), np.array([1, 1])
        state, cell, before, share = ways.waits(child, start, np.array([2.25, 0.5]))
        assert cell[state == 0].tolist() == [0, 1, 2, 5, 6]
        assert before[state == 0].tolist() == [1, 1, 1, 1, 0]
        assert share[state == 0].tolist() == [1.0] * 5
        assert cell[state == 1].tolist() == [0, 1, 2, 5]  # half a step: as likely not yet there
        assert share[state == 1].tolist() == [0.5, 1.0, 0.5, 0.5]

    def test_of_a_cell_that_is_begun_the_share_of_its_own_time_counts(self):
        ways = motion(TWO_ENDS, Pace(cells=2.25))
        _, cell, before, share = ways.waits(np.array([5]), np.array([1]), np.array([1.5]))  # cell 3 is two steps away
        assert (before[cell == 3].tolist(), share[cell == 3].tolist()) == ([2], [0.5])

    def test_a_way_to_wait_beside_a_child_takes_longer_than_one_away_from_it(self):
        ways = motion(TWO_ENDS, Pace(cells=3, beside=((1.0,), (1.0,), (4.0,))))
        _, cell, _, share = ways.waits(np.array([4]), np.array([2]), np.array([2.0]))  # two cells from it
        assert dict(zip(cell.tolist(), share.tolist(), strict=True)) == {0: 1.0, 1: 1.0, 2: 1.0, 3: 0.5, 5: 1.0}

    def test_a_candle_is_in_the_hand_one_step_after_it_is_there(self):
        ways = motion(TABLES)
        child, start = np.full(4, 10), np.full(4, 1)  # the table is beside cell 0
        got, cell, left = ways.fetch(0, child, start, np.arange(4))
        assert (got.tolist(), cell.tolist()) == ([0, 0, 1, 1], [1, 0, 0, 0])
        assert left.tolist() == [0, 0, 0, 1]

        # Where that takes longer than there is time for, with the share of it.
        got, cell, _ = motion(TABLES, Pace(get=4.0)).fetch(0, 10, 1, np.array([1.0, 2.0, 3.0]))
        assert got == pytest.approx([0.0, 0.25, 0.5], abs=1e-6)
        assert cell.tolist() == [0, 0, 0]

    def test_carrying_past_a_child_takes_longer(self):
        ways = motion(FloorPlan.parse("########\n#C....T#\n####B###\n########"))
        where, table = np.array([0]), np.array([1])
        # Three cells and to put it down, or as long as it takes until a child in the only way is gone.
        assert ways.carry(where, table, np.array([3]), np.array([0.0])).tolist() == [6]
        assert motion(TABLES).carry(where, table, np.array([10]), np.array([0.0])).tolist() == [2]


class TestValueTable:
    def test_behind_a_caregiver_in_the_only_stairwell_there_is_nothing_to_fear(self):
        found = ValueTable(CORRIDOR, objective=Objective(discount=0.9, sweeps=200, tolerance=0.0))
        child = np.arange(3)
        assert found.at(0, child, 3) == pytest.approx(0.0, abs=2e-3)

    def test_a_move_into_the_caregiver_leaves_the_child_where_it_is(self):
        """In cell 2, next to the stairs, at random: it falls with 1/4, and goes west with 1/4 unless that is denied."""
        objective = Objective(discount=0.5, price=0.0, random_price=2.0, sweeps=60, tolerance=1e-7)
        found = ValueTable(CORRIDOR, objective=objective)
        at_random = EPSILONS.index(1.0)  # of a novice, whose only bin comes first
        beside = found.at(0, 2, 1)[at_random]
        # Whether it goes or stays, the caregiver in cell 1 cannot pass the child: it waits in cell 0, from where it
        # denies nothing, or stays beside it.
        away = found.at(0, 2, 0)[at_random]
        fall = 5 / 4
        assert beside == pytest.approx(fall + 2.0 / 4 + 0.5 * min(away, beside), rel=1e-3)
        assert away < beside

    def test_what_a_child_is_denied_while_a_candle_is_carried_has_its_price(self):
        """A child at random in a corridor between two tables, before which the bin is south of its middle cell, 2."""
        plan = FloorPlan.parse("########\n#C....T#\n####B###\n########")
        objective = Objective(discount=0.5, price=0.0, random_price=2.0, tolerance=0.0)
        found = ValueTable(plan, objective=objective)
        free = ValueTable(plan, objective=dataclasses.replace(objective, random_price=0.0))
        at_random = EPSILONS.index(1.0)

        def denied(table, child, stand, left):
            leg = [np.array([one]) for one in (0, 0, table, child, stand, left)]
            return (found._leg(*leg)[1] - free._leg(*leg)[1])[0, at_random]

        # With no step left the caregiver in cell 3, beside the second table, is in the way of one move: east.
        assert denied(1, 2, 3, 0.0) == pytest.approx(2.0 / 4)
        assert denied(1, 2, 3, 1.0) == 0.0  # with one it has put the candle down by then
        # With a child beside it in cell 1 it has no way out of cell 0; with one in cell 2 it waits there, and with one
        # in cell 3 it comes as far as cell 1, and goes back. By six moves it is thought to have arrived.
        one = two = three = 0.0
        for _ in range(6):
            at_once = 2.0 / 4 + 0.5 * (3 * one + two) / 4
            one, two, three = at_once, 0.5 * (one + 2 * two + three) / 4, 0.5 * (3 * three + two) / 4
        assert [denied(1, child, 0, 0.0) for child in (1, 2, 3)] == pytest.approx([one, two, three], rel=1e-4)

    def test_a_timestep_ends_in_the_best_cell_that_is_reached(self):
        """By exhaustive search: within three steps, none of them into the child's cell."""
        table = ValueTable(TWO_ENDS)  # one from a file has no steps
        cells, value = len(TWO_ENDS.caregiver_cells), table.value[0]
        best = np.empty_like(value)
        table._best(0, value, [], best)
        for child in range(len(TWO_ENDS.free_cells)):
            far = TWO_ENDS.graph.distances_from([*range(cells)], [child])
            for cell in set(range(cells)) - {child}:
                reached = child * cells + np.flatnonzero(far[:, cell] <= 3)
                assert best[child * cells + cell] == pytest.approx(value[reached].min(axis=0))

    def test_a_relocation_is_worth_what_the_candle_would_have_done(self):
        found = value_tables(TABLES)[frozenset()]
        near_first, near_second = found.layouts.now(np.array([[0], [1]]))
        # With the child beside the first table and the caregiver far from it, the candle is better elsewhere.
        assert (found.at(near_second, 0, 3) < found.at(near_first, 0, 3)).all()

    def test_to_be_able_to_wait_anywhere_is_never_worse(self):
        """`learned` has learned from tables without that."""
        plan, objective = STAIRS, Objective(sweeps=400, tolerance=0.0)
        with_it, without = (value_tables(plan, objective=objective, waits=some)[frozenset()].value for some in (1, 0))
        assert (with_it <= without + 1e-3).all()
        assert (with_it < without - 0.05).any()

    def test_what_is_expected_is_what_happens(self):
        """The damage and the price that are expected at first are about what comes, told everything."""
        plan, episodes = FloorPlan.load("train-100/36"), 200
        objective = Objective(price=1.0, random_price=1.0)
        caregiver = KnowsGoalCaregiver(plan, objective=objective)
        world = begun(GridWorld(plan, 0.5, caregiver), episodes)
        world.step()
        free = np.flatnonzero((world.candle_table >= 0).all(axis=1))
        expected = caregiver.expected_damage(world.percept(), free)
        cost = world.ledger.damage + world.ledger.totals()["moves_blocked_free"]
        total = np.zeros(episodes)
        for timestep in range(199):
            world.step()
            now = world.ledger.damage + world.ledger.totals()["moves_blocked_free"]
            total, cost = total + 0.985**timestep * (now - cost), now
        error = 3 * (total[free] - expected).std() / len(free) ** 0.5
        assert 0.75 * expected.mean() - error < total[free].mean() < 1.1 * expected.mean() + error

    def test_fewer_candles_at_a_time_are_planned_for_where_there_are_too_many_layouts(self, monkeypatch):
        plan = FloorPlan.load("paper")
        assert candles_at_a_time(plan) == 4
        monkeypatch.setattr("caregiver_mj.caregivers.foresight.value_table.LAYOUTS", 30)
        assert candles_at_a_time(plan) == 2  # 28 pairs of eight tables
        assert candles_at_a_time(FloorPlan.load("house-0-60x60")) < 1


class TestForesight:
    def test_guards_what_it_can_get_to(self):
        """In a corridor with stairs at both ends, with the child between it and one of them, it goes to the other."""
        answer = ForesightCaregiver(TWO_ENDS).decide(percept(TWO_ENDS, 4, 2))
        assert (answer.verb[0], answer.hazard[0]) == (BLOCK, 0)

    def test_the_time_left_counts(self):
        """With no time left it is still where it is when the child moves next."""
        caregiver = ForesightCaregiver(STAIRS)
        seen = percept(STAIRS, 8, 0)  # the child is two moves from the stairs, the caregiver on the other side
        late = dataclasses.replace(seen, time_left=np.zeros(1))
        damage, too_late = (caregiver.options(one, np.array([0])).damage[0] for one in (seen, late))
        stay = len(STAIRS.stairwells) + 1
        assert too_late[:stay] == pytest.approx(np.full(stay, damage[stay]))
        assert damage.min() < damage[stay]

    def test_puts_down_first_what_it_holds(self):
        held = dataclasses.replace(percept(TABLES, 1, 9, candle_table=[NOTHING]), holding=np.array([0]))
        assert ForesightCaregiver(TABLES).decide(held).hazard[0] == NOTHING

    def test_keeps_to_the_table_that_it_chose_when_the_candle_is_in_the_hand(self):
        caregiver, candle = ForesightCaregiver(THREE_TABLES), np.array([0])
        chosen = caregiver.decide(percept(THREE_TABLES, 2, 0)).destination[0]
        assert chosen == 2
        # The child goes to where the farthest table is another one.
        held = percept(THREE_TABLES, 3, 9, candle_table=[NOTHING])
        assert caregiver.destination(held, candle).tolist() == [chosen]
        farthest = PaperCaregiver(THREE_TABLES).destination(held, candle).tolist()
        assert farthest != [chosen]
        caregiver.reset(1)
        assert caregiver.destination(held, candle).tolist() == farthest  # nothing has been chosen

    def test_goes_on_with_a_candle_until_that_is_where_it_shall_be(self):
        """What is as good but for less than the hysteresis does not interrupt a relocation; a finished one is over."""
        caregiver, worlds = ForesightCaregiver(THREE_TABLES), np.array([0])
        begun = percept(THREE_TABLES, 2, 0)
        answer = caregiver.decide(begun)
        assert (answer.verb[0], answer.destination[0]) == (RELOCATE, 2)
        relocation = caregiver.index.relocations.start
        damage = np.ones((1, len(caregiver.index)))
        damage[0, relocation] += caregiver._hysteresis / 2
        options = Options(damage, np.array([[2]]))
        assert caregiver.best(options, begun, worlds) == relocation
        assert caregiver.best(options, percept(THREE_TABLES, 2, 0, candle_table=[2]), worlds) != relocation

    def test_a_candle_that_may_be_in_the_hand_by_the_next_move_counts_as_likely_as_that_is(self):
        """In half of the time that it takes to get it the damage is half way between with it and without it."""
        caregiver = ForesightCaregiver(TABLES)
        caregiver.pace = Pace(cells=3.0, get=1.5)
        seen, relocation = percept(TABLES, 9, 0), caregiver.index.relocations.start  # it stands at the table
        times = (dataclasses.replace(seen, time_left=np.array([left])) for left in (0.0, 0.25, 0.5))
        without, half, with_it = (caregiver.options(one, np.array([0])).damage[0, relocation] for one in times)
        assert with_it != pytest.approx(without)
        assert half == pytest.approx((without + with_it) / 2)

    def test_picks_up_a_candle_from_the_floor_before_anything_else(self):
        lying = percept(STAIRS, 1, 9, candle_table=[NOTHING], candle_cell=[[4]], out_of_reach=[[False, False]])
        answer = ForesightCaregiver(STAIRS).decide(lying)
        assert (answer.verb[0], answer.hazard[0]) == (RELOCATE, 1)
        # Where it does not get at it there is still the stairwell.
        beyond = dataclasses.replace(lying, out_of_reach=np.array([[False, True]]))
        assert ForesightCaregiver(STAIRS).decide(beyond).verb[0] != RELOCATE
        nothing = dataclasses.replace(lying, out_of_reach=np.array([[True, True]]))
        assert ForesightCaregiver(STAIRS).decide(nothing).hazard[0] == NOTHING

    def test_reckons_with_every_candle_on_a_table_of_its_own(self):
        one_lies = percept(FOUR_TABLES, 1, 9, candle_table=[0, NOTHING], candle_cell=[[NOTHING, 0]])
        assert each_on_a_table(FOUR_TABLES, one_lies).candle_table.tolist() == [[0, 2]]
        together = dataclasses.replace(one_lies, candle_table=np.array([[1, 1]]), candle_cell=np.full((1, 2), NOTHING))
        assert each_on_a_table(FOUR_TABLES, together).candle_table.tolist() == [[1, 3]]
        held = dataclasses.replace(one_lies, candle_cell=np.full((1, 2), NOTHING), holding=np.array([1]))
        assert each_on_a_table(FOUR_TABLES, held).candle_table.tolist() == [[0, NOTHING]]
        grid = percept(FOUR_TABLES, 1, 9)
        assert each_on_a_table(FOUR_TABLES, grid) is grid


class TestManyCandles:
    """Where there are too many layouts for a table of all candles."""

    @pytest.fixture(autouse=True)
    def _few(self, monkeypatch):
        monkeypatch.setattr("caregiver_mj.caregivers.foresight.value_table.LAYOUTS", 8)
        value_tables.cache_clear()
        yield
        value_tables.cache_clear()

    def test_it_plans_for_each_candle_as_if_the_others_stayed(self):
        caregiver = ForesightCaregiver(FOUR_TABLES)
        assert candles_at_a_time(FOUR_TABLES) == 2
        assert caregiver.options(percept(FOUR_TABLES, 1, 9), np.array([0])).table.shape == (1, 2)

    def test_it_prevents_much_of_the_damage(self):
        plan, seeds = FloorPlan.load("train-100/6"), range(20)
        assert candles_at_a_time(plan) < len(plan.candle_tables)
        alone, ours = (run_episodes(plan, "0.5", c, seeds).totals() for c in (None, ForesightCaregiver(plan)))
        assert ours["damage"].mean() < 0.6 * alone["damage"].mean()
        assert ours["toys_reached"].mean() > 0.95 * alone["toys_reached"].mean()


def test_in_a_house_too_large_for_a_table_it_follows_the_rule(monkeypatch):
    monkeypatch.setattr("caregiver_mj.caregivers.foresight.value_table.LARGEST", 10)
    ours, rule = (run_episodes(STAIRS, 0.5, c(STAIRS), range(5)) for c in (ForesightCaregiver, Predictive))
    assert (ours.damage == rule.damage).all()
    lying = dataclasses.replace(percept(STAIRS, 1, 9, candle_table=[NOTHING]), candle_cell=np.array([[4]]))
    assert ForesightCaregiver(STAIRS).decide(lying).verb[0] == RELOCATE


class TestPrivilegedCaregivers:
    def test_the_world_tells_the_truth(self):
        class Listener(PaperCaregiver, PrivilegedCaregiver):
            def hear(self, truth):
                self.truth = truth

        plan = FloorPlan.load("paper")
        caregiver = Listener(plan)
        children = side_by_side(plan, [ChildGroup.of(0.25), ChildGroup.of(1.0)], 2)
        world = begun(GridWorld(plan, children, caregiver), 4)
        world.step()
        assert caregiver.truth.epsilon[:, 0].tolist() == [0.25, 0.25, 1.0, 1.0]
        assert caregiver.truth.goal.tolist() == world.goal.tolist()

    def test_it_believes_what_it_is_told(self):
        caregiver = KnowsGoalCaregiver(FloorPlan.load("paper"))
        caregiver.hear(Truth(np.array([[2]]), np.array([[0.375]])))
        novice = caregiver.belief.probability[0, 0, :4]  # of other kinds it is told nothing
        assert novice.sum(axis=1).tolist() == pytest.approx([0, 0, 0.85, 0])
        # Half way between two that it has plans for.
        assert novice.sum(axis=0).tolist() == pytest.approx([0, 0.425, 0.425, 0, 0])


def test_the_first_of_least_is_found_where_rounding_has_made_it_less_than_nothing():
    assert first_of_least(np.array([[1.0, -1e-9, 0.5], [2.0, 1.0, 1.000001]])).tolist() == [1, 1]


EAST = 1


@pytest.fixture(params=[ForesightCaregiver, Predictive])
def caregiver(request):
    return request.param(CORRIDOR)


def test_the_belief_is_there_to_be_seen(caregiver):
    """Away from its only toy a novice or an explorer goes by chance only: with a fourth of epsilon."""
    moved = percept(CORRIDOR, 1, 3, previous_cell=[[0]], previous_action=[[EAST]])
    caregiver.watch(moved)
    prediction = caregiver.assess(moved).prediction
    to_toy, elsewhere = 0.85 / 5 * np.array(EPSILONS) / 4, np.zeros(5)
    to_toy[[0, 2]] += 0.05 / 2 * np.array([0.05, 0.5]) / 4
    elsewhere[[0, 2]] = 2 * 0.05 / 2 * (1 - 0.75 * np.array([0.05, 0.5]))  # to the stairs, or to the caregiver there
    all_in_all = (to_toy + elsewhere).sum()
    assert prediction.epsilon[0, 0] == pytest.approx((to_toy + elsewhere) / all_in_all, abs=0.01)  # it may have changed
    assert prediction.toy_bin[0, 0] == pytest.approx([to_toy.sum() / all_in_all], abs=0.01)


def test_presence_within_a_timestep(caregiver):
    """Of a child in the middle: to its toy, or one in twenty to the stairs, unless it moves at random."""
    novice, other = np.mean(EPSILONS), np.mean([0.05, 0.5])
    here = caregiver.assess(percept(CORRIDOR, 1)).prediction.presence(1)[0, 0]
    random = 0.85 * novice + 0.15 * other
    to_toy = 0.85 * (1 - novice) + 0.1 * (1 - other)
    assert here == pytest.approx([to_toy + random / 4, random / 2, 0.05 * (1 - other) + random / 4])


def test_safety_is_that_of_the_paper_and_danger_is_equation_2(caregiver):
    rule = PaperCaregiver(CORRIDOR)
    for who in (caregiver, rule):
        who.watch(percept(CORRIDOR, 1, previous_cell=[[0]], previous_action=[[EAST]]))
        who.watch(percept(CORRIDOR, 2, previous_cell=[[1]], previous_action=[[EAST]]))
    found = caregiver.assess(percept(CORRIDOR, 2))
    assert found.safe == pytest.approx(rule.assess(percept(CORRIDOR, 2)).safe)
    assert found.danger == pytest.approx((1 - found.safe[..., None]) * found.reach * CORRIDOR.damage["stairwell"])
    assert found.urgency == pytest.approx(found.reach[:, 0] * CORRIDOR.damage["stairwell"])


def test_a_candle_that_is_carried_or_lies_on_the_floor():
    caregiver = ForesightCaregiver(TABLES)
    assert caregiver.assess(percept(TABLES, 1)).reach > 0
    assert caregiver.assess(percept(TABLES, 1, candle_table=[NOTHING])).reach == 0
    lying = percept(TABLES, 1, candle_table=[NOTHING], candle_cell=[[3]])  # two cells east of the child
    assert caregiver.assess(lying).reach == pytest.approx(1 / 2)


def test_what_lies_on_the_floor_is_reached_by_coming_into_its_cell_until_it_is_gone():
    plan = FloorPlan.parse("#######\n#B.o.S#\n#######")
    caregiver = ForesightCaregiver(plan)
    seen = percept(plan, 0)
    prediction = caregiver.assess(seen).prediction
    random, other = 0.85 * np.mean(EPSILONS) + 0.15 * np.mean([0.05, 0.5]), np.mean([0.05, 0.5])
    assert prediction.reach(plan, seen, 1)[0, 0, 1] == pytest.approx(random / 4 + 0.05 * (1 - other))
    gone = dataclasses.replace(seen, gone=np.array([[True]]))
    assert prediction.reach(plan, gone, 1)[0, 0, 1] == 0.0
    assert caregiver.hazard_distances(gone)[0, 0, 1] == np.inf

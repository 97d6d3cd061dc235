"""The score of an episode: expected values by hand in small houses, or from other seeds."""

import numpy as np
import pandas as pd
import pytest

from caregiver_mj import FloorPlan, load, tasks
from caregiver_mj.children.behaviour import Behaviour
from caregiver_mj.children.child_group import ChildGroup, parts_of, side_by_side
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.score import Scorer, expected_damage, robot_harm, score, with_costs
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.statistics import comparison_rows
from caregiver_mj.grid.world import run_episodes

PAPER = FloorPlan.load("paper")
STAIRS = FloorPlan.parse("#####\n#S.B#\n#####", "stairs")
SAFE = FloorPlan.parse("#####\n#T.B#\n#####", "safe")
WEST = 3


class West(Behaviour):
    """Always moves west, and counts its moves, so that a test sees whether somebody else has used it."""

    def __init__(self, plan, epsilon=0.5):
        super().__init__(plan, epsilon)
        self.moves = 0

    def reset(self, batch):
        self.moves = 0

    def act(self, sight, draws):
        self.moves += 1
        return np.full(len(sight.cell), WEST)


class NoCopy(West):
    def __deepcopy__(self, memo):
        raise TypeError("of no copies")


def measured(damage=0.0, strikes=0, dropped=0):
    return {"damage": damage, "strikes": strikes, "candles_dropped": dropped}


def test_alone_is_0_bare_tables_only_1_and_robot_harm_is_taken_off():
    np.testing.assert_allclose(score(np.array([50.0, 10.0, 30.0, 90.0]), 50, 10), [0, 1, 0.5, -1])
    assert score(10, 50, 10, 20).item() == 0.5
    assert np.isnan(score(3, 10, 10))
    assert score([1.0, 3.0], 5, 1).mean() == score(2.0, 5, 1)  # it is the score of the mean


def test_a_strike_costs_the_lightest_collision_and_a_drop_the_worst_thing_on_a_table():
    assert robot_harm(PAPER, measured(strikes=3, dropped=2)) == 3 * 1 + 2 * 4
    dear = FloorPlan.load("paper", damage="table=2,candle=7")
    assert robot_harm(dear, measured(strikes=3, dropped=2)) == 3 * 2 + 2 * 7
    nothing = FloorPlan.load("paper", damage="stairwell=0,candle=0,table=0,gate=0,mug=0,battery=0")
    assert robot_harm(nothing, measured(strikes=3, dropped=2)) == 0


def test_a_child_of_ones_own_falls_down_the_stairs_in_every_timestep():
    child = West(STAIRS)
    child.moves = 17
    found = expected_damage(STAIRS, ChildGroup.of(child))
    np.testing.assert_array_equal(found.none, 5.0 * np.arange(201))
    np.testing.assert_array_equal(found.bare_tables, np.zeros(201))
    assert child.moves == 17
    scorer = Scorer(STAIRS, ChildGroup.of(child))
    assert scorer(10, measured(25.0)).item() == 0.5
    assert scorer(400, measured(500.0, strikes=100)).item() == pytest.approx(0.7)  # of 2000


def test_where_nothing_can_be_prevented_there_is_no_score():
    assert np.isnan(Scorer(SAFE, ChildGroup.of(West(SAFE)))(10, measured(10.0))).all()
    assert np.isnan(Scorer(PAPER, ChildGroup.of(0))(200, measured())).all()  # who bumps into nothing


def test_children_that_cannot_be_copied_have_no_score_and_a_warning():
    scorer = Scorer(STAIRS, ChildGroup.of(NoCopy(STAIRS)))
    with pytest.warns(UserWarning, match="there is no score with children"):
        assert np.isnan(scorer(10, measured())).all()


def test_expected_damage_is_that_of_other_episodes():
    damage = run_episodes(PAPER, 0.5, None, range(10_000, 10_500)).damage
    found = expected_damage(PAPER, ChildGroup.of(0.5))
    assert found.none[-1] == pytest.approx(damage.mean(), abs=5 * damage.std() / np.sqrt(500))
    assert 0 < found.bare_tables[-1] < 0.3 * found.none[-1]
    assert (np.diff(found.none) >= 0).all()


def test_families_side_by_side_have_each_its_own():
    both = side_by_side(STAIRS, [ChildGroup.of(1), ChildGroup.of(West(STAIRS))], 2)
    assert [size for _, size in parts_of(both)] == [2, 2]
    alone = [expected_damage(STAIRS, family).none[-1] for family in (ChildGroup.of(1), ChildGroup.of(West(STAIRS)))]
    np.testing.assert_array_equal(Scorer(STAIRS, both).expected.none[-1], np.repeat(alone, 2))


def test_the_front_door_adds_the_score_to_the_outcome():
    options = {"house": STAIRS, "epsilon": 1, "random": 0, "task_kwargs": {"robot": False}}
    env, plain = load("supervise", **options), tasks.load("supervise", **options)
    for one in (env, plain):
        one.reset()
        for _ in range(5 * 84):
            one.step(np.zeros(one.action_spec().shape))
    outcome = env.task.outcome()
    alone = expected_damage(STAIRS, ChildGroup.of(1)).none[5]
    assert outcome.pop("score") == pytest.approx((alone - outcome["damage"]) / alone)
    assert outcome == plain.task.outcome()


def test_bare_tables_are_reckoned_from_episodes_without_a_caregiver():
    settings = Settings(PAPER, "grid", ("none", "floor"), (1, "toddler:0.5", "explorer:0.5,0.5"), episodes=5)
    result = evaluate(settings)
    costs = with_costs(result.episodes, settings.plans)
    none, bare_tables = (costs[costs.caregiver == name] for name in settings.caregivers)
    np.testing.assert_allclose(none.damage.to_numpy() - none.preventable, bare_tables.damage.to_numpy())
    assert [row["score"] for row in result.summary["comparisons"]] == pytest.approx([1, 1, 1])


def rows_of(caregiver, **columns):
    return pd.DataFrame({
        "world": "house", "house": "paper", "caregiver": caregiver, "family": "1", "epsilon": 1.0, "episode": range(4),
        "toys_reached": 1, "strikes": 0, "candles_dropped": 0, "damage_mug": 0.0,
    } | columns)  # fmt: skip


def test_the_score_of_a_table_by_hand():
    # Alone: 4 candles are 16, and 4 with all tables bare; 20 of 24 by stairs and 2 tables: 17 preventable on average.
    none = rows_of("none", damage=[16.0, 20, 24, 12], damage_candle=[16.0, 0, 0, 0], damage_table=[0.0, 0, 4, 0])
    ours = rows_of("ours", damage=[4.0, 4, 4, 4], damage_candle=0.0, damage_table=4.0, strikes=[0, 3, 0, 0])
    ours = ours.assign(candles_dropped=[1, 0, 0, 1])
    costs = with_costs(pd.concat([none, ours], ignore_index=True), [PAPER])
    assert costs.preventable.tolist() == [12, 20, 20, 12, 0, 0, 0, 0]
    assert costs.all_harm.tolist() == [16, 20, 24, 12, 4 + 4, 4 + 3, 4, 4 + 4]
    (row,) = comparison_rows(costs, "ours", "none")
    assert row["score"] == pytest.approx((8 + 13 + 20 + 4) / (12 + 20 + 20 + 12))
    assert row["score_ci_low"] < row["score"] < row["score_ci_high"]
    (bad,) = comparison_rows(costs.assign(all_harm=costs.all_harm * 3), "ours", "none")
    assert bad["score"] == pytest.approx((-8 - 1 + 12 - 12) / 64)  # below 0: worse than nobody
    assert bad["score_ci_low"] < 0
    assert "score" not in comparison_rows(costs, "none", "ours")[0]


def test_tables_without_a_score():
    dear = FloorPlan.load("paper", damage="candle=0")  # bumps into these leave no trace
    for damage, plan in ((0.0, PAPER), (8.0, dear)):
        none, ours = (rows_of(n, damage=damage, damage_candle=0.0, damage_table=0.0) for n in ("none", "ours"))
        assert comparison_rows(with_costs(pd.concat([none, ours]), [plan]), "ours", "none")[0]["score"] is None
    (row,) = comparison_rows(
        with_costs(pd.concat([none, ours]), [FloorPlan.load("paper", damage="mug=0")]), "ours", "none"
    )
    assert row["score"] == 0  # there is no mug
    older = pd.concat([none, ours]).drop(columns="strikes")
    assert "score" not in comparison_rows(with_costs(older, [PAPER]), "ours", "none")[0]

"""Several children in the house: what they cost, and who waits for whom."""

import numpy as np
import pytest
from scripted_child import EAST, SOUTH, STAY, Scripted

from caregiver_mj import FloorPlan, load
from caregiver_mj.plans.hazards import DamageWeights

MOVE = 84  # control steps of a novice timestep


def timesteps(env, count=1):
    action = np.zeros(0)
    if env.task.has_robot:
        action = np.array([0, 0, 0, *env.physics.arm_position(), 0.03])
    return [env.step(action).reward for _ in range(count * MOVE)]


#                         the stairwell's landing is south of (1, 3), a table south of (1, 5), a candle's of (1, 1)
ROW = FloorPlan.parse("########\n#.....B#\n#C#S#T##\n########", "row")


def row(*moves, damage=DamageWeights(), robot=False):
    """Children in the cells of a row above things to bump into, with the moves that they make."""
    plan = FloorPlan.parse("\n".join(ROW.rows), damage=damage)
    env = load("supervise", plan, [Scripted(plan, move) for _, move in moves], 0, {"robot": robot})
    env.reset()
    for child, (column, _) in zip(env.task.children, moves, strict=True):
        child.put((1, column))
    return env


@pytest.mark.parametrize(
    ("damage", "rewards"),
    [
        (DamageWeights(), {1.0, 1 - 4 / 5}),  # the worst of both: the candle's 4
        (DamageWeights(8.0, 2.0, 4.0), {1.0, 1 - 2 / 8, 1 - 4 / 8}),  # the candle first, or the table
        (DamageWeights(0.0, 0.0, 0.0), {1.0}),
    ],
)
def test_reward_is_less_by_the_worst_harm_of_any_child_now(damage, rewards):
    env = row((1, SOUTH), (5, SOUTH), damage=damage)
    seen = timesteps(env)
    assert set(seen) <= rewards | {1 - 1 / 5}
    assert min(seen) == min(rewards)
    assert seen[-1] == 1.0  # booked
    assert seen[0] == 1.0


def test_who_waits_for_another_is_not_hurt_and_not_blocked():
    env = row((2, EAST), (3, STAY), robot=True)
    env.physics.set_robot(np.array([*ROW.position((1, 5)), 0.0]))
    timesteps(env, 3)
    outcome = env.task.outcome()
    assert outcome["damage"] == outcome["moves_blocked"] == outcome["strikes"] == 0
    assert [child.cell for child in env.task.children] == [ROW.cell_index[1, 2], ROW.cell_index[1, 3]]
    assert outcome["cells_visited"] >= 2

"""What every robot must do in the house: take a candle or a mug from table to table."""

import numpy as np
import pytest

from caregiver_mj import CaregiverPolicy, FloorPlan, load
from caregiver_mj.robot.embodiments import EMBODIMENTS
from studies.audit import each_physics_step

SMALL = FloorPlan.parse("#######\n#B....#\n#..C..#\n#.....#\n#.S..T#\n#######", "small")
TABLE_TOP = 0.60  # metres


@pytest.fixture(scope="module", params=tuple(EMBODIMENTS))
def env(request):
    return load("relocate_candle", SMALL, 0.5, random=3, task_kwargs={"embodiment": request.param})


@pytest.mark.parametrize("symbol", ["C", "M"])
def test_candles_and_mugs_are_taken_from_table_to_table(env, symbol):
    """Judged by the physics: it stands upright on the right table, let go, and nobody was struck."""
    if symbol != "C":
        house, kwargs = FloorPlan.parse(SMALL.text.replace("C", symbol)), {"embodiment": env.task.embodiment}
        env = load("relocate_candle", house, 0.5, random=2, task_kwargs=kwargs, visuals=False)
    policy = CaregiverPolicy(env)
    step, physics, task = env.reset(), env.physics, env.task
    velocities = [physics.arm_velocity()]
    with each_physics_step(physics, lambda: velocities.append(physics.arm_velocity())):
        while not policy.executive.done:
            step = env.step(policy(step))
            assert not step.last(), policy.activity
        for _ in range(50):
            step = env.step(policy(step))
    most = np.abs(np.diff(velocities, axis=0)).max(axis=0) / physics.timestep()
    assert (most < task.embodiment.limits.arm.acceleration).all()
    place = physics.candle_poses()[task.goal_candle, :3]
    np.testing.assert_allclose(place, [*task.table_positions[task.goal_table], TABLE_TOP], atol=0.01)
    assert physics.candle_upright()[task.goal_candle] > np.cos(np.radians(2.0))
    assert not physics.is_gripping()
    assert task.outcome()["strikes"] == task.outcome()["candles_dropped"] == 0

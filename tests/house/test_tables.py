"""Tables that are higher or lower than that of the model."""

import numpy as np
import pytest

from caregiver_mj import FloorPlan, load
from caregiver_mj.house.robot_body import TargetRamp

PLAN = FloorPlan.load("paper")
TABLES = len(PLAN.tables)


def test_candles_stand_on_tables_of_any_height_and_the_heights_are_seen():
    env = load("supervise", PLAN, random=1, task_kwargs={"table_height": (0.45, 0.75)}, visuals=False)
    observation, task = env.reset().observation, env.task
    assert (observation["table_height"] == task.table_heights).all()
    assert len(set(task.table_heights)) == TABLES
    assert ((task.table_heights > 0.45) & (task.table_heights < 0.75)).all()
    on = task.candles.starting_tables
    assert observation["candle_position"][:, 2] == pytest.approx(task.table_heights[on])
    for _ in range(25):
        env.step(np.zeros(env.action_spec().shape))
    assert task.candles.standing(env.physics).all()
    assert all(task.candles.are_on(env.physics, table).any() for table in on)
    assert env.physics.candle_poses()[:, 2] == pytest.approx(task.table_heights[on], abs=1e-3)


# Targets made smooth over the physics steps: on the line, half a timestep later, and there in the end.
STEPS = 4
LATE = (STEPS - 1) / 2  # physics steps


def follow(ramp: TargetRamp, controls: np.ndarray, targets: np.ndarray, steps: int = STEPS) -> np.ndarray:
    """What the actuators are told at every physics step, of targets (n, actuators)."""
    found = []
    for target in targets:
        ramp.lead_to(target, steps)
        for _ in range(steps):
            ramp.advance()
            found.append(controls.copy())
    return np.array(found)


def test_targets_on_a_parabola_are_followed_with_a_slope_that_has_no_corners():
    controls = np.zeros(2)
    ends = np.arange(1, 30) * STEPS
    found = follow(TargetRamp(controls), controls, np.stack([ends, ends**2], axis=1))
    steps = np.arange(1, len(found) + 1)
    line, parabola = found[2 * STEPS :].T
    np.testing.assert_allclose(line, steps[2 * STEPS :] - LATE)
    # A parabola's chords, averaged, are everywhere as far off it.
    off = parabola - (steps[2 * STEPS :] - LATE) ** 2
    np.testing.assert_allclose(off, off[0])
    np.testing.assert_allclose(np.diff(parabola, 2), 2.0)

"""Targets made smooth over the physics steps: on the line, half a timestep later, and there in the end."""

import numpy as np
import pytest

from caregiver_mj.house.robot_body import TargetRamp

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


def test_without_new_targets_they_are_reached_and_kept():
    controls = np.array([1.0, -1.0])
    ramp = TargetRamp(controls)
    follow(ramp, controls, np.array([[2.0, -1.0]]))
    assert 1.0 < controls[0] < 2.0
    for _ in range(STEPS):
        ramp.advance()
    for _ in range(STEPS):
        np.testing.assert_array_equal(controls, [2.0, -1.0])
        ramp.advance()


def test_a_target_for_one_step_is_there_at_once():
    controls = np.zeros(1)
    ramp = TargetRamp(controls)
    follow(ramp, controls, np.array([[1.0], [3.0]]))
    ramp.lead_to(np.array([0.5]), 1)
    np.testing.assert_array_equal(controls, [0.5])
    ramp.advance()
    np.testing.assert_array_equal(controls, [0.5])


@pytest.mark.parametrize("after", [1, 3, 4])
def test_a_copy_with_its_state_goes_on_alike(after):
    controls, others = np.zeros((2, 1))
    ramp, other = TargetRamp(controls), TargetRamp(others)
    ramp.lead_to(np.array([1.0]), STEPS)
    for _ in range(after):
        ramp.advance()
    others[:], other.state = controls, ramp.state
    for _ in range(STEPS):
        ramp.advance()
        other.advance()
        np.testing.assert_array_equal(others, controls)

"""Targets that come once a control timestep, made smooth over the physics steps in between."""

from __future__ import annotations

import numpy as np

RampState = tuple[np.ndarray, int, int]


class TargetRamp:
    """What actuators are told at every physics step, from targets that come more seldom.

    As the controllers of real drives do, which interpolate between the positions that they are sent. A straight line
    from one target to the next has corners, and a servo jolts at each; so the line is averaged over as many steps as
    there are between two targets, and its slope changes evenly. That is later than the line by half as many steps but
    one half, and after the last step the targets are reached in as many more.
    """

    def __init__(self, controls: np.ndarray):
        """Prepares it.

        Args:
            controls: What the actuators are told now, (actuators,): the simulation's own array, which it writes.
        """
        self._controls = controls
        self._last, self._next, self._way, self._slope, self._bend = np.zeros((5, len(controls)))
        self.rest()

    def rest(self) -> None:
        """Begins anew, with what the actuators are told now."""
        self._last[:] = self._next[:] = self._controls
        self._way[:] = 0.0
        self._steps, self._left = 1, 0

    @property
    def state(self) -> RampState:
        """All that it goes on from, besides the controls: for a copy of it, which is set to the same."""
        return np.array([self._last, self._next, self._way, self._slope, self._bend]), self._steps, self._left

    @state.setter
    def state(self, state: RampState) -> None:
        rows, self._steps, self._left = state
        self._last[:], self._next[:], self._way[:], self._slope[:], self._bend[:] = rows

    def lead_to(self, targets: np.ndarray, steps: int) -> None:
        """Sets the next targets, (actuators,), to be in force for so many steps; at once for one."""
        if steps == 1:
            self._controls[:] = targets
            self.rest()
            return
        self._last, self._next = self._next, self._last
        self._next[:] = targets
        self._begin(steps)

    def advance(self) -> None:
        """Goes on by one physics step: call before every one."""
        if self._left == 0:
            if not self._way.any():
                return
            self._last[:] = self._next  # nothing new has come: get there
            self._begin(self._steps)
        self._left -= 1
        self._slope += self._bend
        self._controls += self._slope

    def _begin(self, steps: int) -> None:
        """Begins the line from the last targets to the next ones."""
        self._steps = self._left = steps
        # Where the mean has got to on the line before; not from where it is, so that no rounding adds up.
        np.multiply(self._way, -(steps - 1) / (2 * steps), out=self._controls)
        self._controls += self._last
        np.divide(self._way, steps, out=self._slope)
        np.subtract(self._next, self._last, out=self._way)
        np.divide(self._way, steps, out=self._bend)
        self._bend -= self._slope
        self._bend /= steps

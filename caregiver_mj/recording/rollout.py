"""Episodes that run step by step, in either world, and their observers."""

from __future__ import annotations

import abc
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from caregiver_mj.recording.ledger import Ledger


class Rollout(abc.ABC):
    """Running episodes: one in the house, a batch in the grid.

    `run_on` is the only loop over an episode. Data sets and logs of answers observe it, films and viewers run it from
    picture to picture, and Gymnasium environments, whose actions come from outside, drive it step by step.

    Attributes:
        observers: Called with the rollout at the start and after every step. They must change nothing.
        ledger: Counts what happens to the children.
    """

    observers: Sequence[Callable[[Any], None]] = ()
    ledger: Ledger

    @property
    @abc.abstractmethod
    def over(self) -> bool:
        """Whether its episodes are over."""

    @abc.abstractmethod
    def step(self) -> None:
        """Run one step: a control step in the house, a novice timestep in the grid."""

    @abc.abstractmethod
    def outcomes(self) -> list[dict[str, Any]]:
        """Return the measures of each episode, by column."""

    def notify(self) -> None:
        """Call the observers."""
        for observer in self.observers:
            observer(self)

    def run_on(self, until: Callable[[], bool] = lambda: False) -> bool:
        """Run until a condition holds; return False if the episodes end before."""
        while not until():
            if self.over:
                return False
            self.step()
            self.notify()
        return True

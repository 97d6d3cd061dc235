"""Episodes that run step by step, in either world, and those who observe them."""

from __future__ import annotations

import abc
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from caregiver_mj.recording.ledger import Ledger


class Rollout(abc.ABC):
    """Episodes under way: one in the house, a batch of them in the grid.

    `run_on` is the only loop over an episode. Data sets and logs of answers observe it, films and viewers run it on
    from picture to picture, and an environment of Gymnasium, whose actions come from outside, drives it step by step.

    Attributes:
        observers: Called with it when its episode has begun, and after every step. They change nothing.
        ledger: What has happened to the children.
    """

    observers: Sequence[Callable[[Any], None]] = ()
    ledger: Ledger

    @property
    @abc.abstractmethod
    def over(self) -> bool:
        """Whether its episodes are over."""

    @abc.abstractmethod
    def step(self) -> None:
        """Run one step: of control in the house, a timestep in the grid."""

    @abc.abstractmethod
    def outcomes(self) -> list[dict[str, Any]]:
        """Return what is measured of each episode, by column."""

    def notify(self) -> None:
        """Call the observers."""
        for observer in self.observers:
            observer(self)

    def run_on(self, until: Callable[[], bool] = lambda: False) -> bool:
        """Run on until a condition holds, and return whether it does: the episodes may be over before."""
        while not until():
            if self.over:
                return False
            self.step()
            self.notify()
        return True

"""How a skill fares."""

from __future__ import annotations

import enum


class Status(enum.Enum):
    """What one step of a skill has come to."""

    RUNNING = enum.auto()  # and another skill may take over now
    COMMITTED = enum.auto()  # running, and must not be interrupted now
    DONE = enum.auto()
    FAILED = enum.auto()
    OUT_OF_REACH = enum.auto()  # failed, because there is no way to get at the thing
    OVERTAKEN = enum.auto()  # the world has changed, and its aim with it

    @property
    def ended(self) -> bool:
        """Whether there is nothing left to do."""
        return self not in (Status.RUNNING, Status.COMMITTED)

    @property
    def interruptible(self) -> bool:
        """Whether another skill may take over now."""
        return self is not Status.COMMITTED

    @property
    def failed(self) -> bool:
        """Whether it has ended without having achieved what it is for, although that is still to be done."""
        return self in (Status.FAILED, Status.OUT_OF_REACH)

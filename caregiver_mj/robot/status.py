"""How a skill fares."""

from __future__ import annotations

import dataclasses
from typing import ClassVar


@dataclasses.dataclass(frozen=True, eq=False)
class Status:
    """What one step of a skill has come to: one of the six constants, and nothing else.

    They are plain attributes and no enumeration, whose members Python 3.11 looks up so slowly that it showed in the
    closed loop.
    """

    name: str  #: that of the constant
    ended: bool = True  #: whether there is nothing left to do
    interruptible: bool = True  #: whether another skill may take over now
    #: whether it has ended without having achieved what it is for, although that is still to be done
    failed: bool = False

    RUNNING: ClassVar[Status]  # and another skill may take over now
    COMMITTED: ClassVar[Status]  # running, and must not be interrupted now
    DONE: ClassVar[Status]
    FAILED: ClassVar[Status]
    OUT_OF_REACH: ClassVar[Status]  # failed, because there is no way to get at the thing
    OVERTAKEN: ClassVar[Status]  # the world has changed, and its aim with it


Status.RUNNING = Status("RUNNING", ended=False)
Status.COMMITTED = Status("COMMITTED", ended=False, interruptible=False)
Status.DONE = Status("DONE")
Status.FAILED = Status("FAILED", failed=True)
Status.OUT_OF_REACH = Status("OUT_OF_REACH", failed=True)
Status.OVERTAKEN = Status("OVERTAKEN")

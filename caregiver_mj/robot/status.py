"""Status of a skill."""

from __future__ import annotations

import dataclasses
from typing import ClassVar


@dataclasses.dataclass(frozen=True, eq=False)
class Status:
    """Result of a step of a skill: one of the six constants.

    They are plain attributes: Python 3.11 looks up members of enumerations so slowly that it showed in the closed loop.
    """

    name: str  #: name of the constant
    ended: bool = True  #: whether the skill has ended
    interruptible: bool = True  #: whether another skill may take over now
    #: whether it has ended without success, with its task still to be done
    failed: bool = False

    RUNNING: ClassVar[Status]  # interruptible
    COMMITTED: ClassVar[Status]  # running, not interruptible now
    DONE: ClassVar[Status]
    FAILED: ClassVar[Status]
    OUT_OF_REACH: ClassVar[Status]  # failed: the thing cannot be reached
    OVERTAKEN: ClassVar[Status]  # its task is obsolete, because the world has changed


Status.RUNNING = Status("RUNNING", ended=False)
Status.COMMITTED = Status("COMMITTED", ended=False, interruptible=False)
Status.DONE = Status("DONE")
Status.FAILED = Status("FAILED", failed=True)
Status.OUT_OF_REACH = Status("OUT_OF_REACH", failed=True)
Status.OVERTAKEN = Status("OVERTAKEN")

"""How long the robot tries to get somewhere."""

from __future__ import annotations

import math

# Seconds without coming nearer after which it gives up: six steps of a toddler. One that only goes by is gone sooner,
# and no detour in a house takes as long.
TIME_OUT = 10.0


class Patience:
    """Lasts as long as the base comes nearer to where it shall stand than it has ever been: so it comes to an end."""

    def __init__(self) -> None:
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forgets how near it has come, because the way leads somewhere else now."""
        self._nearest = self._deadline = math.inf

    def note(self, left: int, now: float) -> None:
        """Takes in how long the rest of the way is, in cells, at a time in seconds."""
        if left < self._nearest:
            self._nearest, self._deadline = left, now + TIME_OUT

    def last_for_ever(self) -> None:
        """Has it never end, unless the base comes still nearer."""
        self._deadline = math.inf

    def is_over(self, now: float, seconds: float = 0.0) -> bool:
        """Whether it has waited long enough, and so many seconds more."""
        return now > self._deadline + seconds

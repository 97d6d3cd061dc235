"""The robot's contacts with one child: when they begin and end, how hard and how fast they are."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from operator import attrgetter

from caregiver_mj.house.touch import Touch
from caregiver_mj.recording.contacts import PRESSING, STRIKE_PAUSE, STRIKE_SPEED, Contacts, region_at

_APART = 0.1  # seconds without touch that end a contact: one that lasts flickers as the two give way to each other


class ContactWatch:
    """Watches the contacts of one child with the robot.

    They are read from the simulation at every physics step. What has no time or no extent of its own, such as a
    strike, is booked once: a strike again after half a second, a pressing when the contact has lasted for that long.
    """

    def __init__(self) -> None:
        self._touched_at = self._struck_at = -math.inf
        self._lasted = 0.0

    def take_in(self, touches: Iterable[Touch], seconds: float, tally: Contacts) -> None:
        """Takes in the child's contacts of a control timestep.

        Args:
            touches: All of them, in the order in which they came.
            seconds: Of a physics step.
            tally: What is counted.
        """
        robot = (touch for touch in touches if touch.kind == "robot")
        for time, together in itertools.groupby(robot, key=attrgetter("time")):
            self._step(time, list(together), seconds, tally)

    def _step(self, time: float, touches: list[Touch], seconds: float, tally: Contacts) -> None:
        """Takes in those of one physics step."""
        begins = time - self._touched_at > _APART
        if begins:
            self._lasted = 0.0
        self._touched_at = time
        before, self._lasted = self._lasted, self._lasted + seconds
        tally.pressings += before < PRESSING - seconds / 2 <= self._lasted  # half a step for what rounding adds up to
        forces: dict[str, float] = {}
        for touch in touches:
            region = region_at(touch.height)
            forces[region] = forces.get(region, 0.0) + touch.force
        tally.press(forces, seconds)
        # At first the surface is as fast as it has come. Then the child pushes it, which is not the robot's doing.
        speed = max(
            touch.surface_speed if begins else min(touch.surface_speed, touch.driven_speed) for touch in touches
        )
        tally.contact_speed = max(tally.contact_speed, speed)
        if speed > STRIKE_SPEED and time - self._struck_at > STRIKE_PAUSE:
            tally.strikes_surface += 1
            self._struck_at = time

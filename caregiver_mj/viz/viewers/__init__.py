"""Viewers, and the session that they show: an episode with controls for speed, pause, steps and the next episode.

A session is independent of windows and browsers, and must be called from one thread.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import time
from collections.abc import Callable
from typing import Any

from caregiver_mj.caregivers.registry import DRIVER, PERSON
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.viz.episode import Episode

KEYS = "0123456789ABCDEFGHIJKLM"  # a player's keys: for no target, then for the hazards in order
SLOWEST, FASTEST = 0.1, 20.0  # simulated seconds per second
_LONGEST = 0.25  # s; greatest duration of a call, and of a break to catch up on
_PIECE = 0.1  # simulated s between looks at the clock
_episode = functools.partial(Episode, foresees=True)


class Session:
    """An episode in a viewer.

    Attributes:
        spec: Its specification.
        episode: The episode.
        playing: Whether it runs.
        over: Whether it has ended.
        behind: Whether this machine is too slow for the requested speed.
    """

    def __init__(
        self,
        spec: EpisodeSpec,
        *,
        speed: float = 1.0,
        playing: bool = True,
        begin: Callable[[EpisodeSpec], Episode] = _episode,
        ended: Callable[[EpisodeSpec, Episode], None] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ):
        """Begin an episode at a speed, simulated seconds per second.

        `begin` makes an episode of a specification; `ended` is called with specification and episode at the end.

        Raises:
            CaregiverError: The specification is invalid, or the speed is out of range.
        """
        self._make, self._clock, self._ended, self._queries = begin, clock, ended, spec.queries
        self.speed, self.playing, self.over = speed, playing, False
        self._until: float
        self._begin(spec)

    @property
    def speed(self) -> float:
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        if not (math.isfinite(speed) and SLOWEST <= speed <= FASTEST):
            raise CaregiverError(f"speed must be in {SLOWEST:g} to {FASTEST:g}, got {speed:g}")
        self._speed = float(speed)

    def hurry(self, times: float) -> None:
        """Multiply the speed, within its range."""
        self.speed = min(max(times * self.speed, SLOWEST), FASTEST)

    def skip_time(self) -> None:
        """Ignore the time since the last call of `advance`."""
        self._last = self._clock()

    def toggle(self) -> None:
        """Pause or continue."""
        self.skip_time()
        self.playing = not self.playing and not self.over

    def step(self, seconds: float | None = None) -> None:
        """Pause, and run on for some simulated seconds, by default one control step."""
        self.playing = False
        env = self.episode.env
        self._run_until(self.episode.seconds + (env.control_timestep() if seconds is None else seconds))

    def next_move(self) -> None:
        """Pause, and run on to the children's next moves."""
        move = self.episode.env.task.novice_timestep
        self.step((math.floor(self.episode.seconds / move + 1e-6) + 1) * move - self.episode.seconds)

    @property
    def targets(self) -> list[tuple[str, str, str]]:
        """The player's choices, first that of nothing: key, name, and mark of the present one."""
        policy: Any = self.episode.policy
        if self.spec.caregiver == DRIVER:
            return list(policy.policy.keys)
        if self.spec.caregiver != PERSON:
            return []
        names = "nothing more", *map(str, policy.plan.hazards)
        chosen = int(policy.caregiver.targets[0])
        # A choice waits for the robot's next decision, or while nothing can be done about the hazard.
        mark = "<" if chosen in (NOTHING, policy.target) else "< waits"
        choices = enumerate(zip(KEYS, names, strict=False), NOTHING)
        return [(key, name, mark if number == chosen else "") for number, (key, name) in choices]

    def choose(self, key: str) -> None:
        """Apply a player's key, from the next decision on; other keys do nothing."""
        policy: Any = self.episode.policy
        if self.spec.caregiver == DRIVER:
            policy.policy.press(key)
        elif 0 <= (number := KEYS.find(key)) < len(self.targets):
            policy.caregiver.targets[:] = number + NOTHING

    def change(self, **fields: object) -> None:
        """Begin another episode, with some fields of the specification changed.

        Raises:
            CaregiverError: The specification is invalid; the present episode continues.
        """
        fields.setdefault("queries", self._queries)  # kept while a caregiver without queries acts
        self._begin(dataclasses.replace(self.spec, **fields))  # type: ignore[arg-type]  # checked by `EpisodeSpec`

    def advance(self) -> None:
        """Run on for the time since the last call, at the requested speed."""
        now = self._clock()
        passed, self._last = now - self._last, now
        self.behind = self.playing and passed > _LONGEST
        if not self.playing:
            return
        self._until += min(passed, _LONGEST) * self.speed
        while self.playing and self.episode.seconds + _PIECE < self._until:
            self._run_until(self.episode.seconds + _PIECE, keep=True)
            if self._clock() - now > _LONGEST:
                self.behind = True
                self._until = self.episode.seconds
        self._run_until(self._until, keep=True)

    def _run_until(self, seconds: float, keep: bool = False) -> None:
        if not self.episode.run_until(seconds):
            self.playing, over, self.over = False, self.over, True
            if self._ended and not over:
                self._ended(self.spec, self.episode)
        if not keep:
            self._until = self.episode.seconds

    def _begin(self, spec: EpisodeSpec) -> None:
        episode = self._make(spec)
        episode.run_until(0.0)  # adds the first look at the children
        self.spec, self.episode = spec, episode
        self.playing = self.playing or self.over  # the end of the last one paused it, not the user
        self.over = self.behind = False
        self._until, self._last = 0.0, self._clock()

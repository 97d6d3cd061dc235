"""A session: an episode that runs at the speed one likes, pauses, goes on by steps, and is exchanged for another.

It knows nothing of windows and browsers, nor of threads: whoever shows it calls it from one.
"""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable
from typing import Any

from caregiver_mj.caregivers.registry import DRIVER, PERSON
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.viz.episode import Episode

KEYS = "0123456789ABCDEFGHIJKLM"  # of a person: for nothing more, and for the hazards in their order
SLOWEST, FASTEST = 0.1, 20.0  # times the speed of the simulated world
_LONGEST = 0.25  # seconds that one call may take, and that are made up for after a longer break
_PIECE = 0.1  # seconds of the simulated world between looks at the clock


def begin(spec: EpisodeSpec) -> Episode:
    """Begin an episode, with what the caregiver thinks may be coming where it thinks of that: not every one does.

    Raises:
        CaregiverError: There can be no such episode.
    """
    episode = Episode(spec)
    episode.foresees = True
    return episode


class Session:
    """An episode that is watched.

    Attributes:
        spec: Which one it is.
        episode: It itself.
        playing: Whether it runs.
        over: Whether it has come to its end.
        behind: Whether this machine is too slow for the speed that was asked for.
        begun: How many episodes have been begun.
    """

    def __init__(
        self,
        spec: EpisodeSpec,
        *,
        speed: float = 1.0,
        playing: bool = True,
        begin: Callable[[EpisodeSpec], Episode] = begin,
        ended: Callable[[EpisodeSpec, Episode], None] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ):
        """Begin an episode, `speed` seconds of which pass in one of the `clock`; `ended` is told of each that is over.

        Raises:
            CaregiverError: There can be no such episode, or the speed is out of range.
        """
        self._make, self._clock, self._ended, self._queries = begin, clock, ended, spec.queries
        self.speed = speed
        self.playing = playing
        self.over = False
        self.begun = 0
        self._until: float
        self._begin(spec)

    # -- What one can do -------------------------------------------------------------------------

    @property
    def speed(self) -> float:
        """How many seconds of the simulated world pass in one."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        if not (math.isfinite(speed) and SLOWEST <= speed <= FASTEST):
            raise CaregiverError(f"speed must be in {SLOWEST:g} to {FASTEST:g}, got {speed:g}")
        self._speed = float(speed)

    def hurry(self, times: float) -> None:
        """Run so many times as fast, as far as that goes."""
        self.speed = min(max(times * self.speed, SLOWEST), FASTEST)

    def play(self) -> None:
        """Let it run on from here."""
        self.skip_time()
        self.playing = not self.over

    def skip_time(self) -> None:
        """Let the time since the last call of `advance` pass without running on."""
        self._last = self._clock()

    def toggle(self) -> None:
        """Halt it, or let it run on."""
        self.pause() if self.playing else self.play()

    def pause(self) -> None:
        """Halt it."""
        self.playing = False

    def step(self, seconds: float | None = None) -> None:
        """Pause, and run on for so long: one step of control by default."""
        self.pause()
        env = self.episode.env
        self._run_until(self.episode.seconds + (env.control_timestep() if seconds is None else seconds))

    def next_move(self) -> None:
        """Pause, and run on until the children's next moves begin."""
        move = self.episode.env.task.novice_timestep
        self.step((math.floor(self.episode.seconds / move + 1e-6) + 1) * move - self.episode.seconds)

    @property
    def targets(self) -> list[tuple[str, str, str]]:
        """What who plays can choose, first nothing more: its key, its name, and how that fares."""
        policy: Any = self.episode.policy
        if self.spec.caregiver == DRIVER:
            return list(policy.policy.keys)
        if self.spec.caregiver != PERSON:
            return []
        names = "nothing more", *map(str, policy.plan.hazards)
        chosen = int(policy.caregiver.targets[0])
        # It waits until it is asked next, and while nothing can be done about its choice, or nothing is to be gained.
        mark = "<" if chosen in (NOTHING, policy.target) else "< waits"
        choices = enumerate(zip(KEYS, names, strict=False), NOTHING)
        return [(key, name, mark if number == chosen else "") for number, (key, name) in choices]

    def choose(self, key: str) -> None:
        """Have the caregiver of who plays do what a key stands for, from when it is next asked; others do nothing."""
        policy: Any = self.episode.policy
        if self.spec.caregiver == DRIVER:
            policy.policy.press(key)
        elif 0 <= (number := KEYS.find(key)) < len(self.targets):
            policy.caregiver.targets[:] = number + NOTHING

    def restart(self) -> None:
        """Begin the same episode once more."""
        self._begin(self.spec)

    def change(self, **fields: object) -> None:
        """Begin another episode, which differs in some fields of its specification.

        Raises:
            CaregiverError: There can be no such episode; the present one goes on.
        """
        fields.setdefault("queries", self._queries)  # also after a caregiver that asks nobody
        self._begin(dataclasses.replace(self.spec, **fields))  # type: ignore[arg-type]  # `EpisodeSpec` says

    # -- Time ------------------------------------------------------------------------------------

    def advance(self) -> None:
        """Run on for as long as has passed since the last call, at the speed that is asked for."""
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
        episode.run_until(0.0)  # for a first look at the children
        self.spec, self.episode = spec, episode
        self.begun += 1
        self.playing = self.playing or self.over  # the end has stopped the last one, and nobody else
        self.over = self.behind = False
        self._until, self._last = 0.0, self._clock()

"""The viewers' session: play, pause, steps, speed; no window and no browser."""

from types import SimpleNamespace

import pytest

from caregiver_mj.caregivers.server import Queries
from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.viz.viewers import Session

STEP = 0.02  # seconds
MOVE = 1.68


class Clock:
    """A clock that is set by hand."""

    now = 100.0

    def __call__(self):
        return self.now


class Reel:
    """An episode of so many steps in which nothing happens."""

    env = SimpleNamespace(task=SimpleNamespace(novice_timestep=MOVE), control_timestep=lambda: STEP)

    def __init__(self, steps=1000, cost=0.0, clock=None):
        self._steps, self._done, self._cost, self._clock = steps, 0, cost, clock

    @property
    def seconds(self):
        return self._done * STEP

    def run_until(self, seconds):
        while (self._done + 0.5) * STEP < seconds:
            if self._done == self._steps:
                return False
            self._done += 1
            if self._cost:
                self._clock.now += self._cost
        return True


@pytest.fixture
def clock():
    return Clock()


def session(clock, *, steps=1000, cost=0.0, **settings):
    return Session(EpisodeSpec("paper"), begin=lambda spec: Reel(steps, cost, clock), clock=clock, **settings)


def let(watched, clock, seconds, tick=0.05):
    """Calls the session so often for so long."""
    for _ in range(round(seconds / tick)):
        clock.now += tick
        watched.advance()


@pytest.mark.parametrize("speed", [0.1, 0.5, 1.0, 7.0])
def test_it_runs_at_the_speed_that_is_asked_for(clock, speed):
    watched = session(clock, steps=5000, speed=speed)
    let(watched, clock, 2.0)
    assert watched.episode.seconds == pytest.approx(2.0 * speed, abs=STEP)
    assert not watched.behind
    watched.speed = 2 * speed
    let(watched, clock, 1.0)
    assert watched.episode.seconds == pytest.approx(4.0 * speed, abs=STEP)


def test_it_stands_still_while_it_is_paused_and_can_begin_so(clock):
    watched = session(clock)
    let(watched, clock, 1.0)
    watched.toggle()
    let(watched, clock, 5.0)
    assert watched.episode.seconds == pytest.approx(1.0, abs=STEP)
    clock.now += 60.0
    watched.toggle()  # time that passed in between is not made up for
    let(watched, clock, 1.0)
    assert watched.episode.seconds == pytest.approx(2.0, abs=STEP)
    # It can begin paused.
    watched = session(clock, playing=False)
    let(watched, clock, 1.0)
    assert watched.episode.seconds == 0.0


def test_the_end(clock):
    watched = session(clock, steps=10)
    let(watched, clock, 1.0)
    assert watched.over
    assert not watched.playing
    assert watched.episode.seconds == pytest.approx(10 * STEP)
    watched.toggle()
    assert not watched.playing
    watched.change()
    assert watched.playing
    assert not watched.over
    assert watched.episode.seconds == 0.0


def test_a_machine_that_is_too_slow_says_so_and_stays_responsive(clock):
    watched = session(clock, speed=10.0, cost=0.02)  # as fast as the simulated world at best
    clock.now += 0.2
    before = clock.now
    watched.advance()
    assert watched.behind
    assert clock.now - before < 0.5
    after = watched.episode.seconds
    watched.speed = 0.5
    clock.now += 0.1
    watched.advance()
    assert after < watched.episode.seconds < after + 0.25 * 0.5 + STEP  # what was missed is not made up for
    clock.now += 0.1
    watched.advance()
    assert not watched.behind


def test_servers_are_asked_as_at_first_after_another_caregiver(clock):
    """A budget and an address are those of the command, also once a caregiver that asks nobody has been chosen."""
    first = EpisodeSpec("paper", caregiver="chat:m", queries=Queries("http://127.0.0.1:1/v1", max_calls=5))
    one = Session(first, begin=lambda spec: Reel(10, 0.0, clock), clock=clock)
    one.change(caregiver="guard")
    one.change(caregiver="chat:m")
    assert one.spec == first

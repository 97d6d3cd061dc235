"""The benchmark: clocks, an episode on tape, and its sections in small."""

import time

import pytest

from studies.benchmark import Clock, Scene, dissect


def test_a_clock_stands_still_while_another_runs_and_is_taken_off_again():
    outer, inner = Clock(), Clock()
    sleep = inner.around(lambda: time.sleep(0.05))

    def work():
        sleep()
        time.sleep(0.02)

    outer.around(work)()
    assert inner.own >= 0.05
    assert 0.02 <= outer.own < 0.05
    assert outer.times[0] == pytest.approx(outer.own + inner.own)

    # A clock is taken off again.
    class Thing:
        def do(self):
            return 3

    clock, before = Clock(), Thing.do
    with clock.of(Thing, "do"):
        assert Thing().do() == 3
    assert Thing.do is before
    assert len(clock.times) == 1


@pytest.fixture(scope="module")
def scene():
    return Scene("paper", 4.0)


def test_an_episode_from_tape_ends_where_it_ended(scene):
    scene.record()
    seconds, deviation = scene.replay()
    assert seconds > 0.0
    assert deviation == 0.0


def test_the_parts_make_up_the_whole(scene):
    found = dissect(scene)
    assert found["share of the loop"].sum() == pytest.approx(1.0)
    assert found.loc["physics", "calls"] == scene.steps == 200
    assert found["us a control step"].sum() < 1e6

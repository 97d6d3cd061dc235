"""The benchmark: clocks, an episode on tape, and its sections in small."""

import time

import pytest
from rich.console import Console

from studies.benchmark import Clock, Effort, Scene, dissect, hitches, print_parts


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


def test_the_parts_make_up_the_whole(scene, capsys):
    found = dissect(scene)
    assert sum(part["share"] for part in found.values()) == pytest.approx(1.0)
    assert found["physics"]["calls"] == scene.steps == 200
    print_parts(Console(width=120), "paper", found, scene.steps)
    assert "caregiver: a decision" in capsys.readouterr().out


def test_the_worst_control_step_of_each_kind_of_episode(capsys):
    found = hitches(Effort(seconds=1.0, knocked=1), Console(width=120))
    assert set(found) == {"supervise, paper", "supervise, foresight", "candles knocked over"}
    assert all(row["steps"] == 49 * (1 if "knocked" in name else 2) for name, row in found.items())
    assert all(0.0 < row["worst"] < 10.0 for row in found.values())

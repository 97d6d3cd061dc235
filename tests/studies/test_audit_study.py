"""The audit's command: an episode, its log, and the log read again."""

import re

import numpy as np

from studies.audit import Audit, Check, NearChild
from study import main


def test_a_log_read_again_says_the_same(tmp_path, capsys):
    path = str(tmp_path / "log.npz")
    status = main(["audit", "--seconds", "3", "--save", path])
    first = capsys.readouterr().out
    assert "Limits in 3 s: commanded" in first
    assert "arm acceleration, 20 ms" in first
    assert "arm jerk, commanded" in first
    assert main(["audit", "--log", path]) == status
    again = capsys.readouterr().out
    # A log does not know its house, which makes the tables narrower.
    told, expected = (re.sub("─+|,? paper 0", "", text).split() for text in (again, first))
    assert told == expected


def test_of_several_episodes_the_worst_is_told():
    gentle = Audit(10.0, [Check("speed", "m/s", 1.0, 2.0, 3.0)], [], NearChild(0.2, np.inf, 1.5, 0.0), 0.5)
    harsh = Audit(20.0, [Check("speed", "m/s", 3.0, 2.0, 4.0)], [], NearChild(0.4, 0.1, 0.5, 0.02), 0.25)
    both = Audit.worst_of([gentle, harsh])
    assert both == Audit(30.0, harsh.commanded, [], NearChild(0.2, 0.1, 2.0, 0.02), 0.75)

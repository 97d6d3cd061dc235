"""The audit's command: an episode, its log, and the log read again."""

from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.studies import stills
from caregiver_mj.studies.audit import main
from caregiver_mj.tasks import load


def test_a_log_read_again_says_the_same(tmp_path, capsys):
    path = str(tmp_path / "log.npz")
    assert main(["--seconds", "3", "--save", path]) == 0
    first = capsys.readouterr().out
    assert "Limits in 3 s" in first
    assert "arm jerk, commanded" in first
    assert main(["--log", path]) == 0
    assert capsys.readouterr().out == first


def test_nothing_to_take_a_picture_of_at_the_start():
    env = load("supervise", random=3)
    policy = CaregiverPolicy(env)
    env.step(policy(env.reset()))
    assert stills.views(env.physics, policy) == {}

"""The results of the documentation: which runs there are, and what is published of them."""

import pytest

from caregiver_mj import cli
from studies.results import CHILDREN, RUNS, command


@pytest.mark.parametrize("name", [*RUNS, *CHILDREN])
def test_every_run_could_be_run(name, capsys, tmp_path):
    asked = command(tmp_path, name, 2)
    assert asked[0] == "evaluate"
    assert asked[-5:] == ["--jobs", "2", "--out", str(tmp_path / name), "--resume"]
    # All else is checked before the number of episodes is.
    assert cli.main([*asked, "--episodes", "0"]) == 2
    assert "episodes must be an integer of at least 1, got 0" in capsys.readouterr().err
    assert not (tmp_path / name).exists()

"""What studies have in common: commands, pages, and jobs that are kept; and that each explains itself."""

import os

import pytest

import study
from caregiver_mj.errors import CaregiverError
from study import FOLDER, run_all


@pytest.mark.parametrize("name", study.names())
def test_a_study_explains_itself(name, capsys):
    with pytest.raises(SystemExit) as end:
        study.main([name, "--help"])
    assert end.value.code == 0
    told = capsys.readouterr().out
    assert "options:" in told
    assert "--docs" in told or not (FOLDER / f"{name}.md").exists()


def test_bad_input_is_one_line(capsys):
    with pytest.raises(SystemExit) as end:
        study.main(["ablations", "--houses", "nowhere", "--episodes", "1", "--jobs", "1"])
    assert end.value.code == 2
    assert "study.py ablations: error: no floor plan 'nowhere'" in capsys.readouterr().err


def _identify(job):
    return job, os.getpid()


def _count(job):
    with open(job, "a") as file:
        file.write("x")
    return {"length": os.path.getsize(job)}


def test_results_come_in_the_order_of_the_jobs():
    found = run_all(_identify, range(5), 2, "identifying")
    assert [job for job, _ in found] == [0, 1, 2, 3, 4]
    assert os.getpid() not in {process for _, process in found}


def test_jobs_whose_results_are_kept_are_not_run_again(tmp_path):
    jobs = [str(tmp_path / name) for name in "ab"]
    kept = tmp_path / "kept"
    assert run_all(_count, jobs[:1], 1, "counting", kept) == [{"length": 1}]
    assert run_all(_count, jobs, 1, "counting", kept) == [{"length": 1}, {"length": 1}]
    assert run_all(_count, jobs, 1, "counting") == [{"length": 2}, {"length": 2}]
    with pytest.raises(CaregiverError, match="study"):  # not another one's
        run_all(_identify, jobs, 1, "identifying", kept)

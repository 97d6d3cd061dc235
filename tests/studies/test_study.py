"""What studies have in common: commands, pages, jobs that are kept, trials; and that each explains itself."""

import ast
import json
import os
import pathlib
import shlex
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure

import study
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.intervals import Estimate
from study import FOLDER, Page, Parser, fill, interval, listed, run_all, share, side, verdict

SCRIPT = FOLDER.with_name("study.py")


# -- All of them -------------------------------------------------------------------------------------


def private_uses(source):
    """Private attributes of anything but the object itself, and private names from other modules."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Attribute) and not (isinstance(node.value, ast.Name) and node.value.id == "self"):
            found.append(node.attr)
        elif isinstance(node, ast.ImportFrom):
            found += [alias.name for alias in node.names]
    return [name for name in found if name.startswith("_") and not name.endswith("__")]


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_a_study_uses_nothing_private_of_others(path):
    assert private_uses(path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("name", study.names())
def test_a_study_explains_itself(name, capsys):
    with pytest.raises(SystemExit) as end:
        study.main([name, "--help"])
    assert end.value.code == 0
    told = capsys.readouterr().out
    assert "options:" in told
    assert "--docs" in told or not (FOLDER / f"{name}.md").exists()


def test_the_script_lists_the_studies(tmp_path):
    """As somebody starts it, from another folder."""
    helped, wrong = (
        subprocess.run([sys.executable, SCRIPT, word], cwd=tmp_path, capture_output=True, text=True, check=False)
        for word in ("--help", "nothing")
    )
    assert all(f"\n  {name} " in helped.stdout for name in study.names())
    assert (helped.returncode, wrong.returncode) == (0, 2)
    assert "invalid choice: 'nothing'" in wrong.stderr


# -- Commands ----------------------------------------------------------------------------------------


def parser():
    made = Parser("some", "A study.")
    made.add("houses", ["test-20"], "houses")
    made.add("set-episodes", 100, "episodes")
    made.add("quick", False, "less of all")
    made.add("run", [], "runs", type=pathlib.Path)
    made.add_file("out", "a folder", "DIR")
    made.add_trials("count", 500)
    return made


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("", ""),
        ("--houses test-20 --set-episodes 100 --jobs 7 --out somewhere", ""),
        ("--set-episodes 3 --houses a b --quick", " --houses a b --set-episodes 3 --quick"),
        ("--run 'my runs/x' y", " --run 'my runs/x' y"),
        ("--count 3 --json file", " --count 3"),
    ],
)
def test_a_command_says_what_a_page_depends_on(given, said):
    command = parser().command(parser().parse_args(shlex.split(given)))
    assert command == f"python scripts/study.py some{said} --docs docs"
    again = parser().parse_args(shlex.split(said))
    assert parser().command(again) == command


def test_bad_input_is_one_line(capsys):
    with pytest.raises(SystemExit) as end:
        study.main(["several_children", "--house", "nowhere", "--world", "grid", "--episodes", "1", "--jobs", "1"])
    assert end.value.code == 2
    assert "study.py several_children: error: no floor plan 'nowhere'" in capsys.readouterr().err


# -- Pages -------------------------------------------------------------------------------------------


def test_paragraphs_are_filled_and_all_else_stays_as_it_is():
    words = "word-with-hyphens " * 20
    text = fill(f"# A title that stays as it is, however long it may be: {words}\n\n{words}\n\n- {words}\n- {words}\n")
    title, paragraph, items = text.rstrip("\n").split("\n\n")
    assert title.count("\n") == 0
    assert all(len(line) <= 120 for line in (paragraph + "\n" + items).splitlines())
    assert paragraph.split() == words.split()
    assert [line[:6] for line in items.splitlines()] == ["- word", "  word", "  word", "  word"] * 2
    # Tables code and pictures stay as they are.
    text = "| a | b |\n| --- | ---: |\n| x  y | 1 |\n\n    some  command\n\n![A picture](x.png)\n"
    assert fill(text) == text


def test_a_page_is_written_with_its_figures(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "FOLDER", tmp_path)
    (tmp_path / "some.md").write_text(
        "{{ title }}\n\n    {{ command }}\n\n{{ value | interval }}, {{ 1 | form('.0%') }}"
    )
    page = Page({"title": "# T", "value": Estimate(1.0, 0.5, 2.0)}, {"a.png": Figure(), "b.svg": Figure()})
    text = page.text("some", "the command")
    assert text == "# T\n\n    the command\n\n1.00 (0.50 to 2.00), 100%\n"
    page.write(tmp_path / "docs", "some", text)
    assert {path.name for path in (tmp_path / "docs").iterdir()} == {"some.md", "a.png", "b.svg"}
    assert (tmp_path / "docs" / "some.md").read_text() == text


def test_numbers_and_verdicts_as_they_are_told():
    assert interval(Estimate(-0.004, -1.0, 2.0), sign="+") == "+0.00 (-1.00 to +2.00)"
    assert interval(Estimate(0.5, 0.5, 0.5)) == "0.50 (0.50 to 0.50)"
    assert interval(Estimate(0.5, 0.5, 0.5), exact=True) == "0.50"
    assert interval(Estimate(0.5, 0.0, np.inf), 1) == "0.5 (–)"
    assert interval(Estimate(np.nan, np.nan, np.nan)) == "–"
    assert share(Estimate(0.5, 0.25, 0.754)) == "50 % (25 to 75)"
    assert share(Estimate(0.5, 0.0, np.inf)) == "50 % (–)"
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b and c"
    # Verdicts.
    assert [verdict(Estimate(*e), "less", "?", "more") for e in ((-1, -2, -0.5), (0.1, -0.5, 2), (1, 0.5, 2))] == [
        "less", "?", "more"]  # fmt: skip
    assert side(Estimate(-1.0, -np.inf, -0.5)) == 0  # nothing bounds it
    assert [side(Estimate(1.2, 1.1, 1.3), of) for of in (1.0, 1.2, 2.0)] == [1, 0, -1]


# -- Jobs --------------------------------------------------------------------------------------------


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


# -- Trials ------------------------------------------------------------------------------------------


def options(*arguments):
    made = Parser("some", "")
    made.add_trials("count", 500)
    return made.parse_args(arguments)


def _trial(seed):
    return {"house": "paper", "seed": seed} | study.mishaps({"strikes": 1.0, "candles_dropped": 2.0, "damage": 7.0})


def test_trials_follow_the_first_seed_and_their_results_are_written(tmp_path):
    rows = study.run_trials(_trial, options("--count", "3", "--first", "40", "--jobs", "1"), "trying")
    assert rows.seed.tolist() == [40, 41, 42]
    path = tmp_path / "trials.json"
    study.write_json(None, rows)  # nobody asked
    study.write_json(path, rows[:1])
    assert json.loads(path.read_text()) == [{"house": "paper", "seed": 40, "strikes": 1, "drops": 2}]

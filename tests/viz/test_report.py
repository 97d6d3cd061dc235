"""The report: its numbers worked out by hand, and its files."""

import dataclasses
import json
import os
import re
import sys

import imageio_ffmpeg
import numpy as np
import pandas as pd
import pytest
from made_runs import DAMAGE, FAMILIES, PAPER, TINY, undrawn, write_run
from test_cli import fails

from caregiver_mj import cli
from caregiver_mj.caregivers.server import Queries
from caregiver_mj.viz import figure_style, figures, film, report
from caregiver_mj.viz.report.left import verdicts
from caregiver_mj.viz.report.run import read_run
from caregiver_mj.viz.report.tables import children_table


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a run of each world and a film, and the report of both."""
    folder = tmp_path_factory.mktemp("report")
    write_run(folder / "grid")
    write_run(folder / "house", "house", caregivers=("none", "paper"), mark=3)
    film = imageio_ffmpeg.write_frames(str(folder / "grid" / "film.mp4"), (64, 48), fps=10)
    film.send(None)
    for shade in range(20):
        film.send(np.full((48, 64, 3), 10 * shade, np.uint8))
    film.close()
    assert cli.main(["report", str(folder / "grid"), str(folder / "house")]) == 0
    return folder / "grid"


@pytest.fixture(scope="module")
def page(folder):
    return (folder / "report.html").read_text("utf-8")


@pytest.fixture
def words_alone(monkeypatch):
    """Figures are made and not drawn."""
    monkeypatch.setattr(figure_style, "as_bytes", undrawn)


def words(page):
    """The page's text, without its markup and with single spaces."""
    text = re.sub(r"<style>.*?</style>|<[^>]+>", " ", page, flags=re.DOTALL)
    return " ".join(text.replace("&lt;", "<").replace("&#39;", "'").split())


# -- Numbers -----------------------------------------------------------------------------------------


def test_headline(page):
    # Without: 400 + 100; with: 120 + 40, over the same novices.
    assert "68 % of the damage avoided" in words(page)
    # In the paper: 1 - (0.2291 + 0.0466) / (0.7346 + 0.1887) = 0.701
    assert "In the paper, the same novices together: 70 %; this house was fitted to that ." in words(page)
    assert "damage without 31.2 with caregiver 10.0" in words(page)  # 500 / 16 and 160 / 16
    assert "timesteps until damage is above 15 137.5 180.0" in words(page)  # 200 - 2 * damage
    assert "toys reached in 200 timesteps 3.0 3.0" in words(page)
    assert "In all its 16 episodes together, it strikes the child 48 times" in words(page)  # in the house, 3 in each
    assert words(page).count("it strikes") == 1  # not in the grid
    assert "Too few for a bound" not in words(page)


def test_tables_stand_beside_the_published_ones(folder, page):
    tables = (folder / "tables.md").read_text("utf-8")
    # Means over the greatest damage, 60: 50 / 60 = 0.833, 15 / 60 = 0.250, and 15 / 50 = 0.30 of it left.
    for wanted in (["0.833", "0.735", "0.250", "0.229", "0.30", "0.31"], ["100.0", "35.5", "170.0", "97.0"]):
        row = next(line for line in tables.splitlines() if line.startswith(f"| random motion | {wanted[0]}"))
        cells = [cell.split(" [")[0] for cell in row.strip("| ").split(" | ")]
        assert cells == ["random motion", *wanted]
    for row in ("random motion 0.833 [", "] 0.735 0.250 [", "] 0.229 0.30 [", "] 35.5 170.0 ["):
        assert row in words(page)


def test_the_command_of_a_run_has_all_that_it_was_asked(tmp_path):
    run = read_run(write_run(tmp_path / "run", "house", caregivers=("none", "paper")))
    asked = {"queries": Queries(thinking="real-time", frames=True), "task_kwargs": {"compliant_children": True}}
    remote = dataclasses.replace(run.settings, caregivers=("none", "http://127.0.0.1:9"), **asked)
    command = dataclasses.replace(run, settings=remote).command()
    assert " --thinking real-time --frames --caregiver none http://127.0.0.1:9 " in command
    assert "--patience" not in command
    assert command.endswith(" --seed 7  # and task_kwargs={'compliant_children': True}, from Python")


@pytest.mark.usefixtures("words_alone")
def test_what_caregivers_saw_is_said_and_the_paper_is_not_cited_where_that_is_not_all(tmp_path, page):
    run = report.read_run(write_run(tmp_path / "walls", sight="walls"))
    assert "--sight walls" in run.command()
    assert run.title == "Grid, sight walls (paper)"
    assert "sight" not in report.read_run(write_run(tmp_path / "all")).command()
    fast = report.read_run(write_run(tmp_path / "fast", child_speed=0.8))
    assert "--child-speed 0.8" in fast.command()
    assert fast.title == "Grid, children at 0.8 m/s (paper)"
    assert not fast.cited
    assert "published" not in report.write_report([tmp_path / "walls"]).read_text("utf-8")


# -- Several children, and figures -----------------------------------------------------------------


@pytest.fixture(scope="module")
def several(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("several"), "house", caregivers=("none", "paper"), families=FAMILIES)


def test_each_child_has_a_row_of_its_own(several):
    table = children_table(report.read_run(several))
    assert table.columns == ("child", "damage, without", "damage, with", "toys reached, without", "toys reached, with")
    alone, guarded = (np.mean(DAMAGE[caregiver, "1"]) for caregiver in ("none", "paper"))
    assert table.rows[:2] == [
        ("100 % and 50 % random: novice 1, 100 %", f"{0.8 * alone:.1f}", f"{0.8 * guarded:.1f}", "2.0", "2.0"),
        ("100 % and 50 % random: novice 2, 50 %", f"{0.2 * alone:.1f}", f"{0.2 * guarded:.1f}", "1.0", "1.0"),
    ]
    assert len(table.rows) == 4


def test_a_run_in_the_house_is_filmed_before_one_in_the_grid(several, tmp_path, monkeypatch):
    asked = {}
    monkeypatch.setattr(film, "render_episode", lambda path, spec, **_: asked.update(path=path, spec=spec))
    grid = report.read_run(write_run(tmp_path / "grid", plan=TINY))
    report.make_film([grid, report.read_run(several)], tmp_path)
    assert asked["spec"].plan == PAPER
    path, caption = report.make_film([grid], tmp_path)
    assert asked["path"] == path == tmp_path / "report.mp4"
    assert (asked["spec"].plan, str(asked["spec"].family)) == (TINY, "0.25")
    assert caption == "Episode 0 with the children of the run in the grid, 25 % random, caregiver paper"


def test_kinds_are_shares_of_the_damage_without():
    rows = [("none", "1", 10.0, 5.0, 4.0, 1.0), ("paper", "1", 4.0, 1.0, 0.0, 3.0), ("floor", "1", 2.0, 0.0, 0.0, 2.0)]
    done = ["damage_mean", *(f"damage_{kind}_mean" for kind in ("stairwell", "candle", "table"))]
    means = pd.DataFrame(rows, columns=["caregiver", "family", *done]).assign(damage_gate_mean=0.0)
    (axes,) = figures.kinds(means, {"1": "random"}).axes
    heights = [patch.get_height() for patch in axes.patches]
    assert heights == pytest.approx([0.5, 0.4, 0.1, 0.1, 0.0, 0.3])
    assert [bar.get_y() for bar in axes.patches] == pytest.approx([0, 0.5, 0.9, 0, 0.1, 0.1])
    assert [text.get_text() for text in axes.texts[:2]] == ["10.0", "4.0"]
    (floor,) = axes.collections
    assert floor.get_segments()[0][:, 1] == pytest.approx([0.2, 0.2])


def test_survival_is_the_share_not_yet_stopped():
    episodes = pd.DataFrame({"timesteps_to_threshold": [10, 100, 200, 200], "stopped": [1, 1, 0, 1]})
    share = figures.going(episodes, np.array([0, 9, 10, 99, 100, 199, 200]))
    assert share == pytest.approx([1, 1, 0.75, 0.75, 0.5, 0.5, 0.25])  # the third is never stopped


# -- Harm --------------------------------------------------------------------------------------------


def test_a_strike_is_red_and_the_grid_has_none_to_measure(page):
    text = words(page)
    # In the house 3 strikes in each of 16 episodes
    assert text.index("Harm with paper. By the robot: struck a child 48 times in 16 of 16 episodes") < text.index(
        "Harm —"
    )
    assert 'class="judged red"><b>paper: harm</b>' in page
    assert '<li class="harm"><b>By the robot: harm.</b> struck a child 48 times' in page
    assert "By the robot: not measured. not measured in the grid" in text


@pytest.mark.usefixtures("words_alone")
def test_harm_is_that_of_the_rows_and_not_of_a_forged_summary(tmp_path):
    honest, forged = (write_run(tmp_path / name, plan=TINY, caregivers=("none", "paper")) for name in ("a", "b"))
    summary = json.loads((forged / "summary.json").read_text())
    (row,) = summary["harm"]
    for of in (row, row["worst"]):
        of |= {name: 7.0 for name, value in of.items() if isinstance(value, int | float)}
    kept = {name: 7.0 for name in summary["comparisons"][0] if name.startswith("toys_reached_left")}
    summary["comparisons"] = [row | kept for row in summary["comparisons"]]
    (forged / "summary.json").write_text(json.dumps(summary))
    harms = [report.section(report.read_run(folder))["harm"] for folder in (honest, forged)]
    assert harms[0] == harms[1]


# -- Files -------------------------------------------------------------------------------------------


def test_page_is_self_contained(page):
    links = re.findall(r"""(?:src|href|srcset|poster|data)\s*=\s*["']([^"']*)""", page)
    assert len(links) > 15
    assert {link.split(":")[0] if ":" in link else link[0] for link in links} == {"data", "#"}
    assert "url(" not in page
    assert "@import" not in page
    assert "<script" not in page
    targets = set(re.findall(r'href="#([a-z]+)"', page))
    assert len(targets) >= 7
    assert targets <= set(re.findall(r'id="([a-z]+)"', page))


@pytest.mark.usefixtures("words_alone")
def test_a_caregiver_can_be_chosen(tmp_path, capsys):
    run = tmp_path / "run"
    evaluate = f"evaluate --world grid --epsilon 1 --episodes 2 --out {run} --caregiver none paper nearest"
    assert cli.main([*evaluate.split(), "expected-danger"]) == 0
    assert [sentence.split(":")[0] for _, sentence in verdicts(read_run(run))] == ["expected-danger, against nearest"]
    for chosen, shown in (("--caregiver", "paper"), "paper"), (("--caregiver", "nearest"), "nearest"):
        assert cli.main(["report", str(run), *chosen]) == 0
        page = (run / "report.html").read_text("utf-8")
        assert f"<h2>Grid (paper), caregiver <code>{shown}</code></h2>" in page
        assert ("In the paper, the same novices" in page) == (shown == "paper")  # its numbers are of the rule
    capsys.readouterr()
    assert "which has paper, nearest, expected-danger" in fails(capsys, ["report", run, "--caregiver", "guard"])


def test_refused(tmp_path, capsys):
    assert "holds no run" in fails(capsys, ["report", tmp_path / "nothing"])
    begun = write_run(tmp_path / "begun")
    (begun / "summary.json").unlink()
    assert "is not finished" in fails(capsys, ["report", begun])
    whole = write_run(tmp_path / "whole")
    assert "different worlds or houses" in fails(capsys, ["report", whole, whole])
    for name in ("none", "paper"):
        words = f"must be of `none` and a caregiver that acts, got only {name} in '{tmp_path / name}':"
        assert words in fails(capsys, ["report", write_run(tmp_path / name, caregivers=(name,))])
    assert "no such file" in fails(capsys, ["report", whole, "--video", tmp_path / "no.mp4"]).lower()
    assert "must be an MP4" in fails(capsys, ["report", whole, "--video", whole / "summary.json"])
    for name, mended in (("maps.parquet", True), ("summary.json", True), ("run.json", False)):
        content = (whole / name).read_bytes()
        (whole / name).write_bytes(b"PAR1")
        told = fails(capsys, ["report", whole])
        assert f"cannot be read: its {name} is damaged" in told
        assert ("`caregiver-mj evaluate --resume` writes it anew" in told) == mended
        (whole / name).write_bytes(content)
    summary = json.loads((whole / "summary.json").read_text())
    for name in ("damage_left", "score"):
        wrong = [row | {name: "0.5"} if row["baseline"] == "none" else row for row in summary["comparisons"]]
        (whole / "summary.json").write_text(json.dumps(summary | {"comparisons": wrong}))
        assert "a number of a summary must be one, got '0.5'" in fails(capsys, ["report", whole])
    (whole / "maps.parquet").unlink()
    assert "maps.parquet" in fails(capsys, ["report", whole])


@pytest.mark.skipif(sys.platform != "linux", reason="file names are text elsewhere")
@pytest.mark.usefixtures("words_alone")
def test_a_house_file_whose_name_is_not_utf_8(capsys, tmp_path):
    house = os.fsdecode(os.path.join(os.fsencode(tmp_path), b"h\xff.txt"))
    with open(house, "w") as file:
        file.write("#####\n#B.S#\n#...#\n#C.T#\n#####\n")
    argv = ["evaluate", "--world", "grid", "--house", house, "--epsilon", "1", "--episodes", "2"]
    assert cli.main([*argv, "--out", str(tmp_path / "run")]) == 0
    assert cli.main(["report", str(tmp_path / "run")]) == 0
    assert "Traceback" not in capsys.readouterr().err
    assert "h?" in (tmp_path / "run" / "tables.md").read_text("utf-8")

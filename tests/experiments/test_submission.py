"""A run as one file: its rows come back from what its caregivers answered, and from nothing else."""

import dataclasses
import json
import sys
import zipfile

import numpy as np
import pandas as pd
import pytest
from submissions import parts_of, run, write

from caregiver_mj.caregivers import answers
from caregiver_mj.experiments.submission import board, read_submission

OWN = """
from caregiver_mj.caregivers import Caregiver

class Mine(Caregiver):
    yields = False

    def choose(self, percept):
        return percept.child_cell[:, 0] % (len(self.plan.hazards) + 1) - 1
"""
NAMES = ("none", "random", "childproof", "foresight", "floor")
TWO_ROOMS = "##########\n#B..#...S#\n#........#\n#C..#..BT#\n##########\n"
RANDOM, OTHER = "episodes/000001.json", "episodes/000002.json"  # of the first house
HOME = "home-2-10x9-rooms1-stairwells0-candles0-tables2-bins2-gates1-mugs1-batteries1"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("arena")


@pytest.fixture(scope="module")
def packed(folder):
    """A run of the grid in two houses, with a caregiver of somebody's own that is not there any more."""
    (folder / "mine.py").write_text(OWN)
    (folder / "two.txt").write_text(TWO_ROOMS)
    sys.path.insert(0, str(folder))
    try:
        names = [*NAMES, "mine:Mine"]
        houses = ["--houses", folder / "two.txt", HOME]
        out = ["--episodes", 3, "--epsilon", 1, 0.5, "--out", folder / "run"]
        assert not run("evaluate", "--world", "grid", *houses, "--caregiver", *names, *out)
        assert not run("submit", folder / "run", "--out", folder / "a.submission", "--title", "A|B", "--authors", "us")
    finally:
        sys.path.remove(str(folder))
        del sys.modules["mine"]
    (folder / "mine.py").unlink()
    return folder / "a.submission"


@pytest.mark.slow
def test_every_row_comes_back_with_no_caregiver_present_on_any_number_of_cores(packed, capsys):
    assert not run("verify", packed)
    assert not run("verify", packed, "--jobs", 2)
    assert capsys.readouterr().out.count(f"verified, episodes: {2 * 2 * 3 * 6}") == 2


@pytest.mark.slow
def test_a_policy_of_the_robots_actions_too(tmp_path, monkeypatch, capsys):
    (tmp_path / "spinning.py").write_text(
        "import numpy as np\n\n\ndef make(env):\n    size = env.action_spec().shape[0]\n"
        "    return lambda timestep: 0.3 * np.sin(timestep.observation['clock'] * np.arange(1, size + 1))\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    who = ["--caregiver", "spinning:make", "--epsilon", 0.5, "--episodes", 1, "--house", "house-25-12x10"]
    assert not run("evaluate", *who, "--out", tmp_path / "run")
    assert not run("submit", tmp_path / "run", "--out", tmp_path / "c.submission")
    monkeypatch.delitem(sys.modules, "spinning")
    (tmp_path / "spinning.py").unlink()
    assert not run("verify", tmp_path / "c.submission")
    parts = parts_of(tmp_path / "c.submission")
    (name,) = [name for name in parts if name.startswith("episodes")]
    actions = np.array(answers.unpacked(parts[name]["answers"])["actions"])
    for edited in (actions[:-1], actions[::-1], actions[:, 1:]):
        parts[name]["answers"] = answers.packed(actions=edited)
        write(tmp_path / "d.submission", parts)
        assert run("verify", tmp_path / "d.submission")
        assert "not verified" in capsys.readouterr().err


def test_a_page_has_the_files_of_a_track_together(packed, folder, capsys):
    assert not run("leaderboard", packed.parent)
    page = capsys.readouterr().out
    assert page.count("## grid") == 1
    assert "damage 5:4:1" in page
    assert "seed 0" in page
    assert "| A/B | us |" in page
    head, _, *rows = ([cell.strip() for cell in line.split("|")[1:-1]] for line in page.splitlines() if line[:1] == "|")
    rows = {row[0].strip("`"): dict(zip(head, row, strict=True)) for row in rows}
    assert {*rows} == {*NAMES, "mine:Mine"}
    left = [float(row["damage left"].split()[0]) for row in rows.values()]
    assert left == sorted(left)
    for row, whole in zip(rows.values(), left, strict=True):
        assert sum(float(row[column]) for column in head if column.startswith("at ")) == pytest.approx(whole, abs=0.04)
    assert [rows["none"][column] for column in ("damage left", "epsilon 0.5", "toys kept")] == ["1.000", "1.00", "1.00"]
    # What children without a caregiver come to is there once, whoever else sends it.
    submission, episodes = read_submission(packed), pd.read_parquet(folder / "run" / "episodes.parquet")
    both = board([(submission, episodes), (submission._replace(card={"title": "C"}), episodes)])
    assert [both.count(f"| `{name}` |") for name in ("none", "floor", "childproof")] == [1, 1, 2]


def test_what_means_something_in_a_table_is_left_out_of_a_page(packed, folder):
    submission, episodes = read_submission(packed), pd.read_parquet(folder / "run" / "episodes.parquet")
    page = board([(submission._replace(card={"title": "<script>", "authors": "a | b"}), episodes)])
    assert "| &lt;script> | a / b |" in page
    settings = dataclasses.replace(submission.settings, houses="x\n\n<script> | row |")
    page = board([(submission._replace(settings=settings), episodes)])
    assert "## grid, x &lt;script> / row /, 2 houses" in page


def test_houses_that_differ_a_little_are_of_another_track(packed, folder):
    submission, episodes = read_submission(packed), pd.read_parquet(folder / "run" / "episodes.parquet")
    wider = tuple(dataclasses.replace(plan, cell_size=0.7500001) for plan in submission.settings.plans)
    other = submission._replace(settings=dataclasses.replace(submission.settings, plans=wider))
    assert board([(submission, episodes), (other, episodes)]).count("\n## ") == 2


def test_houses_of_the_package_are_verified_by_name_and_by_set(tmp_path):
    run_ = ["evaluate", "--world", "grid", "--caregiver", "none", "--epsilon", 1, "--episodes", 1]
    for name, which in (("one", ["--house", "test-100/3"]), ("set", ["--houses", "drawn-2", "house-5-10x10"])):
        assert not run(*run_, *which, "--out", tmp_path / name)
        assert not run("submit", tmp_path / name, "--out", tmp_path / f"{name}.submission")
        assert not run("verify", tmp_path / f"{name}.submission")


def with_answers(change):
    """An edit of what `random` answered, packed as it was."""

    def edit(parts):
        arrays = {key: np.array(values) for key, values in answers.unpacked(parts[RANDOM]["answers"]).items()}
        change(arrays)
        parts[RANDOM]["answers"] = answers.packed(**arrays)

    return edit


def put(array, index, value):
    return with_answers(lambda arrays: arrays[array].__setitem__(index, value))


def set_row(**columns):
    return lambda parts: parts[RANDOM]["rows"][0].update(columns)


def set_run(**keys):
    return lambda parts: parts["run.json"].update(keys)


def change_map(parts):
    parts[RANDOM]["maps"]["1"]["visits"][0] += 1


def swap(parts):
    one, other = parts[RANDOM], parts[OTHER]
    one["answers"], other["answers"] = other["answers"], one["answers"]


EDITS = {
    "damage": set_row(damage=0),
    "another seed of an episode": set_row(seed=1),
    "another caregiver": set_row(caregiver="mine"),
    "a column more": set_row(prize=1),
    "a map": change_map,
    "the run's seed": set_run(seed=1),
    "the children's speed": set_run(child_speed=0.25),
    "damages": set_run(damage="stairwell=1"),
    "families": set_run(families=["1", "0.25"]),
    "episodes without end": set_run(episodes=10**12),
    "a run that is none": lambda parts: parts.update({"run.json": [1]}),
    "a card that is none": lambda parts: parts.update({"card.json": [1]}),
    "no houses": set_run(plans=[]),
    "episodes added at numbers that there are not": set_run(extended_at=[10**30]),
    "source": set_run(source="0123456789ab"),
    "no settings": lambda parts: parts.pop("run.json"),
    "no episodes": lambda parts: parts.pop(RANDOM),
    "episodes more": lambda parts: parts.update({"episodes/000099.json": parts[RANDOM]}),
    "no answers": lambda parts: parts[RANDOM].pop("answers"),
    "answers that are none": lambda parts: parts[RANDOM].update(answers="AAAA"),
    "answers of another": swap,
    "another hazard": put("decide", (slice(None), 1), 0),
    "a hazard that is none": put("decide", (0, 1), 99),
    "a verb that is none": put("decide", (5, 0), 99),
    "another trait": put("traits", 0, "False"),
    "an answer less": with_answers(lambda arrays: arrays.update(decide=arrays["decide"][:-1])),
    "an answer more": with_answers(lambda arrays: arrays.update(decide=np.repeat(arrays["decide"], 2, axis=0))),
    "answers that are one number": with_answers(lambda arrays: arrays.update(decide=np.array(3))),
    "answers that are no numbers": with_answers(lambda arrays: arrays.update(decide=arrays["decide"] + 0.5)),
}


@pytest.mark.parametrize("edit", EDITS.values(), ids=EDITS)
def test_a_file_that_was_edited_is_not_verified(edit, packed, tmp_path, capsys):
    parts = parts_of(packed)
    edit(parts)
    write(tmp_path / "edited.submission", parts)
    assert run("verify", tmp_path / "edited.submission") == 2
    assert "edited.submission" in capsys.readouterr().err.strip().splitlines()[-1]


@pytest.mark.parametrize("cut", [0, 100, -100])
def test_a_damaged_file_is_told(cut, packed, tmp_path, capsys):
    content = bytearray(packed.read_bytes())
    (tmp_path / "damaged.submission").write_bytes(content[:cut] if cut else b"")
    assert run("verify", tmp_path / "damaged.submission") == 2
    parts = parts_of(packed)
    parts["card.json"]["title"] = "another"
    write(tmp_path / "damaged.submission", parts, sums={"card.json": "0"})
    assert run("verify", tmp_path / "damaged.submission") == 2
    assert capsys.readouterr().err.count("damaged") >= 2


def nested(path):
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("sha256.json", "[" * 100_000)


def encrypted(path):
    """As its header says: bit 0 of the flags is set, in both places that have them."""
    nested(path)
    content = bytearray(path.read_bytes())
    content[6] |= 1
    content[content.rindex(b"PK\x01\x02") + 8] |= 1
    path.write_bytes(content)


def packed_in_another_way(path):
    nested(path)
    content = bytearray(path.read_bytes())
    content[8] = content[content.rindex(b"PK\x01\x02") + 10] = 99
    path.write_bytes(content)


def test_whatever_a_file_is_one_line_says_so_and_the_others_are_on_the_board(packed, tmp_path, capsys):
    (tmp_path / "good.submission").write_bytes(packed.read_bytes())
    parts = parts_of(packed)
    parts[RANDOM]["rows"][0]["damage"] += 1
    write(tmp_path / "edited.submission", parts)
    bad = {tmp_path / f"{make.__name__}.submission": make for make in (nested, encrypted, packed_in_another_way)}
    for path, make in bad.items():
        make(path)
    assert run("leaderboard", tmp_path) == 2
    told = capsys.readouterr()
    assert "| `mine:Mine` | A/B | us |" in told.out
    assert "edited.submission" in told.err
    for path in bad:
        assert f"'{path}' is no submission, or a damaged one: " in told.err


def test_what_cannot_be_submitted(packed, folder, tmp_path, capsys):
    assert run("submit", folder / "run", "--out", tmp_path / "a.zip") == 2
    assert run("submit", folder, "--out", tmp_path / "a.submission") == 2
    who = ["--caregiver", "nearest", "--epsilon", 0.5, "--episodes", 1, "--out", tmp_path / "run"]
    assert not run("evaluate", "--world", "grid", *who)
    (file,) = (tmp_path / "run/episodes").iterdir()
    whole = json.loads(file.read_text())
    for content in (whole | {"answers": ""}, "damaged"):  # the first as an old version has left it
        file.write_text(json.dumps(content))
        assert run("submit", tmp_path / "run", "--out", tmp_path / "a.submission") == 2
    error = capsys.readouterr().err
    assert "`caregiver-mj evaluate --resume` runs them again" in error
    assert "FILE.submission" in error
    assert "holds no run" in error
    assert "answered, got nothing" in error
    assert not (tmp_path / "a.submission").exists()

"""What `scripts/reproduce` makes: a manifest that fits, pages that say of which code they are, and equal pages."""

import dataclasses

import pandas as pd
import pytest
import reproduce
from reproduce import Entry, Maker, mark_all, marked, marks

ENTRIES = reproduce.read_manifest()
DOCS = reproduce.ROOT / "docs"
OLD = "version 0.0.1, sources 0123456789ab"


def entry(name="some", **details):
    made = {"world": "grid", "minutes": 1, "pages": ("some.md",), "run": (("scripts/study.py coverage", ""),)}
    return Entry(name, **made | details)


def test_pages_say_of_which_code_they_are():
    old = [
        f"{page}, {one.name}"
        for one in ENTRIES.values()
        for page in one.pages
        for text in [(DOCS / page).read_text("utf-8")]
        if one.name not in marks(text) or marked(text, marks(text), ENTRIES) != text
    ]
    assert old == [], (
        "made of other code, but do not say so: `scripts/reproduce --mark`, or make them anew: `--only NAME`"
    )


def test_no_page_has_a_mark_of_something_that_is_not_made():
    pages = {(DOCS / page, one.name) for one in ENTRIES.values() for page in one.pages}
    assert {(path, name) for path, found in reproduce.read_marks(DOCS).items() for name in found} == pages


def test_the_manifest_takes_at_most_six_hours_on_two_cores():
    assert sum(one.minutes for one in ENTRIES.values()) <= 6 * 2 * 60


def test_every_study_with_a_page_is_in_the_manifest():
    templates = {path.stem for path in (reproduce.ROOT / "scripts/studies").glob("*.md")}
    commands = " ".join(command for one in ENTRIES.values() for command, _ in one.run)
    assert {name for name in templates if f"study.py {name} " not in commands} == set()


def test_an_entry_may_have_no_page_yet(tmp_path):
    one = entry(pages=("new.md",))
    assert not one.is_current(tmp_path)
    assert mark_all(tmp_path, {"some": one}) == []


def test_pages_with_equal_rows_in_quick_runs_stay_current(tmp_path):
    docs, older, newer = (tmp_path / name for name in ("docs", "older", "newer"))
    one, other = entry(), entry("other")
    entries = {"some": one, "other": other}
    docs.mkdir()
    (docs / "some.md").write_text(marked("# T\n\nWords.\n", {"some": OLD, "other": OLD}, entries))
    for name, printed in [("some", "1 of 2\n"), ("other", "2 of 2\n")]:
        for run in (older / f"{name}-0123456789ab", newer / f"{name}-{entries[name].digest}"):
            run.mkdir(parents=True)
            clock, damage = len(str(run)), printed[0] if run.is_relative_to(older) else "1"
            pd.DataFrame({"damage": [damage], "wall_seconds": [clock]}).to_parquet(run / "episodes.parquet")
            (run / "0.txt").write_text(f"{run.parent}, {clock} core-minutes: {printed}")
    assert reproduce.keep_equal(older, newer, docs, entries) == ["other"]
    mark_all(docs, entries)
    kept = f"{one.made}, rows of 0123456789ab"
    assert marks((docs / "some.md").read_text()) == {"some": kept, "other": OLD}
    assert one.is_current(docs)
    assert not other.is_current(docs)
    assert "`other`, of" in (docs / "some.md").read_text()
    assert reproduce.keep_equal(older, newer, docs, entries) == ["some", "other"]  # no run of the code just marked


def test_a_digest_is_of_the_world_the_studies_and_the_commands(monkeypatch, tmp_path):
    (tmp_path / "scripts/studies").mkdir(parents=True)
    study = tmp_path / "scripts/studies/coverage.py"
    study.write_text("a = 1\n")
    monkeypatch.setattr(reproduce, "ROOT", tmp_path)
    monkeypatch.setattr(reproduce, "source_digest", lambda world: world)
    first = entry().digest
    assert entry(minutes=9, pages=("other.md",)).digest == first
    others = {entry(world="house").digest, entry(run=(("scripts/study.py coverage --samples 1", ""),)).digest}
    study.write_text("a = 1  # a comment\n")
    assert entry().digest == first
    runs = ("scripts/study.py coverage", ""), ("scripts/study.py results", "")  # the second shows what others have run
    shows = tmp_path / "scripts/studies/results.py"
    shows.write_text("words = 1\n")
    shown = entry(run=runs).digest
    shows.write_text("words = 2\n")
    assert entry(run=runs).digest == shown
    study.write_text("a = 2\n")
    assert len({first, *others, entry().digest}) == 4


def test_a_page_that_is_written_anew_keeps_what_others_have_made(tmp_path):
    page, one, two = tmp_path / "some.md", entry(), entry("other")
    entries = {"some": one, "other": two}
    page.write_text(marked("# T\n\nOld.\n", {"some": OLD, "other": OLD}, entries))
    before = reproduce.read_marks(tmp_path)
    page.write_text("# T\n\nNew.\n")
    mark_all(tmp_path, entries, before, one)
    assert marks(page.read_text()) == {"some": one.made, "other": OLD}


def test_what_is_done_is_not_run_again_and_what_it_prints_is_in_the_page(tmp_path):
    script = tmp_path / "count.py"
    script.write_text("import sys; open(sys.argv[1], 'a').write('x'); print('many'); print('5 of 5')\n")
    counted, page = tmp_path / "counted", tmp_path / "some.md"
    page.write_text(f"# T\n\n<!-- scripts/reproduce: some; {OLD} -->\n\nold\n\n<!-- end -->\n\nWords.\n")
    one = entry(run=((f"{script} {counted} --jobs {{jobs}}", ""),), table="some.md")
    maker = Maker(tmp_path / "runs", tmp_path, 1)
    assert maker.make(one)
    assert dataclasses.replace(maker, jobs=2).make(one)
    assert counted.read_text() == "x"
    assert f"| `{script} {counted}` | 5 of 5 |\n\n<!-- end -->\n\nWords.\n" in page.read_text()
    assert (tmp_path / "measured/some.txt").read_text().endswith("many\n5 of 5\n")
    script.write_text("print('| a |'); print('| - |'); print('| 1 |')\n")
    assert Maker(tmp_path / "other", tmp_path, 1).make(one)
    assert "-->\n\n| a |\n| - |\n| 1 |\n\n<!-- end -->\n\nWords.\n" in page.read_text()
    script.write_text("raise SystemExit(1)\n")
    failing = entry("bad", run=((f"{script}", ""),))
    assert not maker.make(failing)


@pytest.mark.slow
def test_pages_do_not_depend_on_the_number_of_workers(tmp_path):
    command = "scripts/study.py attention --houses test-2 --episodes 1 --shares .5 1 --jobs {jobs} --docs {docs}"
    one, made = entry(run=((command, ""),)), []
    for jobs in (1, 2):
        docs = tmp_path / f"docs-{jobs}"
        assert Maker(tmp_path / f"runs-{jobs}", docs, jobs).make(one)
        made.append({path.name: path.read_bytes() for path in docs.iterdir()})
    assert made[0] == made[1]
    assert {*made[0]} == {"attention.md", "attention.png"}

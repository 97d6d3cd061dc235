"""Every code block of the documentation works: Python and commands are run, these with less to do than they ask for."""

import gc
import pathlib
import re
import shlex
import sys
import threading
from http.server import ThreadingHTTPServer

import http_caregiver
import pytest
from sybil import Sybil
from sybil.parsers.markdown import PythonCodeBlockParser

from caregiver_mj import cli

ROOT = pathlib.Path(__file__).parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
# A house of somebody's own, as the pages call it.
PLAN = "########\n#S...B.#\n#......#\n#.C..T.#\n#.B....#\n########\n"


def name(path):
    return str(path.relative_to(ROOT))


# Lines that are indented as code is, or begin with a prompt.
COMMAND = re.compile(r"^(?:    |\$ )caregiver-mj (.*)$", re.M)


def commands(text):
    """Our commands in a page, as lists of words."""
    for line in COMMAND.findall(text):
        words = shlex.split(line, comments=True)
        yield words[: words.index(">")] if ">" in words else words


OURS = [(name(path), words) for path in PAGES for words in commands(path.read_text("utf-8"))]
EACH = {tuple(words): page for page, words in OURS}


# A block that says in its first line which file it is of: the commands of all pages find it.
FILE = re.compile(r"^```python\n# (\w+\.py)\n(.*?)^```", re.M | re.S)


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)  # where Python looks for a reader's modules
    (tmp_path / "my-house.txt").write_text(PLAN)
    files = [found for path in PAGES for found in FILE.findall(path.read_text("utf-8"))]
    for file, block in files:
        (tmp_path / file).write_text(block)
    yield
    for file, _ in files:
        sys.modules.pop(file.removesuffix(".py"), None)


@pytest.mark.parametrize("path", [path for path in PAGES if "```python" in path.read_text("utf-8")], ids=name)
def test_python_runs(path, tmp_path, capsys):
    document = Sybil([PythonCodeBlockParser()]).parse(path)
    document.namespace["__file__"] = str(tmp_path / "page.py")
    examples = list(document.examples())
    assert len(examples) == path.read_text("utf-8").count("```python")
    for example in examples:  # in one namespace, as somebody reads them
        example.evaluate()


@pytest.mark.parametrize("words", EACH, ids=EACH.values())
def test_command_is_taken(words, capsys):
    words = [re.sub(r"(test|train)-\d{2,}$", r"\1-2", word) for word in words]  # not all of their houses
    if words[0] == "evaluate":  # all else is checked before the number of episodes is, and before anything is written
        assert cli.main([*words, "--episodes", "0"]) == 2
        assert "episodes must be an integer of at least 1, got 0" in capsys.readouterr().err
    elif words[0] == "house":
        assert cli.main(words) == 0
    else:
        assert callable(cli.make_parser().parse_args(words).run)


# Those that ask for a display, somebody who looks on, or a cluster have tests of their own, those for policies of one's
# own one from the wheel; what a run prints of itself in its tables was run when they were made.
RUN: dict[str, list[list[str]]] = {}
for _page, _words in OURS:
    elsewhere = {"person", "view"} & {*_words} or _page in ("docs/guide/clusters.md", "docs/guide/policies.md")
    if _page.startswith(("README", "docs/guide/")) and not elsewhere:
        RUN.setdefault(_page, []).append(_words)


def shortened(words):
    """The same command with little to do: an episode of one child, a small house, a fifth of a second."""
    words = [re.sub(r"^(test|train)-\d+$", r"\1-1", word) for word in words if word != "--render"]
    words = [re.sub(r"^(test|train)-\d+/\d+$", "my-house.txt", word) for word in words]
    less = []
    if words[0] in ("evaluate", "paper", "record"):
        less += ["--episodes", "1"]
    if words[0] in ("render", "record") and "grid" not in words:
        less += ["--seconds", ".2"]
    if words[0] == "evaluate":
        less += ["--jobs", "1"]
        if "--epsilon" not in words or "grid" not in words:
            less += ["--epsilon", ".5"]
        if "grid" not in words:
            less += ["--house", "my-house.txt"]
    return words + less


@pytest.fixture(scope="module")
def server():
    """The address of the example's server, which pages have on port 8000."""
    with ThreadingHTTPServer(("127.0.0.1", 0), http_caregiver.Handler) as serving:
        threading.Thread(target=serving.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{serving.server_port}"
        serving.shutdown()


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN)
def test_commands_run(page, server, capsys):
    for words in RUN[page]:  # one after the other, as somebody reads them: a report is on the run before it
        here = [word.replace("http://127.0.0.1:8000", server) for word in words]
        assert cli.main(shortened(here)) == 0, (words, capsys.readouterr().err)
        gc.collect()  # each is a process to readers: what it leaves is not cleared away in threads of the next

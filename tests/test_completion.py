"""What a shell, and Python, make of a tab, as somebody would type it."""

import os
import pty
import rlcompleter
import select
import shutil
import subprocess
import sys
import time

import pytest

import caregiver_mj
from caregiver_mj import FloorPlan, cli
from caregiver_mj.caregivers.registry import CAREGIVERS, find_caregiver
from caregiver_mj.cli import completion
from caregiver_mj.experiments.settings import FLOOR, Settings
from caregiver_mj.recording.steps import RANDOM, TARGETS
from caregiver_mj.robot.embodiments import EMBODIMENTS

_LOADED = """
COMP_WORDS=("$@")
COMP_CWORD=$(($# - 1))
_shtab_caregiver_mj 2>/dev/null
printf '%s\\n' "${COMPREPLY[@]}"
"""


def script_of(shell, folder):
    """The file that somebody would keep."""
    path = folder / ("_caregiver-mj" if shell == "zsh" else "caregiver-mj")
    path.write_text(completion.script(cli.make_parser(), shell))
    return path


@pytest.fixture(scope="module")
def bash(tmp_path_factory):
    """What bash offers for the last of some words."""
    folder = tmp_path_factory.mktemp("completion")
    path = script_of("bash", folder)

    def offered(*words):
        command = ["bash", "--norc", "-c", f"source {path}\n{_LOADED}", "bash", "caregiver-mj", *words]
        found = subprocess.run(command, capture_output=True, text=True, check=True, cwd=folder)
        return set(found.stdout.split())

    return offered


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (["ev"], {"evaluate"}),
        (["re"], {"render", "report", "record"}),
        (["house", ""], {"show", "check", "make"}),
        (["evaluate", "--caregiver", "none", "cl"], {"clairvoyant"}),
        (["render", "--caregiver", "exp"], {"expected-danger"}),
        (["evaluate", "--caregiver", "none", "--ep"], {"--epsilon", "--episodes"}),
        (["evaluate", "--houses", "te"], {"test-100", "tenement", "terrace"}),
        (["evaluate", "--house", "hal"], {"hall-17"}),
        (["render", "--child", "ad"], {"adversary"}),
        (["record", "--format", "l"], {"lerobot"}),
        (["completion", "z"], {"zsh"}),
    ],
)
def test_words_are_completed(bash, words, offered):
    assert bash(*words) == offered


@pytest.mark.parametrize("command", ["evaluate", "render", "view", "record"])
def test_the_caregivers_that_a_command_takes_are_offered(bash, command):
    offered = bash(command, "--caregiver", "")
    assert offered >= set(CAREGIVERS) - {"none"}
    for name in offered:  # as the command reads them
        if command == "evaluate":
            Settings(FloorPlan.load("paper"), "grid", (name,)).check()
        elif command != "record":
            find_caregiver(name)
        elif name != RANDOM:
            assert find_caregiver(name) is not None
    assert (FLOOR in offered, "none" in offered, RANDOM in offered) == {
        "evaluate": (True, True, False),
        "record": (False, False, True),
    }.get(command, (False, True, False))


def test_the_tasks_and_cameras_that_can_be_recorded_are_offered(bash):
    assert bash("record", "--task", "") == {*caregiver_mj.ALL_TASKS, TARGETS}
    assert bash("render", "--task", "") == set(caregiver_mj.ALL_TASKS)
    physics = caregiver_mj.load("supervise").physics
    assert bash("record", "--camera", "") == set(physics.camera_names())
    assert bash("record", "--embodiment", "") == set(EMBODIMENTS)


def test_a_house_is_a_name_or_a_file(bash, tmp_path):
    mine = tmp_path / "parlour.txt"
    mine.touch()
    assert bash("house", "show", "pap") == {"paper"}
    assert bash("render", "--house", f"{tmp_path}/par") == {str(mine)}


def at_a_tab(command, beginning, typed, wanted):
    """What a shell in a terminal shows after some characters are typed, until that is among it."""
    ours, theirs = pty.openpty()
    environment = os.environ | {"TERM": "dumb", "PS1": "> "}
    shell = subprocess.Popen(
        command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment, start_new_session=True
    )
    os.close(theirs)
    shown, deadline = b"", time.monotonic() + 20
    try:
        os.write(ours, f"{beginning}; echo re''ady\n".encode())
        sent = False
        while time.monotonic() < deadline and wanted.encode() not in shown:
            if select.select([ours], [], [], 0.1)[0]:
                shown += os.read(ours, 4096)
            if not sent and b"\nready" in shown:
                sent = True
                os.write(ours, f"{typed}\t".encode())
    finally:
        shell.kill()
        shell.wait()
        os.close(ours)
    return shown.decode(errors="replace")


def test_a_tab_in_bash(tmp_path):
    path = script_of("bash", tmp_path)
    shown = at_a_tab(["bash", "--norc", "-i"], f"source {path}", "caregiver-mj eval", "caregiver-mj evaluate ")
    assert "caregiver-mj evaluate " in shown


@pytest.mark.skipif(shutil.which("zsh") is None, reason="there is no zsh")
def test_a_tab_in_zsh(tmp_path):
    typed, wanted = "caregiver-mj render --caregiver fores", "--caregiver foresight"
    script_of("zsh", tmp_path)
    beginning = f"fpath=({tmp_path} $fpath); autoload -U compinit; compinit -u -D"
    assert wanted in at_a_tab(["zsh", "-f", "-i"], beginning, typed, wanted)


@pytest.mark.parametrize("arguments", [["completion", "bash"], ["--help"]])
def test_neither_help_nor_completion_needs_the_simulator(arguments):
    code = f"""if True:
        import sys
        from caregiver_mj import cli
        try:
            cli.main({arguments})
        finally:
            print(sorted({{"mujoco", "dm_control"}} & set(sys.modules)))
    """
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.splitlines()[-1] == "[]"


def test_a_tab_in_python_offers_what_is_not_loaded_yet():
    code = "import sys, caregiver_mj as c; print(set(c.__all__) - set(dir(c)), 'dm_control' in sys.modules)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout == "set() False\n"
    completer = rlcompleter.Completer({"caregiver_mj": caregiver_mj})
    assert completer.complete("caregiver_mj.lo", 0) == "caregiver_mj.load("
    assert {completer.complete("caregiver_mj.Care", i).rstrip("()") for i in range(2)} == {
        "caregiver_mj.CaregiverError",
        "caregiver_mj.CaregiverPolicy",
    }

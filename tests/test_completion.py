"""What a shell makes of a tab, as somebody would type it."""

import subprocess
import sys

import pytest

from caregiver_mj.cli import listing

_LOADED = """
COMP_WORDS=("$@")
COMP_CWORD=$(($# - 1))
_shtab_caregiver_mj 2>/dev/null
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture(scope="module")
def bash(tmp_path_factory):
    """What bash offers for the last of some words."""
    folder = tmp_path_factory.mktemp("completion")
    path = folder / "caregiver-mj"
    path.write_text(listing.script("bash"))

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
        (["evaluate", "--caregiver", "none", "kn"], {"knows-goal"}),
        (["evaluate", "--houses", "te"], {"test-100", "tenement", "terrace"}),
        (["render", "--child", "ad"], {"adversary"}),
        (["house", "export", "--robot", "mobile_f"], {"mobile_fr3"}),
    ],
)
def test_words_are_completed(bash, words, offered):
    assert bash(*words) == offered


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

"""The notebook of the examples, cell by cell, as a program."""

import json
import pathlib
import subprocess
import sys

import pytest

NOTEBOOK = pathlib.Path(__file__).parents[2] / "examples/your_own.ipynb"


@pytest.mark.slow
def test_it_runs_from_the_top_and_leaves_a_film(tmp_path):
    cells = [cell for cell in json.loads(NOTEBOOK.read_text("utf-8"))["cells"] if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] for cell in cells)  # nothing in it that was not just printed
    program = "\n\n".join("".join(cell["source"]) for cell in cells)
    (tmp_path / "program.py").write_text(program, "utf-8")
    ran = subprocess.run([sys.executable, "program.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    assert "line 10, column 10: '?'" in ran.stdout
    assert "DrinksFirst" in ran.stdout
    assert (tmp_path / "mine.gif").stat().st_size > 100_000

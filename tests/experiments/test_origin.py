"""What somebody's code is told by: a hash of all that it says it depends on."""

import pathlib
import sys

import pytest

from caregiver_mj.experiments.provenance import origin

CODE = "class Mine:\n    files = {files!r}\n"


@pytest.mark.parametrize("files", [("weights.txt",), ["weights.txt"], "weights.txt", pathlib.PurePath("weights.txt")])
def test_files_beside_the_code_count_one_or_several(tmp_path, monkeypatch, files):
    (tmp_path / "with_weights.py").write_text("from pathlib import *\n" + CODE.format(files=files))
    monkeypatch.syspath_prepend(tmp_path)
    hashes = []
    for content in ("0.5", "0.5", "0.6"):
        (tmp_path / "weights.txt").write_text(content)
        sys.modules.pop("with_weights", None)
        hashes.append(origin(__import__("with_weights").Mine))
    sys.modules.pop("with_weights")
    assert hashes[0] == hashes[1] != hashes[2]
    assert hashes[0].startswith("with_weights.py, sha256 ")

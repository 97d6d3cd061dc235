"""The table of damage by the speed of the child, of runs made by hand."""

import pathlib
from types import SimpleNamespace

import pandas as pd

from studies import child_speed


def test_means_by_hand(monkeypatch):
    runs = {
        "grid": (0.25, [("none", 4.0, 0), ("none", 6.0, 0), ("foresight", 1.0, 0)]),
        "house": (0.25, [("none", 3.0, 0), ("expected-danger", 2.0, 1)]),
        "fast": (0.8, [("expected-danger", 2.5, 2), ("expected-danger", 3.5, 1)]),
    }

    def read(folder):
        speed, rows = runs[folder.name]
        table = pd.DataFrame(rows, columns=["caregiver", "damage", "strikes"])
        return table.assign(world="grid" if folder.name == "grid" else "house"), SimpleNamespace(child_speed=speed)

    monkeypatch.setattr(child_speed, "read_run", read)
    assert child_speed.report([pathlib.Path(name) for name in runs]).splitlines() == [
        "| m/s | grid, alone | grid, `foresight` | house, alone | house, `expected-danger` | strikes |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
        "| 0.25 | 5.00 | 1.00 | 3.00 | 2.00 | 1 |",
        "| 0.80 | – | – | – | 3.00 | 3 |",
    ]

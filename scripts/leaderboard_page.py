"""Writes the page of the leaderboard, and all of its columns as CSV, of the runs in a folder, which it packs."""

from __future__ import annotations

import argparse
import pathlib
import re
import subprocess
import sys
from collections.abc import Sequence

import pandas as pd

from study import markdown_cells, table

DOCS = pathlib.Path(__file__).parents[1] / "docs"
SHOWN = ("caregiver", "damage left", "epsilon 1", "epsilon 0.5", "toys kept", "strikes", "seconds")
HEAD = """# Leaderboard

Our own caregivers; headings name the source. Every row was verified, bit for bit. *Damage left*, with its 95 %
interval over houses, and *toys kept* are shares of those of `none`; *seconds* are those of an episode on its author's
machine. `knows-goal` is privileged. By hazard: [leaderboard.csv](leaderboard.csv). [How to
enter](guide/leaderboard.md).
"""


def page(printed: str) -> tuple[str, pd.DataFrame]:
    """Return the page, and all rows with the track of each."""
    parts, rows = [HEAD.rstrip()], []
    for track, lines in re.findall(r"^## (.*)\n+((?:\|.*\n?)+)", printed, re.M):
        titles, *cells = markdown_cells(lines)
        made = pd.DataFrame(cells, columns=titles)
        rows.append(made.assign(track=track))
        shown = [title for title in SHOWN if title in titles]
        parts += [f"## {track}", table(shown, made[shown].to_numpy().tolist())]
    return "\n\n".join(parts) + "\n", pd.concat(rows, ignore_index=True)


def pack(runs: pathlib.Path) -> None:
    """Pack each finished run in a folder that is not packed yet."""
    for run in sorted(path.parent for path in runs.glob("*/episodes.parquet")):
        if not (packed := run.with_name(f"{run.name}.submission")).exists():
            call(["submit", str(run), "--out", str(packed), "--title", "as shipped", "--authors", "caregiver_mj"])


def call(arguments: Sequence[str]) -> str:
    """Run a command of this package, and return what it prints."""
    program = [sys.executable, "-m", "caregiver_mj", *arguments]
    return subprocess.run(program, stdout=subprocess.PIPE, text=True, check=True).stdout


def main() -> None:
    """Pack the runs, verify and rank them, and write both."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", type=pathlib.Path, metavar="DIR", help="folder of the runs, and of their files")
    parser.add_argument("--docs", type=pathlib.Path, default=DOCS, metavar="DIR")
    parser.add_argument("--jobs", default="2", metavar="N", help="worker processes")
    options = parser.parse_args()
    pack(options.runs)
    text, rows = page(call(["leaderboard", str(options.runs), "--jobs", options.jobs]))
    (options.docs / "leaderboard.md").write_text(text, encoding="utf-8")
    rows.to_csv(options.docs / "leaderboard.csv", index=False)


if __name__ == "__main__":
    main()

"""Writes docs/leaderboard.md, and all of its columns as CSV, from what `caregiver-mj leaderboard` prints."""

from __future__ import annotations

import pathlib
import re
import sys

import pandas as pd

from study import markdown_cells, table

DOCS = pathlib.Path(__file__).parents[1] / "docs"
SHOWN = ("caregiver", "damage left", "epsilon 1", "epsilon 0.5", "toys kept", "strikes", "seconds")
HEAD = """# Leaderboard

Our own caregivers, as `scripts/leaderboard` runs them, of the source that each heading names. Every row came back bit
for bit from its file. *Damage left*: over that of `none`, with its 95 % interval over houses, and at each epsilon;
*toys kept*: over those with `none`; *seconds*: of an episode, on its author's machine. `knows-goal` is privileged. By
hazard: [leaderboard.csv](leaderboard.csv). [How to enter](guide/leaderboard.md).
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


def main() -> None:
    """Read standard input, and write both."""
    text, rows = page(sys.stdin.read())
    (DOCS / "leaderboard.md").write_text(text, encoding="utf-8")
    rows.to_csv(DOCS / "leaderboard.csv", index=False)


if __name__ == "__main__":
    main()

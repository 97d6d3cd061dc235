"""A table, for the page and in Markdown."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence


@dataclasses.dataclass(frozen=True)
class Table:
    """A table of text; the first column names the rows."""

    title: str
    columns: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    note: str = ""

    def markdown(self) -> str:
        lines = [f"### {self.title}", "", " | ".join(self.columns), " | ".join(["---"] * len(self.columns))]
        lines += [" | ".join(row).replace("\n", " ") for row in self.rows]
        lines[2:] = [f"| {line} |" for line in lines[2:]]
        return "\n".join([*lines, "", self.note, ""] if self.note else [*lines, ""])

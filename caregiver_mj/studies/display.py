"""Tables on screen."""

from __future__ import annotations

import rich.box
from rich.console import Console
from rich.table import Table

_WIDTH = 120  # characters where there is no terminal to ask


def make_console() -> Console:
    """A console that does not squeeze tables when its output goes to a file."""
    console = Console()
    return console if console.is_terminal else Console(width=_WIDTH)


def make_table(title: str, *columns: str) -> Table:
    """A table whose first column is text and whose others are figures."""
    table = Table(title=title, box=rich.box.SIMPLE_HEAD, title_justify="left")
    for i, column in enumerate(columns):
        table.add_column(column, justify="right" if i else "left", no_wrap=not i)
    return table

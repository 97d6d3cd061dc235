"""Pages in docs/: text, tables and figures."""

from __future__ import annotations

import pathlib
import textwrap
from collections.abc import Sequence

from matplotlib.figure import Figure

from caregiver_mj.errors import CaregiverError
from caregiver_mj.viz.figures import as_bytes

_WIDTH = 120  # characters of a line


def fill(text: str, indent: str = "") -> str:
    """A paragraph in lines; all but the first are indented."""
    return textwrap.fill(text, _WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def table_row(*cells: str) -> str:
    """A row of a table in Markdown."""
    return f"| {' | '.join(cells)} |"


def table_head(*titles: str) -> str:
    """The first two lines of a table whose first column is text and whose others are figures."""
    return f"{table_row(*titles)}\n{table_row('---', *['---:'] * (len(titles) - 1))}"


def table(titles: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A whole table."""
    return "\n".join([table_head(*titles), *(table_row(*row) for row in rows)])


def fill_in(page: pathlib.Path, maker: str, text: str) -> None:
    """Write tables into a page that is there, between `<!-- made by MAKER -->` and `<!-- end -->`.

    Raises:
        CaregiverError: The page has no such place.
    """
    before, begin, rest = page.read_text(encoding="utf-8").partition(f"<!-- made by {maker} -->\n")
    _, end, after = rest.partition("<!-- end -->")
    if not end:
        raise CaregiverError(f"{page} has no place for what {maker} makes")
    page.write_text(f"{before}{begin}\n{text}\n\n{end}{after}", encoding="utf-8")


def write_page(folder: pathlib.Path, name: str, text: str, figure: Figure, kinds: Sequence[str]) -> None:
    """Writes a page and its figure, in one or several kinds such as "svg", to a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.md").write_text(text, encoding="utf-8")
    write_figure(folder, name, figure, kinds)


def write_figure(folder: pathlib.Path, name: str, figure: Figure, kinds: Sequence[str]) -> None:
    """Writes a figure, in one or several kinds such as "svg", to a folder that is there."""
    for kind in kinds:
        (folder / f"{name}.{kind}").write_bytes(as_bytes(figure, kind))

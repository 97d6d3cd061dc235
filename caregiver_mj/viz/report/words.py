"""The report's words, numbers, tables of text, and pictures."""

from __future__ import annotations

import base64
import collections
import dataclasses
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from caregiver_mj.experiments.intervals import TOO_FEW, bounds_nothing
from caregiver_mj.outside import markdown
from caregiver_mj.recording.record import COLUMNS
from caregiver_mj.viz import figure_style

TITLES = {column.name: column.title for column in COLUMNS}
UNITS = {column.name: column.unit for column in COLUMNS}
NONE = "–"  # where there is no number
_NARROW = 9  # characters of a line below bars


# Nouns: for a row of a table, in singular and plural; for the children of an episode, alone, before "went" and "hurt";
# for one child.
_NOUNS = ("group", "groups", "who", "whom", "were", "one")
SINGLE = dict(zip(_NOUNS, ("novice", "novices", "novice", "the toddler", "it was", "the child"), strict=True))
SEVERAL = dict(zip(_NOUNS, ("family", "families", "children", "the children", "they were", "a child"), strict=True))


def members(family: str) -> list[tuple[str, float]]:
    """Return the behaviour ("" for a novice) of each child of a family, and its share of random moves."""
    parts = (part.rpartition(":") for part in family.split(","))
    return [(behaviour, float(epsilon)) for behaviour, _, epsilon in parts]


def family_name(family: str) -> str:
    """Return the name of a family; that of a single novice is the paper's."""
    if members(family) == [("", 1.0)]:
        return "random motion"
    counts = collections.Counter(f"{behaviour} {100 * epsilon:g} %".lstrip() for behaviour, epsilon in members(family))
    shares = [share if count == 1 else f"{count} x {share}" for share, count in counts.items()]
    return " and ".join(filter(None, (", ".join(shares[:-1]), shares[-1]))) + " random"


def in_lines(family: str) -> str:
    """Return the name of a family in lines, for below its bars."""
    first, _, last = family_name(family).rpartition(" ")
    if len(members(family)) > 1:
        tied = first.replace(" %", "\N{NO-BREAK SPACE}%")
        first = textwrap.fill(tied, _NARROW, break_long_words=False).replace("\N{NO-BREAK SPACE}", " ")
    return f"{first}\n{last}"


def number(value: float, digits: int = 1, sign: str = "-") -> str:
    """Return a number with a typographic minus, but none before a zero."""
    text = f"{value:{sign}.{digits}f}"
    if not float(text):
        text = text.lstrip("+-")
    return text.replace("-", "−")


def with_interval(
    row: dict[str, Any], key: str, digits: int = 1, sign: str = "-", between: str = " ", scale: float = 1.0
) -> str:
    """Return a number of the summary with its interval in brackets; unbounded ends are infinite."""
    if row.get(key) is None:
        return NONE
    stem = key.removesuffix("_mean")
    value, low, high = (row[name] for name in (key, f"{stem}_ci_low", f"{stem}_ci_high"))
    if bounds_nothing(low, high):
        return f"{number(scale * value, digits, sign)}{between}({TOO_FEW.replace(' for', f'{between}for')})"
    ends = (
        "−∞" if low is None else number(scale * low, digits, sign),
        "∞" if high is None else number(scale * high, digits, sign),
    )
    return f"{number(scale * value, digits, sign)}{between}[{', '.join(ends)}]"


def p_value(value: float | None) -> str:
    """Return a p as text, with meaningful digits."""
    if value is None:
        return "no p"
    if value < 0.001:
        return "p < 0.001"
    return f"p = {value:.3f}" if value < 0.1 else f"p = {value:.2f}"


def percent(share: float) -> str:
    """Return a change as a percentage, with its sign."""
    return f"{number(100 * share, 0, '+')} %" if np.isfinite(share) else NONE


@dataclasses.dataclass(frozen=True)
class Table:
    """A table of text, with row names in the first column."""

    title: str
    columns: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    note: str = ""

    @property
    def legend(self) -> str:
        """The note, with the meaning of brackets if there are any."""
        is_bracketed = any("[" in cell for row in self.rows for cell in row[1:])
        return f"{self.note} In brackets 95 % intervals.".lstrip() if is_bracketed else self.note

    def markdown(self) -> str:
        head, *rows = (f"| {' | '.join(map(markdown, row))} |" for row in (self.columns, *self.rows))
        rule = f"| {' | '.join(['---'] * len(self.columns))} |"
        note = [self.legend, ""] if self.legend else []
        return "\n".join([f"### {markdown(self.title)}", "", head, rule, *rows, "", *note])


@dataclasses.dataclass(frozen=True)
class Picture:
    """A figure with the name of its files and its caption."""

    name: str
    svg: bytes
    png: bytes
    caption: str

    @classmethod
    def of(cls, name: str, figure: Figure, caption: str) -> Picture:
        return cls(name, figure_style.as_bytes(figure, "svg"), figure_style.as_bytes(figure, "png"), caption)

    @property
    def data(self) -> str:
        return f"data:image/svg+xml;base64,{base64.b64encode(self.svg).decode()}"

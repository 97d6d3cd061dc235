"""Docstrings say what is returned without its type: keeps napoleon from taking what stands before a colon for one."""

from __future__ import annotations

import re

from sphinx.application import Sphinx

_COLON = "\N{SECTION SIGN}colon\N{SECTION SIGN}"  # stands for one while napoleon is at work
_BEFORE, _AFTER = 400, 600  # napoleon's priority is 500
_RETURNS = ("Returns:", "Yields:")
_INLINE = ("attribute", "data", "property")  # whose docstring napoleon reads like what is returned


def _hide(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    first = [0] if what in _INLINE and lines else []
    first += [number + 1 for number, line in enumerate(lines[:-1]) if line.strip() in _RETURNS]
    for number in first:
        parts = lines[number].split("`")  # every other one is code
        parts[::2] = [re.sub("(?<!:):(?!:)", _COLON, part) for part in parts[::2]]
        lines[number] = "`".join(parts)


def _show(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    lines[:] = [line.replace(_COLON, ":") for line in lines]


def setup(app: Sphinx) -> dict[str, bool]:
    """Goes to work before napoleon and after it."""
    app.connect("autodoc-process-docstring", _hide, priority=_BEFORE)
    app.connect("autodoc-process-docstring", _show, priority=_AFTER)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

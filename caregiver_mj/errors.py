"""Exceptions for invalid input, and checks of input."""

from __future__ import annotations

import math
import numbers
from collections.abc import Sequence
from typing import Any

LARGEST_SEED = 2**32 - 1  # of NumPy's `RandomState`


class CaregiverError(Exception):
    """Base class of all user errors."""


class FloorPlanError(CaregiverError):
    """A floor plan is malformed; the message names line and column.

    Attributes:
        problems: All problems; the first is the message.
        excerpts: Two lines of text for each problem, the plan's line and a mark below the column, or "".
    """

    def __init__(self, *problems: str, excerpts: Sequence[str] = ()):
        super().__init__(problems[0])
        self.problems = problems
        self.excerpts = tuple(excerpts) or ("",) * len(problems)

    def __reduce__(self) -> tuple[type[FloorPlanError], tuple[str, ...], dict[str, tuple[str, ...]]]:
        return type(self), self.problems, {"excerpts": self.excerpts}


class UnknownOptionError(CaregiverError, TypeError):
    """An option is unknown or missing."""


class RenderingError(CaregiverError):
    """Rendering is impossible: no OpenGL backend works, or the house has no visual geometry."""


class MissingExtraError(CaregiverError, ImportError):
    """An optional package is missing or too new; the message says what to install."""


def check_integer(what: str, value: Any, least: int, most: int | None = None) -> None:
    """Raise CaregiverError unless a value is an integer from `least` to `most`, if given."""
    if not isinstance(value, numbers.Integral) or int(value) < least or (most is not None and int(value) > most):
        room = f"of at least {least}" if most is None else f"from {least} to {most}"
        raise CaregiverError(f"{what} must be an integer {room}, got {value!r}")


def check_number(what: str, value: Any, least: float, most: float = math.inf) -> None:
    """Raise CaregiverError unless a value is a finite number from `least` to `most`."""
    is_number = isinstance(value, numbers.Real) and not isinstance(value, bool)
    if not (is_number and least <= value <= most and value < math.inf):
        room = f"{least:g} or more" if most == math.inf else f"in {least:g} to {most:.3g}"
        raise CaregiverError(f"{what} must be {room}, got {value!r}")


def check_kind(what: str, value: Any, *kinds: type, advice: str = "") -> None:
    """Raise CaregiverError unless a value has one of some types."""
    if not isinstance(value, kinds):
        names = " or ".join("None" if kind is type(None) else kind.__name__ for kind in kinds)
        raise CaregiverError(f"{what} must be a {names}, got {value!r}{advice}")

"""Exceptions that the package raises for input it cannot work with."""

from __future__ import annotations


class CaregiverError(Exception):
    """Base of every error that a user of the package can cause and mend."""


class FloorPlanError(CaregiverError):
    """A floor plan is malformed; the message names line and column.

    Attributes:
        problems: All that is wrong with it, the message first.
    """

    def __init__(self, *problems: str):
        super().__init__(problems[0])
        self.problems = problems

    def __reduce__(self) -> tuple[type[FloorPlanError], tuple[str, ...]]:
        return type(self), self.problems


class RenderingError(CaregiverError):
    """No OpenGL backend for offscreen rendering could be brought up."""


class MissingExtraError(CaregiverError, ImportError):
    """A package is not installed that only a part of this one needs; the message says which extra brings it."""

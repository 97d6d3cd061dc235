"""Searches that take long, spread over control timesteps.

A search is a generator that yields, after each piece of work, roughly what that took, and returns what it has found.
What it takes is not measured but stated: how far a search gets must not depend on how busy the machine is.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any, Generic, TypeVar

Found = TypeVar("Found")
Work = Generator[float, None, Found]  # yields milliseconds

_AT_ONCE = 12.0  # stated milliseconds of a search in a control timestep; the last piece of work may come on top


class Search(Generic[Found]):
    """A search under way.

    Attributes:
        ended: Whether it has come to its end.
        found: What it has found, if it has.
    """

    found: Found

    def __init__(self, begin: Callable[[], Work[Found]]):
        """Begins a search.

        Args:
            begin: Makes the generator; it must make the same one again, for pickles.
        """
        self._begin, self._work = begin, begin()
        self._pieces, self.ended = 0, False

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_work"}  # no generator can be pickled

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, _work=state["_begin"]())
        for _ in range(self._pieces):  # it is done again as far as it had got
            next(self._work)

    def go_on(self, milliseconds: float = _AT_ONCE) -> bool:
        """Searches for a while; returns whether it has come to its end."""
        while not self.ended and milliseconds > 0.0:
            try:
                milliseconds -= next(self._work)
                self._pieces += 1
            except StopIteration as end:
                self.found, self.ended = end.value, True
        return self.ended

"""Clocks for parts of a program."""

from __future__ import annotations

import contextlib
import functools
import time
from collections.abc import Callable, Iterator
from typing import Any, ClassVar, ParamSpec, TypeVar
from unittest import mock

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


class Clock:
    """Measures the time spent in functions. It stands still while another clock runs within them.

    Attributes:
        own: Seconds in all, without those of the clocks within.
        times: Seconds of every call, with them. Calls of the same clock within calls are none of their own.
    """

    _running: ClassVar[list[Clock]] = []

    def __init__(self, timer: Callable[[], float] = time.perf_counter):
        """Begins with nothing.

        Args:
            timer: What tells the time, in seconds.
        """
        self._timer = timer
        self.own = 0.0
        self.times: list[float] = []

    def around(self, function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
        """The same function, timed."""

        @functools.wraps(function)
        def timed(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
            if self in self._running:
                return function(*args, **kwargs)
            self._running.append(self)
            start = self._timer()
            try:
                return function(*args, **kwargs)
            finally:
                seconds = self._timer() - start
                self._running.pop()
                self.times.append(seconds)
                self.own += seconds
                if self._running:
                    self._running[-1].own -= seconds

        return timed

    @contextlib.contextmanager
    def of(self, owner: Any, *names: str) -> Iterator[Clock]:
        """Times methods of a class or of an object meanwhile."""
        with contextlib.ExitStack() as stack:
            for name in names:
                stack.enter_context(mock.patch.object(owner, name, self.around(getattr(owner, name))))
            yield self


def seconds_of(function: Callable[[], Any]) -> float:
    """Seconds that a call takes."""
    start = time.perf_counter()
    function()
    return time.perf_counter() - start

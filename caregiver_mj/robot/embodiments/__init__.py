"""The robots by name: the package's own, and those of other packages."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable
from typing import Any

from caregiver_mj.errors import CaregiverError
from caregiver_mj.registry import Registry, check_call, errors_of
from caregiver_mj.robot.embodiment import DEFAULT, Embodiment


class _Makers(Registry[Callable[[], Embodiment]]):
    """Functions that make embodiments, and read their models when called."""

    def check(self, name: str, value: str, found: Any) -> None:
        if not callable(found):
            raise CaregiverError(
                f"{self.what} '{name}' ({value}) must be a function that makes an Embodiment, got {found!r}"
            )
        check_call(f"{self.what} '{name}'", found)


def _maker(name: str, summary: str) -> Callable[[], Embodiment]:
    def make() -> Embodiment:  # imports its module, and with it MuJoCo, at the first call
        return getattr(importlib.import_module(f"{__name__}.{name}"), name)()

    make.__doc__ = summary
    return make


_OWN = {
    "mobile_fr3": "A base on steered wheels with an arm of the Franka Research 3's kinematics, of seven joints.",
    "mobile_ur5e": "A square base on omnidirectional wheels with an arm of the UR5e's kinematics, of six joints.",
}


EMBODIMENTS = _Makers(
    "robot",
    "caregiver_mj.embodiments",
    "caregiver_mj.robot.embodiment.Embodiment",
    {name: _maker(name, summary) for name, summary in _OWN.items()},
)


def find_embodiment(which: Embodiment | str | None = None) -> Embodiment:
    """Return a robot by name, cached; the default robot for None; an embodiment as it is.

    Raises:
        CaregiverError: There is no such robot, or it cannot be made.
    """
    if not isinstance(which, Embodiment | str | None):
        names = ", ".join(EMBODIMENTS)
        raise CaregiverError(f"robot must be a name ({names}) or an Embodiment, got {which!r}")
    return which if isinstance(which, Embodiment) else _made(DEFAULT if which is None else which)


@functools.cache
def _made(name: str) -> Embodiment:
    with errors_of(f"robot '{name}'", "as it was made"):
        made = EMBODIMENTS[name]()
    if not isinstance(made, Embodiment):
        raise CaregiverError(f"robot '{name}' must be an Embodiment, got {type(made).__name__}")
    return made

"""The robots by name: the package's own, and those of other packages."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

from caregiver_mj.errors import CaregiverError
from caregiver_mj.registry import Registry, check_call
from caregiver_mj.robot.embodiment import DEFAULT, Embodiment


class _Makers(Registry[Callable[[], Embodiment]]):
    """Functions that make embodiments, which read the models when they are called."""

    def check(self, name: str, value: str, found: Any) -> None:
        if not callable(found):
            raise CaregiverError(
                f"{self.what} '{name}' ({value}) must be a function that makes an Embodiment, got {found!r}"
            )
        check_call(f"{self.what} '{name}'", found)


# Each imports its module when it is called, and with it MuJoCo: their names do without.
def _mobile_fr3() -> Embodiment:
    from caregiver_mj.robot.embodiments.mobile_fr3 import mobile_fr3

    return mobile_fr3()


def _mobile_ur5e() -> Embodiment:
    from caregiver_mj.robot.embodiments.mobile_ur5e import mobile_ur5e

    return mobile_ur5e()


EMBODIMENTS = _Makers(
    "robot",
    "caregiver_mj.embodiments",
    "caregiver_mj.robot.embodiment.Embodiment",
    {"mobile_fr3": _mobile_fr3, "mobile_ur5e": _mobile_ur5e},
)


def find_embodiment(which: Embodiment | str | None = None) -> Embodiment:
    """Return a robot: the one of a name, made once; the default without one; or what is one already.

    Raises:
        CaregiverError: There is no such robot, or it cannot be made.
    """
    if not isinstance(which, Embodiment | str | None):
        names = ", ".join(EMBODIMENTS)
        raise CaregiverError(f"robot must be a name ({names}) or an Embodiment, got {which!r}")
    return which if isinstance(which, Embodiment) else _made(DEFAULT if which is None else which)


@functools.cache
def _made(name: str) -> Embodiment:
    made = EMBODIMENTS[name]()
    if not isinstance(made, Embodiment):
        raise CaregiverError(f"robot '{name}' must be an Embodiment, got {type(made).__name__}")
    return made

"""Versions of everything that results can depend on."""

from __future__ import annotations

import importlib.metadata
import platform

_LIBRARIES = ("numpy", "mujoco", "dm_control", "mink", "ruckig")


def versions() -> dict[str, str]:
    """The versions by name."""
    packages = {name: importlib.metadata.version(name) for name in ("caregiver_mj", *_LIBRARIES)}
    return {"caregiver_mj": packages.pop("caregiver_mj"), "python": platform.python_version(), **packages}

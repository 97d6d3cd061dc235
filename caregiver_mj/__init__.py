"""caregiver_mj: a caregiver robot in MuJoCo that makes a house safe for a toddler."""

from __future__ import annotations

import contextlib
import importlib
import importlib.metadata
from typing import TYPE_CHECKING, Any

from caregiver_mj.errors import CaregiverError, MissingExtraError

if TYPE_CHECKING:
    from caregiver_mj.plans.floor_plan import FloorPlan, house_names
    from caregiver_mj.policy.policy import CaregiverPolicy
    from caregiver_mj.tasks import ALL_TASKS, load

    __version__: str

__all__ = ["ALL_TASKS", "CaregiverError", "CaregiverPolicy", "FloorPlan", "__version__", "house_names", "load"]

# The first three need MuJoCo and dm_control, which take a second to import; a command that only looks at a plan does
# without, and one that only says what there is without the others.
_LAZY = {
    "ALL_TASKS": "caregiver_mj.tasks",
    "load": "caregiver_mj.tasks",
    "CaregiverPolicy": "caregiver_mj.policy.policy",
    "FloorPlan": "caregiver_mj.plans.floor_plan",
    "house_names": "caregiver_mj.plans.floor_plan",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return importlib.metadata.version("caregiver_mj")
    if name in _LAZY:
        return getattr(importlib.import_module(_LAZY[name]), name)
    raise AttributeError(f"module 'caregiver_mj' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})  # also what is not loaded yet


# Gymnasium finds environments by the module that registers them, so where it is installed this has to happen now.
with contextlib.suppress(MissingExtraError):
    importlib.import_module("caregiver_mj.envs")

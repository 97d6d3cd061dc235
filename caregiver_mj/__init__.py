"""caregiver_mj: a caregiver robot in MuJoCo that makes a house safe for a toddler."""

from __future__ import annotations

import importlib
import sys
from typing import TYPE_CHECKING, Any

from caregiver_mj.errors import CaregiverError

if TYPE_CHECKING:
    from caregiver_mj.plans.floor_plan import FloorPlan, house_names
    from caregiver_mj.policy.policy import CaregiverPolicy
    from caregiver_mj.tasks import ALL_TASKS, load

    __version__: str

__all__ = ["ALL_TASKS", "CaregiverError", "CaregiverPolicy", "FloorPlan", "__version__", "house_names", "load"]

# Imported on first use: the first three need MuJoCo and dm_control, which take a second to import.
_LAZY = {
    "ALL_TASKS": "caregiver_mj.tasks",
    "load": "caregiver_mj.experiments.score",  # `caregiver_mj.tasks.load` with a score
    "CaregiverPolicy": "caregiver_mj.policy.policy",
    "FloorPlan": "caregiver_mj.plans.floor_plan",
    "house_names": "caregiver_mj.plans.floor_plan",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return importlib.import_module("importlib.metadata").version("caregiver_mj")
    if name in _LAZY:
        return getattr(importlib.import_module(_LAZY[name]), name)
    raise AttributeError(f"module 'caregiver_mj' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})  # including names that are not imported yet


class _AlongWithGymnasium:
    """Registers the environments when Gymnasium is imported, instead of importing it here (.2 s)."""

    @classmethod
    def find_spec(cls, name: str, path: Any = None, target: Any = None) -> Any:
        if name != "gymnasium":
            return None
        others = (finder.find_spec(name, path, target) for finder in sys.meta_path if finder is not cls)
        spec: Any = next(filter(None, others), None)
        if spec is not None:
            execute = spec.loader.exec_module
            spec.loader.exec_module = lambda module: (execute(module), importlib.import_module("caregiver_mj.envs"))
        return spec


if sys.modules.get("gymnasium"):
    importlib.import_module("caregiver_mj.envs")
else:
    sys.meta_path.insert(0, _AlongWithGymnasium)

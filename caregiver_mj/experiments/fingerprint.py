"""What must be the same on every machine that works on a run: versions, and this package's own source."""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import pathlib
from collections.abc import Mapping

from caregiver_mj.experiments.versions import versions

_PLACES = ("caregiver_mj", "caregiver_mj.tasks", "caregiver_mj.models")  # in a checkout they lie apart
_KINDS = (".py", ".txt", ".xml")  # of files on which results can depend


@functools.cache
def fingerprint() -> dict[str, str]:
    """Versions by name, and a digest of the source: a checkout can differ from a release of the same version."""
    digest = hashlib.sha256()
    for name, path in sorted(_files().items()):
        digest.update(f"{name}\0{path.stat().st_size}\0".encode())
        digest.update(path.read_bytes())
    return {**versions(), "source": digest.hexdigest()[:12]}


def difference(found: Mapping[str, str | None], wanted: Mapping[str, str]) -> str:
    """What is not as wanted, in words; nothing if all is."""
    return ", ".join(
        f"{key} {found.get(key)} and not {value}" for key, value in wanted.items() if found.get(key) != value
    )


def _files() -> dict[str, pathlib.Path]:
    """All files on which results can depend, by their names in the installed package."""
    files = {}
    for place in _PLACES:
        spec = importlib.util.find_spec(place)  # imports none of it, for tasks bring MuJoCo
        for folder in (spec.submodule_search_locations or ()) if spec else ():
            for path in pathlib.Path(folder).rglob("*"):
                if path.suffix in _KINDS:
                    files[f"{place.replace('.', '/')}/{path.relative_to(folder).as_posix()}"] = path
    return files

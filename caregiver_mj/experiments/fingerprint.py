"""What rows depend on beside the settings: versions, and the package's own source."""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import pathlib
from collections.abc import Container, Iterable, Mapping

from caregiver_mj.experiments.origin import OWN, imported
from caregiver_mj.experiments.versions import versions

_PLACES = (OWN, f"{OWN}.tasks", f"{OWN}.models")  # in a checkout they lie apart
# What runs the episodes of an evaluation, and what others make caregivers of.
_EPISODES = (f"{OWN}.experiments.blocks", f"{OWN}.caregivers")
_MODELS = (".txt", ".xml")  # of files of models on which results can depend
_NOT_IN_GRID = frozenset(("house", "models", "policy", "robot", "tasks"))  # rooms
_SHOW = frozenset(("cli", "viz"))  # rooms that ask for episodes, and show what has come out of them


@functools.cache
def fingerprint() -> dict[str, str]:
    """Return what must be the same on every machine that works on a run: versions by name, and a digest of all files.

    A checkout can differ from a release of the same version.
    """
    return {**versions(), "source": _digest(_files())}


def difference(found: Mapping[str, str | None], wanted: Mapping[str, str]) -> str:
    """What is not as wanted, in words; nothing if all is."""
    return ", ".join(
        f"{key} {found.get(key)} and not {value}" for key, value in wanted.items() if found.get(key) != value
    )


@functools.cache
def source_digest(world: str = "house", modules: tuple[str, ...] = ()) -> str:
    """Return a digest of the package's own files that decide what comes out of an episode.

    They are the module that runs the episodes of an evaluation, what others make caregivers of, all that these import,
    wherever in them, and in the house the models.

    Args:
        world: "house", or "grid", on which no file of the robot and of MuJoCo's house has a bearing.
        modules: Full names of more modules that do so, and all that they import.
    """
    found = {name: path for name, path in _files().items() if path.suffix in _MODELS and world != "grid"}
    found |= _imported_by((*_EPISODES, *modules), _SHOW if world != "grid" else _SHOW | _NOT_IN_GRID)
    return _digest(found)


def _digest(files: Mapping[str, pathlib.Path]) -> str:
    digest = hashlib.sha256()
    for name, path in sorted(files.items()):
        digest.update(f"{name}\0{path.stat().st_size}\0".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _imported_by(modules: Iterable[str], without: Container[str]) -> dict[str, pathlib.Path]:
    """The files of modules, and of all of the package that they import, save that of some rooms."""
    found: dict[str, pathlib.Path] = {}
    new, seen = set(modules), set()
    while new:
        seen.add(name := new.pop())
        if name in _files():
            path = found[name] = _files()[name]
            imports = {other for other in imported(path.parent, path) if other.startswith(f"{OWN}.")}
            new |= {other for other in imports if other.split(".")[1] not in without} - seen
        elif "." in name:  # something in a module
            new |= {name.rpartition(".")[0]} - seen
    return found


@functools.cache
def _files() -> dict[str, pathlib.Path]:
    """The package's files: of modules by their full names, of models by where they are in the installed package."""
    files = {}
    for place in _PLACES:
        spec = importlib.util.find_spec(place)  # imports none of it, for tasks bring MuJoCo
        for folder in (spec.submodule_search_locations or ()) if spec else ():
            for path in pathlib.Path(folder).rglob("*"):
                parts = path.relative_to(folder).with_suffix("").parts
                if path.suffix == ".py":
                    files[".".join([place, *(parts[:-1] if parts[-1] == "__init__" else parts)])] = path
                elif path.suffix in _MODELS:
                    files["/".join([*place.split("."), *path.relative_to(folder).parts])] = path
    return files

"""What a run comes from: the version of the package and of what it needs, its source, and what plug-ins come from."""

from __future__ import annotations

import ast
import contextlib
import functools
import hashlib
import importlib.metadata
import importlib.util
import os
import pathlib
import platform
import sys
from collections.abc import Container, Iterable, Iterator, Mapping
from typing import Any

from caregiver_mj.caregivers.registry import find_caregiver
from caregiver_mj.children.child_group import CHILDREN, ChildGroup, ChildSpec
from caregiver_mj.errors import CaregiverError
from caregiver_mj.tasks import TASKS

_DIGITS = 16  # of a hash: more than enough to tell versions apart
OWN = __name__.partition(".")[0]  # the package itself
_INSTALLED = ("site-packages", "dist-packages")  # folders in which what lies beside a module is nobody's own
_PLACES = (OWN, f"{OWN}.tasks", f"{OWN}.models")  # in a checkout they lie apart
# What runs the episodes of an evaluation, and what others make caregivers of.
_EPISODES = (f"{OWN}.experiments.blocks", f"{OWN}.caregivers")
_MODELS = (".txt", ".xml")  # of files of models on which results can depend
_NOT_IN_GRID = frozenset(("house", "models", "policy", "robot", "tasks"))  # rooms
_SHOW = frozenset(("cli", "viz"))  # rooms that ask for episodes, and show what has come out of them
_LIBRARIES = ("numpy", "mujoco", "dm_control", "mink", "ruckig")


def origins(caregivers: Iterable[str], families: Iterable[ChildGroup], embodiment: str | None = None) -> dict[str, str]:
    """Return where the code of others comes from that episodes depend on, by what it is: see `origin`.

    The caregivers are names, as `find_caregiver` takes them; in the grid the embodiment is None.
    """
    found: dict[str, Any] = {f"caregiver {name}": find_caregiver(name) for name in caregivers}
    for child in (child for family in families for child in family.children):
        found[f"child {getattr(child, 'behaviour', child)}"] = (
            CHILDREN[child.behaviour] if isinstance(child, ChildSpec) else type(child)
        )
    if embodiment is not None:
        from caregiver_mj.robot.embodiments import EMBODIMENTS  # here, for the grid does without MuJoCo

        found[f"robot {embodiment}"] = EMBODIMENTS[embodiment]
    return {what: text for what, made in found.items() if made is not None and (text := origin(made))}


def origin(found: Any) -> str:
    """Return where somebody's class or function comes from, and a hash of all that it depends on.

    That is its module's own file, every source file of the package that it is in, and what these import from beside
    it, in folders without an `__init__.py` as well. What else its answers depend on, such as weights, it may name in an
    attribute `files`, a path or several, from the folder of its module on.

    Returns:
        The distribution and its version, or the file if there is none, and the hash; nothing of the package's own.

    Raises:
        CaregiverError: A file cannot be read.
    """
    name = getattr(found, "__module__", None) or type(found).__module__
    root = name.partition(".")[0]
    if root == OWN:
        return ""
    file = getattr(sys.modules.get(name), "__file__", None)
    if file is None:  # typed in at a prompt
        return root
    path = pathlib.Path(file).resolve()
    folder = path.parents[name.count(".") + (path.name == "__init__.py")] if root != "__main__" else path.parent
    module = path.stem if root == "__main__" else name
    files = getattr(found, "files", ())
    files = [files] if isinstance(files, str | os.PathLike) else files
    paths = sorted({*_sources(folder, module, path), *(path.parent / named for named in files)})
    digest = hashlib.sha256()
    try:
        for source in paths:
            content = source.read_bytes()
            digest.update(f"{source.name} {len(content)}\n".encode() + content)
    except OSError as error:
        raise CaregiverError(
            f"'{error.filename}', which '{name}' depends on, cannot be read: {error.strerror}"
        ) from None
    installed = _distributions().get(root)  # with what it was
    where = f"{installed[0]} {importlib.metadata.version(installed[0])}" if installed else path.name
    return f"{where}, sha256 {digest.hexdigest()[:_DIGITS]}"


def _sources(folder: pathlib.Path, name: str, path: pathlib.Path) -> set[pathlib.Path]:
    """The source files of a module that was imported from a folder and lies at a path, and of what it imports there."""
    found: set[pathlib.Path] = set()
    new = {path} | _files(folder, name)
    while new:
        found |= new
        if folder.name in _INSTALLED:
            break
        names = {name for source in new for name in imported(folder, source) if name.partition(".")[0] != OWN}
        new = {source for name in names for source in _files(folder, name)} - found
    return found


def _files(folder: pathlib.Path, name: str) -> set[pathlib.Path]:
    """The source files in a folder that a full name leads to: those of the first package on its way, or a module."""
    for part in name.split("."):
        module, folder = folder / f"{part}.py", folder / part
        if (folder / "__init__.py").is_file():
            return set(folder.rglob("*.py"))
        if module.is_file():
            return {module}
    return set()


def imported(folder: pathlib.Path, source: pathlib.Path) -> Iterator[str]:
    """Return the full names of what a source file imports, wherever in it, seen from a folder."""
    if source.suffix != ".py":
        return
    try:
        tree = ast.parse(source.read_bytes())
    except SyntaxError:  # it was imported, so it has been edited since
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = source.relative_to(folder).parts[: -node.level] if node.level else ()
            within = [*above, *filter(None, [node.module])]
            yield from (".".join([*within, alias.name]) for alias in node.names)


_distributions = functools.cache(importlib.metadata.packages_distributions)


@functools.cache
def fingerprint() -> dict[str, str]:
    """Return what must be the same on every machine that works on a run: versions by name, and a digest of all files.

    A checkout can differ from a release of the same version.
    """
    return {**versions(), "source": _digest(_package_files())}


def difference(found: Mapping[str, str | None], wanted: Mapping[str, str]) -> str:
    """Return what is not as wanted, in words; nothing if all is."""
    return ", ".join(
        f"{key} {found.get(key)} and not {value}" for key, value in wanted.items() if found.get(key) != value
    )


@functools.cache
def source_digest(world: str = "house", modules: tuple[str, ...] = ()) -> str:
    """Return a digest of the package's own files that decide what comes out of an episode.

    They are the module that runs the episodes of an evaluation, what others make caregivers of, more modules by their
    full names, all that these import, wherever in them, and in the house the models. On the grid no file of the robot
    and of MuJoCo's house has a bearing.
    """
    found = {name: path for name, path in _package_files().items() if path.suffix in _MODELS and world != "grid"}
    if world != "grid":
        modules = (*modules, *(str(task.kind).partition(":")[0] for task in TASKS.values()))
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
        if name in _package_files():
            path = found[name] = _package_files()[name]
            imports = {other for other in imported(path.parent, path) if other.startswith(f"{OWN}.")}
            new |= {other for other in imports if other.split(".")[1] not in without} - seen
        elif "." in name:  # something in a module
            new |= {name.rpartition(".")[0]} - seen
    return found


@functools.cache
def _package_files() -> dict[str, pathlib.Path]:
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


def versions() -> dict[str, str]:
    """Return the versions by name, of libraries that are installed; the grid does without dm_control."""
    found = {OWN: importlib.metadata.version(OWN), "python": platform.python_version()}
    for name in _LIBRARIES:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            found[name] = importlib.metadata.version(name)
    return found

"""The provenance of a run: versions of the package and its libraries, digests of its source and of plug-ins."""

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
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from typing import Any

from caregiver_mj.caregivers.registry import find_caregiver
from caregiver_mj.children.child_group import CHILDREN, ChildGroup, ChildSpec
from caregiver_mj.errors import CaregiverError
from caregiver_mj.tasks import TASKS

_DIGITS = 16  # digits of a hash, plenty to distinguish versions
OWN = __name__.partition(".")[0]  # name of the package
_INSTALLED = ("site-packages", "dist-packages")  # folders whose modules do not belong together
_PLACES = (OWN, f"{OWN}.tasks", f"{OWN}.models")  # separate folders in a checkout
_EPISODES = (f"{OWN}.experiments.runner", f"{OWN}.caregivers")  # run the episodes of an evaluation
_MODELS = (".txt", ".xml")  # suffixes of model files that can change results
_NOT_IN_GRID = frozenset(("house", "models", "policy", "robot", "tasks"))  # rooms without effect on the grid
_SHOW = frozenset(("cli", "viz"))  # rooms without effect on any row
_DOCUMENTED = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
_LIBRARIES = ("numpy", "mujoco", "dm_control", "mink", "ruckig")


def origins(caregivers: Iterable[str], families: Iterable[ChildGroup], embodiment: str | None = None) -> dict[str, str]:
    """Return the origin of all foreign code that episodes depend on, by its role: see `origin`.

    Caregivers are names, as `find_caregiver` takes them; in the grid the embodiment is None.
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
    """Return the distribution and version of a foreign class or function, or its file, and a hash; "" for our own.

    The hash covers its module, all source files of that module's package, and their imports from the folder beside it,
    also from packages without an `__init__.py`. An attribute `files` can name further files, such as weights: a path or
    several, relative to the folder of the module. An unreadable one raises CaregiverError.
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
    installed = _distributions().get(root)  # by top-level module
    where = f"{installed[0]} {importlib.metadata.version(installed[0])}" if installed else path.name
    return f"{where}, sha256 {digest.hexdigest()[:_DIGITS]}"


def _sources(folder: pathlib.Path, name: str, path: pathlib.Path) -> set[pathlib.Path]:
    """Return the source files of a module at a path, imported from a folder, and of its imports from there."""
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
    """Return the source files for a full name in a folder: all of the first package in it, or the module."""
    for part in name.split("."):
        module, folder = folder / f"{part}.py", folder / part
        if (folder / "__init__.py").is_file():
            return set(folder.rglob("*.py"))
        if module.is_file():
            return {module}
    return set()


def imported(folder: pathlib.Path, source: pathlib.Path) -> Iterator[str]:
    """Yield the full names that a source file imports at any level, relative to a folder."""
    yield from _imports(_tree(source), source.relative_to(folder).parts) if source.suffix == ".py" else ()


def _imports(tree: ast.Module, place: Sequence[str]) -> Iterator[str]:
    """Yield the full names that a module imports; `place` has the folders above it and its file."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = place[: -node.level] if node.level else ()
            within = [*above, *filter(None, [node.module])]
            yield from (".".join([*within, alias.name]) for alias in node.names)


_distributions = functools.cache(importlib.metadata.packages_distributions)


@functools.cache
def fingerprint() -> dict[str, str]:
    """Return versions and a digest of all files, which must be equal on every machine of a run.

    The digest distinguishes a checkout from a release of the same version.
    """
    return {**versions(), "source": _digest({name: path.read_bytes() for name, path in _package_files().items()})}


def difference(found: Mapping[str, str | None], wanted: Mapping[str, str]) -> str:
    """Return the differences in words, "" if there are none."""
    return ", ".join(
        f"{key} {found.get(key)} and not {value}" for key, value in wanted.items() if found.get(key) != value
    )


@functools.cache
def source_digest(world: str = "house", modules: tuple[str, ...] = ()) -> str:
    """Return a digest of the code that decides an episode, without comments, docstrings and layout.

    It covers `experiments.runner`, the caregivers, further `modules` by full name, all their imports at any level, and
    in the house the models. In the grid it leaves out the robot and the physical house.
    """
    models = {name: path for name, path in _package_files().items() if path.suffix in _MODELS and world != "grid"}
    if world != "grid":
        modules = (*modules, *(str(task.kind).partition(":")[0] for task in TASKS.values()))
    programs = _imported_by((*_EPISODES, *modules), _SHOW if world != "grid" else _SHOW | _NOT_IN_GRID)
    return _digest({name: path.read_bytes() for name, path in models.items()} | programs)


def code(path: pathlib.Path) -> bytes:
    """Return a module's syntax tree without comments, docstrings and layout, the same in all versions of Python."""
    return _text(_tree(path)).encode()


def _tree(path: pathlib.Path) -> ast.Module:
    """Return a module's syntax tree; if it is no program any more, that of its text."""
    source = path.read_bytes()
    try:
        return ast.parse(source)
    except SyntaxError:  # edited since it was imported
        return ast.parse(repr(source))


def _text(node: Any) -> str:
    """Return a syntax tree in text, without docstrings, and without what only some versions of Python have.

    Text at once: trees of tuples keep the garbage collector busy for most of a second.
    """
    if isinstance(node, list):
        return f"[{', '.join(map(_text, node))}]"
    if not isinstance(node, ast.AST):
        return repr(node)
    fields = []
    for name in node._fields:
        value = getattr(node, name, None)
        if isinstance(node, ast.JoinedStr):
            value = [part for part in node.values if getattr(part, "value", None) != ""]
        elif name == "body" and isinstance(node, _DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            value = node.body[1:]
        if value is not None and value != []:
            fields.append(f"('{name}', {_text(value)})")
    return f"('{type(node).__name__}', [{', '.join(fields)}])"


def _digest(contents: Mapping[str, bytes]) -> str:
    digest = hashlib.sha256()
    for name, content in sorted(contents.items()):
        digest.update(f"{name}\0{len(content)}\0".encode())
        digest.update(content)
    return digest.hexdigest()[:12]


def _imported_by(modules: Iterable[str], without: Container[str]) -> dict[str, bytes]:
    """Return the `code` of modules and of all modules of the package that they import, except some rooms."""
    found: dict[str, bytes] = {}
    new, seen = set(modules), set()
    while new:
        seen.add(name := new.pop())
        if name in _package_files():
            path = _package_files()[name]
            tree = _tree(path)
            found[name] = _text(tree).encode()
            imports = {other for other in _imports(tree, (path.name,)) if other.startswith(f"{OWN}.")}
            new |= {other for other in imports if other.split(".")[1] not in without} - seen
        elif "." in name:  # something in a module
            new |= {name.rpartition(".")[0]} - seen
    return found


@functools.cache
def _package_files() -> dict[str, pathlib.Path]:
    """Return the package's files: modules by full name, models by their place in the installed package."""
    files = {}
    for place in _PLACES:
        spec = importlib.util.find_spec(place)  # without importing it: tasks import MuJoCo
        for folder in (spec.submodule_search_locations or ()) if spec else ():
            for path in pathlib.Path(folder).rglob("*"):
                parts = path.relative_to(folder).with_suffix("").parts
                if path.suffix == ".py":
                    files[".".join([place, *(parts[:-1] if parts[-1] == "__init__" else parts)])] = path
                elif path.suffix in _MODELS:
                    files["/".join([*place.split("."), *path.relative_to(folder).parts])] = path
    return files


def versions() -> dict[str, str]:
    """Return the versions of Python, the package and installed libraries; the grid does not need dm_control."""
    found = {OWN: importlib.metadata.version(OWN), "python": platform.python_version()}
    for name in _LIBRARIES:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            found[name] = importlib.metadata.version(name)
    return found

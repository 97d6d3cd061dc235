"""Whose code a run depends on, beside the package's own: what it came with, and a hash of its source."""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib.metadata
import os
import pathlib
import sys
from collections.abc import Iterable, Iterator
from typing import Any

from caregiver_mj.caregivers.registry import find_caregiver
from caregiver_mj.children.family import CHILDREN, ChildSpec, Family
from caregiver_mj.errors import CaregiverError

_DIGITS = 16  # of a hash: more than enough to tell versions apart
OWN = __name__.partition(".")[0]  # the package itself
_INSTALLED = ("site-packages", "dist-packages")  # folders in which what lies beside a module is nobody's own


def origins(caregivers: Iterable[str], families: Iterable[Family], embodiment: str | None = None) -> dict[str, str]:
    """Where the code of others comes from that episodes depend on, by what it is: see `origin`.

    Args:
        caregivers: Names, as `find_caregiver` takes them.
        families: The children.
        embodiment: Name of the robot; None in the grid.
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
    """Where somebody's class or function comes from, and a hash of all that it depends on.

    That is its module's own file, every source file of the package that it is in, and what these import from beside
    it, in folders without an `__init__.py` as well. What else its answers depend on, such as weights, it may name in an
    attribute `files`, a path or several, from the folder of its module on.

    Args:
        found: Something with a `__module__`.

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
    return f"{_distribution(root) or path.name}, sha256 {digest.hexdigest()[:_DIGITS]}"


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
    """Full names of what a source file imports, wherever in it, seen from a folder."""
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


def _distribution(root: str) -> str:
    """What a package or module was installed with."""
    names = _distributions().get(root)
    return f"{names[0]} {importlib.metadata.version(names[0])}" if names else ""


@functools.cache
def _distributions() -> dict[str, list[str]]:
    return dict(importlib.metadata.packages_distributions())

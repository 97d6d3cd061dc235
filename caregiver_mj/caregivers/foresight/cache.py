"""Results of long computations, in the user's cache folder."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import pathlib
import pickle
import sys
import tempfile
from collections.abc import Callable
from typing import TypeVar

import numpy as np
import scipy

#: Environment variable: the folder, or nothing for no cache.
FOLDER = "CAREGIVER_MJ_CACHE"
LARGEST = 1_000_000_000  # bytes of all files; the ones that were used longest ago go first
_ROOMS = ("caregivers", "children", "danger", "interventions", "plans")  # whose code decides the results
_OWN = "value_tables"  # folder within that; nothing else is kept in it, or removed
_Made = TypeVar("_Made")


def cached(key: str, make: Callable[[], _Made]) -> _Made:
    """Return what `make` returns, from a file if one has the same key and was written by the same code.

    A folder that cannot be written is no error. Like all of a user's files, those in it are trusted.
    """
    usual = os.path.expanduser(os.path.join(os.environ.get("XDG_CACHE_HOME") or "~/.cache", "caregiver_mj"))
    folder = os.environ.get(FOLDER, usual)
    if not folder or folder.startswith("~"):  # for there is no home
        return make()
    path = pathlib.Path(folder, _OWN, hashlib.sha256((_code() + key).encode()).hexdigest() + ".pickle")
    with contextlib.suppress(Exception):  # there is none, or it is damaged
        found: _Made = pickle.loads(path.read_bytes())
        with contextlib.suppress(OSError):  # it may be another user's
            os.utime(path)
        return found
    made = make()
    with contextlib.suppress(OSError):
        _store(path, made)
    return made


def _store(path: pathlib.Path, made: object) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as file:
        try:
            pickle.dump(made, file, pickle.HIGHEST_PROTOCOL)
            file.close()
            os.replace(file.name, path)  # another process reads all of it, or nothing
        except BaseException:
            os.unlink(file.name)
            raise
    total = 0
    for kept in sorted(path.parent.glob("*.p*"), key=os.path.getmtime, reverse=True):
        total += kept.stat().st_size
        if total > LARGEST:
            kept.unlink()


@functools.cache
def _code() -> str:
    """Return a digest of the code that decides the results, and of what runs it."""
    package = pathlib.Path(__file__).parents[2]
    digest = hashlib.sha256(f"{sys.version} {np.__version__} {scipy.__version__}".encode())
    for file in sorted(file for room in _ROOMS for file in (package / room).rglob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()

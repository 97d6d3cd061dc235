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

#: Environment variable with the cache folder; empty for no cache.
FOLDER = "CAREGIVER_MJ_CACHE"
LARGEST = 1_000_000_000  # bytes of all files; beyond that the least recently used are removed
_ROOMS = ("caregivers", "children", "danger", "interventions", "plans")  # rooms whose code affects the results
_OWN = "value_tables"  # subfolder of the cache; only its files are removed
_Made = TypeVar("_Made")


def cached(key: str, make: Callable[[], _Made]) -> _Made:
    """Return `make()`, or its result from a file with the same key, written by the same code.

    A folder that cannot be written is no error. Files in it are unpickled, and so trusted like all files of a user.
    """
    usual = os.path.expanduser(os.path.join(os.environ.get("XDG_CACHE_HOME") or "~/.cache", "caregiver_mj"))
    folder = os.environ.get(FOLDER, usual)
    if not folder or folder.startswith("~"):  # no home directory
        return make()
    path = pathlib.Path(folder, _OWN, hashlib.sha256((_code() + key).encode()).hexdigest() + ".pickle")
    with contextlib.suppress(Exception):  # missing or damaged
        found: _Made = pickle.loads(path.read_bytes())
        with contextlib.suppress(OSError):  # another user's file
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
            os.replace(file.name, path)  # atomic for other processes
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
    """Return a digest of the code that affects the results, and of the versions of Python, NumPy and SciPy."""
    package = pathlib.Path(__file__).parents[2]
    digest = hashlib.sha256(f"{sys.version} {np.__version__} {scipy.__version__}".encode())
    for file in sorted(file for room in _ROOMS for file in (package / room).rglob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()

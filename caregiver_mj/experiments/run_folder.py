"""The folder of an evaluation on disk.

It holds::

    run.json            settings and versions; a resumed run must have the same, or more episodes or caregivers
    episodes/*.json     finished episodes, a file a block
    episodes.parquet    all episodes of a finished run, a row each
    summary.json        means, comparisons and verdicts
    maps.parquet        where children went and were hurt, a row a free cell
    houses.parquet      the means in each house, and whether a caregiver does harm there

A run that is killed at any time leaves whole files, and can be resumed.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import pathlib
import sys
import weakref
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from caregiver_mj.errors import CaregiverError
from caregiver_mj.outside import LARGEST_JSON, parse_json, plain, read_file
from caregiver_mj.recording.record import COLUMNS

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

if TYPE_CHECKING:
    import pandas as pd  # imported where used: workers do without


Result = dict[str, Any]  # result of a block, as JSON: its "rows", and "maps" by name
_FOLDERS = ("episodes", "exchanges")  # which hold files only
_FILES = (".lock", "run.json", "episodes.parquet", "summary.json", "maps.parquet", "houses.parquet")
_LONGEST = 200  # bytes of the name of a block's file; file systems permit 255
Record = dict[str, Any]  # record of a run, as JSON
_CHECKED_APART = ("file", "caregivers", "episodes", "code", "source", "extended_at")  # all other keys must be equal
_LONGEST_VALUE, _LONGEST_REASON = 200, 300  # characters in a message: of a value, and of a library's error
_CHANGED = "the {} has changed, from {} to {}; put it back, or take another folder"


class StorageError(CaregiverError):
    """A result could not be written; earlier files are whole."""


def check_folder(path: str | os.PathLike[str]) -> None:
    """Raise CaregiverError if reading or writing a run's folder, perhaps a stranger's, would go through a link."""
    folder = pathlib.Path(path)

    def check(kind: str, fits: Callable[[pathlib.Path], bool], places: Iterable[pathlib.Path]) -> None:
        for there in places:
            if there.is_symlink() or (there.exists() and not fits(there)):
                raise CaregiverError(f"'{there}' must be a {kind}, got another thing or a link: take another folder")

    check("folder", pathlib.Path.is_dir, [folder / name for name in _FOLDERS])
    check("file", pathlib.Path.is_file, [folder / name for name in _FILES])
    check("file", pathlib.Path.is_file, (there for name in _FOLDERS for there in (folder / name).glob("*")))


class RunFolder:
    """The results of one run in its folder `path`, which is locked against other processes."""

    def __init__(self, path: str | os.PathLike[str], settings: dict[str, Any], *, resume: bool = False):
        """Create the folder, or with `resume` open that of an earlier run, perhaps to add episodes or caregivers.

        The settings are all that the results depend on, as JSON.

        Raises:
            CaregiverError: The folder cannot be written, has links, holds a run without `resume`, or one with other
                settings.
        """
        self.path = pathlib.Path(path)
        self._episodes = self.path / "episodes"
        if not os.fspath(path):
            raise CaregiverError("the output folder must have a name, got an empty one")
        record = self.path / "run.json"
        try:
            check_folder(path)
            self._episodes.mkdir(parents=True, exist_ok=True)
            self._lock = _lock(self.path)  # before touching files that another run may be writing
            for leftover in [*self.path.glob("*.tmp"), *self._episodes.glob("*.tmp")]:
                leftover.unlink()
            write_whole(self._episodes / "probe.tmp", b"")
            (self._episodes / "probe.tmp").unlink()
            found = read_json(record) if record.exists() else None
        except (OSError, StorageError) as error:
            raise CaregiverError(f"output folder '{path}' cannot be written: {_reason(error)}") from None
        except ValueError as error:
            raise CaregiverError(f"'{record}' cannot be read as the record of a run: {error}") from None
        if found is not None and not isinstance(found, dict):
            raise CaregiverError(f"'{record}' must be the record of a run, got one without settings")
        if found is None:
            if next(self._episodes.glob("*.json"), None):
                raise CaregiverError(
                    f"output folder '{path}' holds episodes, but no run.json that says of which run: take another one"
                )
            found = settings
            write_whole(record, _as_json(settings))
        elif not resume:
            raise CaregiverError(
                f"output folder '{path}' already holds a run: continue it, or add episodes or caregivers, with --resume"
            )
        else:
            found = self._resume(found, json.loads(_as_json(settings)))
        #: Numbers of episodes that the run had before more were added
        self.extended_at: list[int] = found.get("extended_at", [])

    def _resume(self, found: dict[str, Any], wanted: dict[str, Any]) -> dict[str, Any]:
        """Update the folder to the wanted settings, and return its record."""
        try:
            new = resumed_record(found, wanted)
        except CaregiverError as error:
            raise CaregiverError(f"output folder '{self.path}' holds a run of other settings: {error}") from None
        if new is not found:
            try:
                (self.path / "summary.json").unlink(missing_ok=True)  # which would mark the run as finished
            except OSError as error:
                raise StorageError(f"'{error.filename}' cannot be removed: {error.strerror}") from error
            write_whole(self.path / "run.json", _as_json(new))
        return new

    def read(self, block: str) -> Result | None:
        """Return the result of a finished block, or None."""
        return read_block(self.path, block)

    def write(self, block: str, result: Result) -> None:
        """Write the result of a finished block."""
        write_whole(block_file(self.path, block), _as_json(result, indent=None))

    def finish(self, episodes: pd.DataFrame, summary: dict[str, Any], maps: pd.DataFrame, houses: pd.DataFrame) -> None:
        """Write the results of the run; the summary, which marks it as finished, comes last."""
        write_whole(self.path / "houses.parquet", houses.to_parquet(index=False))
        import pyarrow as pa

        types = {"str": pa.string(), "int": pa.int64(), "float": pa.float64(), "list[float]": pa.list_(pa.float64())}
        known = {column.name: types[column.type] for column in COLUMNS}  # also for an empty table
        schema = pa.schema([(name, known[name]) for name in episodes.columns])
        write_whole(self.path / "episodes.parquet", episodes.to_parquet(index=False, schema=schema))
        write_whole(self.path / "maps.parquet", maps.to_parquet(index=False))
        write_whole(self.path / "summary.json", _as_json(summary))


def read_block(folder: pathlib.Path, block: str) -> Result | None:
    """Return the result of a finished block in a run's folder, or None."""
    try:
        result = read_json(block_file(folder, block))
    except (OSError, ValueError):
        return None
    return result if isinstance(result, dict) else None  # versions without maps wrote a list of rows


def block_file(folder: pathlib.Path, block: str) -> pathlib.Path:
    """Return the file of a block's result in a run's folder."""
    block = block.replace("/", "%2F")  # in addresses
    if sys.platform == "win32":
        block = block.replace(":", "%3A")  # separates a file from its stream
    name = block.encode()
    if len(name) > _LONGEST:
        block = f"{name[:_LONGEST].decode(errors='ignore')}_{hashlib.sha256(name).hexdigest()[:16]}"
    return folder / "episodes" / f"{block}.json"


def read_json(path: pathlib.Path) -> Any:
    """Return the content of a JSON file; raise ValueError if it is invalid."""
    return parse_json(read_file(path, LARGEST_JSON))


class _Lock:
    """Locks a folder for its lifetime; raises BlockingIOError if another process has locked it."""

    def __init__(self, folder: pathlib.Path):
        self._file = open(folder / ".lock", "ab")  # noqa: SIM115 (open for as long as the lock is held)
        try:
            if sys.platform == "win32":
                msvcrt.locking(self._file.fileno(), msvcrt.LK_NBLCK, 1)
            else:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno in (errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK):
                self._file.close()
                raise BlockingIOError(errno.EWOULDBLOCK, "in use") from None
            # Other errors come from file systems without locks.


_locks: weakref.WeakValueDictionary[pathlib.Path, _Lock] = weakref.WeakValueDictionary()  # of this process, by folder


def _lock(folder: pathlib.Path) -> _Lock:
    """Return this process's lock of a folder, which all its runs there share."""
    path = folder.resolve()
    if (lock := _locks.get(path)) is None:
        try:
            lock = _locks[path] = _Lock(path)
        except BlockingIOError:
            raise CaregiverError(
                f"output folder '{folder}' is in use by another process: wait until it ends, or take another folder"
            ) from None
    return lock


def _as_json(value: Any, indent: int | None = 1) -> bytes:
    return (json.dumps(value, indent=indent, allow_nan=False) + "\n").encode()


def write_whole(path: pathlib.Path, content: bytes) -> None:
    """Write a file whole or not at all: to a file beside it, flushed to disk, then renamed."""
    temporary = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    try:
        with open(temporary, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise StorageError(f"'{path}' cannot be written: {_reason(error)}") from error


def _reason(error: Exception) -> str:
    """Return the operating system's reason for an error."""
    cause = error.__cause__ if isinstance(error.__cause__, OSError) else error
    return getattr(cause, "strerror", None) or str(cause)


def in_short(error: Exception) -> str:
    """Return a library's error as one short line, because a stranger's file may be quoted in it."""
    return plain(error, _LONGEST_REASON) or type(error).__name__


def resumed_record(found: Record, wanted: Record) -> Record:
    """Return the record of a run resumed with the same settings, or more episodes or caregivers.

    Its `extended_at` lists the earlier numbers of episodes, so that grid blocks do not repeat finished ones.

    Raises:
        CaregiverError: The settings differ, or the folder has more episodes or caregivers than wanted.
    """
    keys = unlike(found, wanted, _CHECKED_APART)
    if "caregivers" not in wanted:  # a study, which cannot be extended
        if wrong := describe_differences(keys, found, wanted) or _other_code(found, wanted):
            raise CaregiverError("; ".join(wrong))
        return found
    if "caregivers" not in found:
        raise CaregiverError("its run.json must be the record of a run, got none: take another folder")
    if "pooled" in found:
        raise CaregiverError("it holds pooled runs: resume each of them, and pool them again")
    there, here = found.get("caregivers"), wanted["caregivers"]
    if not isinstance(there, list) or not all(name in here for name in there):
        keys.append("caregivers")
    episodes = found.get("episodes")
    if not isinstance(episodes, int) or episodes > wanted["episodes"]:
        keys.append("episodes")
    if wrong := describe_differences(keys, found, wanted) or _other_code(found, wanted):
        less = "; a run can be added to, but not cut" if keys and {*keys} <= {"caregivers", "episodes"} else ""
        raise CaregiverError("; ".join(wrong) + less)
    extended = extended_at(found, wanted["episodes"])
    if there == here and episodes == wanted["episodes"]:
        return found
    return {**wanted, **({"extended_at": extended} if extended else {})}


def extended_at(found: Mapping[str, Any], wanted: int) -> list[int]:
    """Return the numbers of episodes that a run had before each extension, up to those wanted."""
    before = found.get("extended_at", [])
    if isinstance(before, list) and all(isinstance(step, int) for step in before):
        steps = [0, *before, *sorted({found["episodes"], wanted})]
        if steps == sorted(set(steps)):
            return steps[1:-1]
    raise CaregiverError(f"extended_at must be increasing numbers of episodes, got {before}")


def unlike(one: Record, other: Record, but: Sequence[str]) -> list[str]:
    """Return the keys that differ in two records, except those in `but`, and in the grid the robot."""
    if one.get("world") == other.get("world") == "grid":
        but = (*but, "embodiment")
    return [key for key in {**one, **other} if key not in but and one.get(key) != other.get(key)]


def describe_differences(
    keys: Sequence[str], found: Record, wanted: Record, where: tuple[str, str] = ("there", "here")
) -> list[str]:
    """Return a line for each key that differs in two records; `where` names the two."""
    lines = []
    for key in keys:
        there, here = found.get(key), wanted.get(key)
        if isinstance(there, dict) and isinstance(here, dict):  # such as versions
            differ = [name for name in {**there, **here} if there.get(name) != here.get(name)]
            there, here = ({name: values.get(name) for name in differ} for values in (there, here))
        elif key == "plans" and isinstance(there, list) and isinstance(here, list):
            there, here = (
                " ".join(str(plan.get("name") if isinstance(plan, dict) else plan) for plan in plans)
                for plans in (there, here)
            )
            if there == here:
                lines.append(f"the floor plans of {here} are others {where[0]} than {where[1]}")
                continue
            key = "houses"
        texts = [str(value) for value in (there, here)]
        there, here = (text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]} ..." for text in texts)
        lines.append(f"{key} is {there} {where[0]} and {here} {where[1]}")
    return lines


def _other_code(found: Record, wanted: Record) -> list[str]:
    there, here = (record.get("source") for record in (found, wanted))
    lines = [] if there == here else [_CHANGED.format("source of caregiver_mj that decides rows", there, here)]
    there, here = (record.get("code") or {} for record in (found, wanted))
    if not isinstance(there, dict):
        return [*lines, f"code is {there} there and {here} here"]
    added = {f"caregiver {name}" for name in wanted.get("caregivers", ()) if name not in found.get("caregivers", ())}
    differ = [what for what in {**there, **here} if there.get(what) != here.get(what) and what not in added]
    return lines + [_CHANGED.format(what, there.get(what), here.get(what)) for what in differ]

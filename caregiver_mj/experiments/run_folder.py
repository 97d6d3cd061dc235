"""The folder of an evaluation on disk.

It holds::

    run.json            settings and versions; a run is only continued under the same ones
    episodes/*.json     finished episodes, a file a block
    episodes.parquet    all of them, a row an episode, once the run is finished
    summary.json        the table
    maps.parquet        where children went and were hurt, a row a free cell
    houses.parquet      of a run in several houses: the means in each of them

Whatever kills a run, what is in its folder is whole and can be continued.
"""

from __future__ import annotations

import json
import os
import pathlib
from typing import TYPE_CHECKING, Any

from caregiver_mj.errors import CaregiverError
from caregiver_mj.recording.record import COLUMNS

if TYPE_CHECKING:
    import pandas as pd  # imported where used: workers do without
    import pyarrow as pa

Row = dict[str, Any]
Result = dict[str, Any]  # of a block, as JSON: its "rows", and "maps" by name


class StorageError(CaregiverError):
    """A result could not be written; what was written before is whole."""


class RunFolder:
    """The results of one run."""

    def __init__(self, path: str | os.PathLike[str], settings: dict[str, Any], *, resume: bool = False):
        """Creates the folder, or opens the one of an earlier run.

        Args:
            path: Where it is, or shall be.
            settings: Everything that the results depend on, as JSON.
            resume: Whether to continue the run that is there.

        Raises:
            CaregiverError: The folder cannot be written, holds a run that is not to be continued, or one of
                other settings.
        """
        self.path = pathlib.Path(path)
        self._episodes = self.path / "episodes"
        if not os.fspath(path):
            raise CaregiverError("the output folder's name is empty")
        record = self.path / "run.json"
        try:
            self._episodes.mkdir(parents=True, exist_ok=True)
            for leftover in [*self.path.glob("*.tmp"), *self._episodes.glob("*.tmp")]:
                leftover.unlink()
            _write(self._episodes / "probe.tmp", b"")
            (self._episodes / "probe.tmp").unlink()
            found = json.loads(record.read_text("utf-8")) if record.exists() else None
        except (OSError, StorageError) as error:
            raise CaregiverError(f"output folder '{path}' cannot be written: {_reason(error)}") from None
        except ValueError as error:
            raise CaregiverError(f"'{record}' is not the record of a run: {error}") from None
        if found is not None and not isinstance(found, dict):
            raise CaregiverError(f"'{record}' is not the record of a run: it holds no settings")
        if found is None:
            if next(self._episodes.glob("*.json"), None):
                raise CaregiverError(
                    f"output folder '{path}' holds episodes, but no run.json that says of which run: take another one"
                )
            _write(record, _as_json(settings))
        elif not resume:
            raise CaregiverError(f"output folder '{path}' already holds a run: continue it with --resume")
        elif difference := _difference(found, json.loads(_as_json(settings))):
            raise CaregiverError(f"output folder '{path}' holds a run of other settings: {difference}")

    def read(self, block: str) -> Result | None:
        """What a finished block came to, or None."""
        try:
            result = json.loads((self._episodes / f"{block}.json").read_text("utf-8"))
        except (OSError, ValueError):
            return None
        return result if isinstance(result, dict) else None  # before there were maps, it was the rows alone

    def write(self, block: str, result: Result) -> None:
        """Puts a finished block on disk at once."""
        _write(self._episodes / f"{block}.json", _as_json(result, indent=None))

    def finish(
        self, episodes: pd.DataFrame, summary: dict[str, Any], maps: pd.DataFrame, houses: pd.DataFrame | None = None
    ) -> None:
        """Writes the results of the whole run; the summary comes last, for it says that the run is finished."""
        if houses is not None:
            _write(self.path / "houses.parquet", houses.to_parquet(index=False))
        _write(self.path / "episodes.parquet", episodes.to_parquet(index=False, schema=_schema(episodes)))
        _write(self.path / "maps.parquet", maps.to_parquet(index=False))
        _write(self.path / "summary.json", _as_json(summary))


def _schema(episodes: pd.DataFrame) -> pa.Schema:
    """Types of the columns, as `COLUMNS` has them, however few episodes there are."""
    import pyarrow as pa

    types = {"str": pa.string(), "int": pa.int64(), "float": pa.float64(), "list[float]": pa.list_(pa.float64())}
    known = {column.name: types[column.type] for column in COLUMNS}
    return pa.schema([(name, known[name]) for name in episodes.columns])


def _as_json(value: Any, indent: int | None = 1) -> bytes:
    return (json.dumps(value, indent=indent, allow_nan=False) + "\n").encode()


def _write(path: pathlib.Path, content: bytes) -> None:
    """Writes a file whole or not at all: to a file beside it, flushed to disk, then renamed."""
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
    """The operating system's words for what went wrong."""
    cause = error.__cause__ if isinstance(error.__cause__, OSError) else error
    return getattr(cause, "strerror", None) or str(cause)


def _difference(found: dict[str, Any], wanted: dict[str, Any]) -> str:
    keys = [key for key in {**found, **wanted} if found.get(key) != wanted.get(key) and key != "file"]
    return "; ".join(f"{key} is {found.get(key)} there and {wanted.get(key)} here" for key in keys)

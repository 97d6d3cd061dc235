"""Which files there are, and how large they become."""

from __future__ import annotations

import dataclasses
import pathlib

VERSION = "v3.0"
FILES_IN_CHUNK = 1000
DATA_MEGABYTES, VIDEO_MEGABYTES = 100, 200  # from which on the next episode goes into another file
INFO, STATS, TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
EPISODES = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"


@dataclasses.dataclass(frozen=True)
class Shard:
    """One of the files that episodes share."""

    number: int = 0

    @property
    def place(self) -> dict[str, int]:
        """Its chunk, and its number in that."""
        chunk, file = divmod(self.number, FILES_IN_CHUNK)
        return {"chunk_index": chunk, "file_index": file}

    def path(self, root: pathlib.Path, template: str, **names: str) -> pathlib.Path:
        """Where it is; its folder is made."""
        path = root / template.format(**self.place, **names)
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def columns(self, what: str) -> dict[str, int]:
        """How the table of the episodes names it."""
        return {f"{what}/{key}": value for key, value in self.place.items()}

    def next(self) -> Shard:
        """The one after it."""
        return Shard(self.number + 1)

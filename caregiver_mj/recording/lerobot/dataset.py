"""The writer of the whole folder, and of its films."""

from __future__ import annotations

import contextlib
import json
import pathlib
import shutil
from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from caregiver_mj.errors import CaregiverError
from caregiver_mj.recording.lerobot import layout
from caregiver_mj.recording.lerobot.layout import IMAGES, VIDEO, Shard, columns, features, table
from caregiver_mj.recording.steps import About, Steps
from caregiver_mj.recording.video import video_writer

_BYTES_A_PIXEL = 0.1  # in the file, about; how large that is while it is being written, nobody can tell


def write_lerobot(
    folder: pathlib.Path,
    episodes: Iterable[Steps],
    about: About,
    megabytes: tuple[float, float] = (layout.DATA_MEGABYTES, layout.VIDEO_MEGABYTES),
) -> None:
    """Write a data set; it is there when it is whole, and only then.

    Args:
        folder: Its folder, which must not exist.
        episodes: At least one, all alike in what they hold; they are read one after the other.
        about: What the data set says of itself.
        megabytes: Of a file of rows and of a film, from which on the next episode goes into another one.

    Raises:
        CaregiverError: There are no whole steps a second, so that there can be no film of them.
    """
    check_rate(about.rate)
    unfinished = folder.with_name(f".{folder.name}.tmp")
    shutil.rmtree(unfinished, ignore_errors=True)
    with contextlib.closing(_Writer(unfinished, about, *megabytes)) as writer:
        for episode in episodes:
            writer.add(episode)
    unfinished.replace(folder)


def check_rate(rate: float) -> None:
    """Raise CaregiverError unless there are whole steps a second."""
    if rate < 1 or abs(rate - round(rate)) > 1e-9:
        raise CaregiverError(f"steps a second must be a whole number for LeRobot, got {rate:.3g}: take another format")


class _Writer:
    """Writes one episode after the other, and on closing what is said of them all."""

    def __init__(self, root: pathlib.Path, about: About, data_megabytes: float, video_megabytes: float):
        self._root, self._about, self._rate = root, about, round(about.rate)
        self._most_bytes, self._film_bytes = data_megabytes * 1e6, video_megabytes * 1e6
        self._features: dict[str, dict[str, Any]] = {}
        self._films: dict[str, Film] = {}
        self._rows: list[dict[str, Any]] = []  # one an episode
        self._stats: list[dict[str, layout.Stats]] = []
        self._shard, self._bytes, self._count = Shard(), 0, 0
        self._data: pq.ParquetWriter | None = None

    def add(self, episode: Steps) -> None:
        """Write an episode."""
        if not self._features:
            self._features = features(episode, self._about)
            self._films = {
                name: Film(self._root, IMAGES + name, self._rate, self._film_bytes) for name in episode.frames
            }
        values = columns(episode, self._count, self._rate)
        self._add_rows(table(values))
        row = {
            "episode_index": episode.number,
            "tasks": [self._about.task],
            "length": len(episode),
            "dataset_from_index": self._count,
            "dataset_to_index": self._count + len(episode),
            **self._shard.columns("data"),
            **Shard().columns("meta/episodes"),
            "seed": episode.seed,
            "terminated": episode.terminated,
            "diverged": episode.diverged,
        }
        found = {name: layout.of_values(column) for name, column in values.items()}
        for name, film in self._films.items():
            frames = episode.frames[name][: len(episode)]
            row |= film.add(frames)
            found[IMAGES + name] = layout.of_frames(frames)
        self._rows.append(row)
        self._stats.append(found)
        self._count += len(episode)

    def _add_rows(self, rows: pa.Table) -> None:
        """Write the rows of an episode, together, to the present file, or to another if that has become large."""
        if self._data is not None and self._bytes > self._most_bytes:
            self._data.close()
            self._data, self._shard, self._bytes = None, Shard(self._shard.number + 1), 0
        if self._data is None:
            self._data = pq.ParquetWriter(self._shard.path(self._root, layout.DATA), rows.schema)
        self._data.write_table(rows, row_group_size=len(rows))
        self._bytes += rows.nbytes

    def close(self) -> None:
        """Write what is said of all episodes."""
        for film in self._films.values():
            film.close()
        if self._data is None:
            return
        self._data.close()
        episodes = [
            row | {f"stats/{name}/{what}": value for name, column in found.items() for what, value in column.items()}
            for row, found in zip(self._rows, self._stats, strict=True)
        ]
        listed = [
            {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in row.items()}
            for row in episodes
        ]
        pq.write_table(pa.Table.from_pylist(listed), Shard().path(self._root, layout.EPISODES))
        tasks = pd.DataFrame({"task_index": [0]}, index=pd.Index([self._about.task], name="task"))
        tasks.to_parquet(self._root / layout.TASKS)
        whole = {name: layout.together([found[name] for found in self._stats]) for name in self._stats[0]}
        self._write_json(layout.STATS, whole)
        self._write_json(layout.INFO, self._info())

    def _info(self) -> dict[str, Any]:
        count = len(self._rows)
        return {
            "codebase_version": layout.VERSION,
            "robot_type": self._about.robot or None,
            "total_episodes": count,
            "total_frames": self._count,
            "total_tasks": 1,
            "chunks_size": layout.FILES_IN_CHUNK,
            "data_files_size_in_mb": layout.DATA_MEGABYTES,
            "video_files_size_in_mb": layout.VIDEO_MEGABYTES,
            "fps": self._rate,
            "splits": {"train": f"0:{count}"},
            "data_path": layout.DATA,
            "video_path": layout.VIDEO if self._films else None,
            "features": self._features,
        }

    def _write_json(self, name: str, content: Any) -> None:
        (self._root / name).write_text(
            json.dumps(content, indent=4, default=np.ndarray.tolist) + "\n", encoding="utf-8"
        )


class Film:
    """The films of one camera, one after the other."""

    def __init__(self, root: pathlib.Path, key: str, rate: int, most_bytes: float):
        self._root, self._key, self._rate, self._most_bytes = root, key, rate, most_bytes
        self._shard, self._frames = Shard(), 0
        self._writer: Any = None

    def add(self, frames: np.ndarray) -> dict[str, float]:
        """Append the frames (n, height, width, 3) of an episode; return where they are, as columns."""
        height, width = frames.shape[1:3]
        if self._frames * height * width * _BYTES_A_PIXEL > self._most_bytes:
            self.close()
            self._shard, self._frames = Shard(self._shard.number + 1), 0
        if self._writer is None:
            path = self._shard.path(self._root, VIDEO, video_key=self._key)
            # Every other frame can be understood by itself, and none needs a later one.
            self._writer = video_writer(path, width, height, self._rate, "-g", "2", "-bf", "0")
        for frame in frames:
            self._writer.send(np.ascontiguousarray(frame))
        first, self._frames = self._frames, self._frames + len(frames)
        name = f"videos/{self._key}"
        return {
            **self._shard.columns(name),
            f"{name}/from_timestamp": first / self._rate,
            f"{name}/to_timestamp": self._frames / self._rate,
        }

    def close(self) -> None:
        """Finish the present film."""
        if self._writer is not None:
            self._writer.close()
            self._writer = None

"""Write episodes as a LeRobot data set, version 3 of its format, without LeRobot's package.

Episodes share files: rows in Parquet, one for each step; frames in MP4, one for each row. Tables assign rows and
seconds of video to episodes.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import pathlib
import shutil
from collections.abc import Iterable, Sequence
from typing import Any

import imageio.v2
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from caregiver_mj.errors import CaregiverError
from caregiver_mj.recording.steps import About, Steps

VERSION = "v3.0"
FILES_IN_CHUNK = 1000
DATA_MEGABYTES, VIDEO_MEGABYTES = 100, 200  # size of a file beyond which the next episode begins another
INFO, STATS, TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
EPISODES = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
IMAGES = "observation.images."  # prefix of a camera's name
# Types of columns: of a step's outcome, and required ones.
_TYPES = {
    "next.reward": "float32", "next.cost": "float32", "next.damage": "float32", "next.strikes": "int64",
    "next.done": "bool", "next.truncated": "bool", "intervention": "int64",
    "timestamp": "float32", "frame_index": "int64", "episode_index": "int64", "index": "int64", "task_index": "int64",
}  # fmt: skip
Stats = dict[str, np.ndarray]  # statistics of one column
_QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
_FRAMES = 100  # frames of an episode used for statistics
_BYTES_A_PIXEL = 0.1  # estimated size in the video file, which is unknown while it is being written


def write_lerobot(
    folder: pathlib.Path,
    episodes: Iterable[Steps],
    about: About,
    megabytes: tuple[float, float] = (DATA_MEGABYTES, VIDEO_MEGABYTES),
) -> None:
    """Write a data set of one episode or more into a new folder, whole or not at all.

    After a file of rows or of videos exceeds its `megabytes`, the next episode begins another file.

    Raises:
        CaregiverError: The steps per second are no whole number, as video requires.
    """
    check_rate(about.rate)
    unfinished = folder.with_name(f".{folder.name}.tmp")
    shutil.rmtree(unfinished, ignore_errors=True)
    with contextlib.closing(_Writer(unfinished, about, *megabytes)) as writer:
        for episode in episodes:
            writer.add(episode)
    unfinished.replace(folder)


def check_rate(rate: float) -> None:
    """Raise CaregiverError unless the steps per second are a whole number."""
    if rate < 1 or abs(rate - round(rate)) > 1e-9:
        raise CaregiverError(f"steps a second must be a whole number for LeRobot, got {rate:.3g}: take another format")


class _Writer:
    """Writes episodes one after the other, and the metadata on closing."""

    def __init__(self, root: pathlib.Path, about: About, data_megabytes: float, video_megabytes: float):
        self._root, self._about, self._rate = root, about, round(about.rate)
        self._most_bytes, self._video_bytes = data_megabytes * 1e6, video_megabytes * 1e6
        self._features: dict[str, dict[str, Any]] = {}
        self._films: dict[str, CameraVideos] = {}
        self._rows: list[dict[str, Any]] = []  # one an episode
        self._stats: list[dict[str, Stats]] = []
        self._shard, self._bytes, self._count = Shard(), 0, 0
        self._data: pq.ParquetWriter | None = None

    def add(self, episode: Steps) -> None:
        """Write an episode."""
        if not self._features:
            self._features = features(episode, self._about)
            self._films = {
                name: CameraVideos(self._root, IMAGES + name, self._rate, self._video_bytes) for name in episode.frames
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
        numbers = {name: column.reshape(len(column), -1).astype(float) for name, column in values.items()}
        found = {name: _stats(column, len(column)) for name, column in numbers.items()}
        for name, film in self._films.items():
            frames = episode.frames[name][: len(episode)]
            row |= film.add(frames)
            found[IMAGES + name] = of_frames(frames)
        self._rows.append(row)
        self._stats.append(found)
        self._count += len(episode)

    def _add_rows(self, rows: pa.Table) -> None:
        """Write the rows of an episode to the present file, or to another if it is full."""
        if self._data is not None and self._bytes > self._most_bytes:
            self._data.close()
            self._data, self._shard, self._bytes = None, Shard(self._shard.number + 1), 0
        if self._data is None:
            self._data = pq.ParquetWriter(self._shard.path(self._root, DATA), rows.schema)
        self._data.write_table(rows, row_group_size=len(rows))
        self._bytes += rows.nbytes

    def close(self) -> None:
        """Write the metadata."""
        for film in self._films.values():
            film.close()
        if self._data is None:
            return
        self._data.close()
        for row, found in zip(self._rows, self._stats, strict=True):
            for name, column in found.items():
                row |= {f"stats/{name}/{what}": value.tolist() for what, value in column.items()}
        pq.write_table(pa.Table.from_pylist(self._rows), Shard().path(self._root, EPISODES))
        tasks = pd.DataFrame({"task_index": [0]}, index=pd.Index([self._about.task], name="task"))
        tasks.to_parquet(self._root / TASKS)
        whole = {name: together([found[name] for found in self._stats]) for name in self._stats[0]}
        self._write_json(STATS, whole)
        self._write_json(INFO, self._info())

    def _info(self) -> dict[str, Any]:
        count = len(self._rows)
        return {
            "codebase_version": VERSION,
            "robot_type": self._about.robot or None,
            "total_episodes": count,
            "total_frames": self._count,
            "total_tasks": 1,
            "chunks_size": FILES_IN_CHUNK,
            "data_files_size_in_mb": DATA_MEGABYTES,
            "video_files_size_in_mb": VIDEO_MEGABYTES,
            "fps": self._rate,
            "splits": {"train": f"0:{count}"},
            "data_path": DATA,
            "video_path": VIDEO if self._films else None,
            "features": self._features,
        }

    def _write_json(self, name: str, content: Any) -> None:
        (self._root / name).write_text(
            json.dumps(content, indent=4, default=np.ndarray.tolist) + "\n", encoding="utf-8"
        )


class CameraVideos:
    """The video files of one camera."""

    def __init__(self, root: pathlib.Path, key: str, rate: int, most_bytes: float):
        self._root, self._key, self._rate, self._most_bytes = root, key, rate, most_bytes
        self._shard, self._frames = Shard(), 0
        self._writer: Any = None

    def add(self, frames: np.ndarray) -> dict[str, float]:
        """Append the frames (n, height, width, 3) of an episode; return their place, as columns."""
        height, width = frames.shape[1:3]
        if self._frames * height * width * _BYTES_A_PIXEL > self._most_bytes:
            self.close()
            self._shard, self._frames = Shard(self._shard.number + 1), 0
        if self._writer is None:
            path = self._shard.path(self._root, VIDEO, video_key=self._key)
            # Key frames every 2, and no B-frames, for random access.
            params = ["-preset", "veryfast", "-crf", "20", "-g", "2", "-bf", "0"]
            self._writer = imageio.v2.get_writer(
                path,
                "FFMPEG",
                codec="libx264",
                fps=self._rate,
                quality=None,
                macro_block_size=2,
                ffmpeg_log_level="error",
                output_params=params,
            )
        for frame in frames:
            self._writer.append_data(frame)
        first, self._frames = self._frames, self._frames + len(frames)
        name = f"videos/{self._key}"
        return {
            **self._shard.columns(name),
            f"{name}/from_timestamp": first / self._rate,
            f"{name}/to_timestamp": self._frames / self._rate,
        }

    def close(self) -> None:
        """Finish the present file."""
        if self._writer is not None:
            self._writer.close()
            self._writer = None


# -- Its folders, its features, and their statistics --------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Shard:
    """A file that episodes share."""

    number: int = 0

    @property
    def place(self) -> dict[str, int]:
        """Chunk, and number within it."""
        chunk, file = divmod(self.number, FILES_IN_CHUNK)
        return {"chunk_index": chunk, "file_index": file}

    def path(self, root: pathlib.Path, template: str, **names: str) -> pathlib.Path:
        """Return its path, after making the folder."""
        path = root / template.format(**self.place, **names)
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def columns(self, what: str) -> dict[str, int]:
        """Return its place as columns of the table of episodes."""
        return {f"{what}/{key}": value for key, value in self.place.items()}


def features(episode: Steps, about: About) -> dict[str, dict[str, Any]]:
    """Return the description of the columns for `meta/info.json`."""
    state = [
        name
        for key, values in episode.observations.items()
        for name in ([key] if values[0].size == 1 else [f"{key}_{i}" for i in range(values[0].size)])
    ]
    described: dict[str, dict[str, Any]] = {
        "observation.state": {"dtype": "float32", "shape": [len(state)], "names": state},
        "action": {"dtype": "float32", "shape": [episode.actions.shape[1]], "names": list(about.actions)},
    }
    for camera, frames in episode.frames.items():
        height, width, channels = frames.shape[1:]
        described[IMAGES + camera] = {
            "dtype": "video",
            "shape": [height, width, channels],
            "names": ["height", "width", "channels"],
            "info": {
                "video.height": height, "video.width": width, "video.codec": "h264", "video.pix_fmt": "yuv420p",
                "video.is_depth_map": False, "video.fps": round(about.rate), "video.channels": channels,
                "has_audio": False,
            },
        }  # fmt: skip
    for name, kind in _TYPES.items():
        described[name] = {"dtype": kind, "shape": [1], "names": None}
    return described


def columns(episode: Steps, first: int, rate: float) -> dict[str, np.ndarray]:
    """Return the columns of an episode's rows, (n,) or (n, values) each; `first` is the number of the first row."""
    count = len(episode)
    frame = np.arange(count)
    last = frame == count - 1
    state = [values[:-1].reshape(count, -1) for values in episode.observations.values()]
    found = {
        "observation.state": np.concatenate(state, axis=1),
        "action": episode.actions,
        "next.reward": episode.rewards,
        "next.cost": episode.costs,
        "next.damage": episode.damage,
        "next.strikes": episode.strikes,
        "next.done": last,
        "next.truncated": last & (not episode.terminated),
        "intervention": episode.interventions,
        "timestamp": frame / rate,
        "frame_index": frame,
        "episode_index": np.full(count, episode.number),
        "index": first + frame,
        "task_index": np.zeros(count),
    }
    return {name: values.astype(_TYPES.get(name, "float32")) for name, values in found.items()}


def table(values: dict[str, np.ndarray]) -> pa.Table:
    """Return columns as a table."""
    arrays = {name: pa.array(column.ravel()) for name, column in values.items()}
    for name, column in values.items():
        if column.ndim > 1:
            arrays[name] = pa.FixedSizeListArray.from_arrays(arrays[name], column.shape[1])
    return pa.table(arrays)


def of_frames(frames: np.ndarray) -> Stats:
    """Return the statistics of a sample of frames (n, height, width, 3): colours from 0 to 1, (3, 1, 1) each."""
    which = np.unique(np.linspace(0, len(frames) - 1, _FRAMES).astype(int))
    pixels = frames[which].reshape(-1, frames.shape[-1]) / 255.0
    found = _stats(pixels, len(which))
    return {name: value if name == "count" else value.reshape(-1, 1, 1) for name, value in found.items()}


def together(parts: Sequence[Stats]) -> Stats:
    """Return the statistics of several episodes together; quantiles are approximate: means, as in LeRobot."""
    counts = np.array([part["count"][0] for part in parts])
    share = counts / counts.sum()

    def mean(values: list[np.ndarray]) -> np.ndarray:
        return np.tensordot(share, np.stack(values), axes=1)

    centre = mean([part["mean"] for part in parts])
    spread = mean([part["std"] ** 2 + (part["mean"] - centre) ** 2 for part in parts])
    return {
        "min": np.min([part["min"] for part in parts], axis=0),
        "max": np.max([part["max"] for part in parts], axis=0),
        "mean": centre,
        "std": np.sqrt(spread),
        "count": np.array([counts.sum()]),
        **{name: mean([part[name] for part in parts]) for name in _QUANTILES},
    }


def _stats(values: np.ndarray, count: int) -> Stats:
    quantiles = np.quantile(values, list(_QUANTILES.values()), axis=0)
    return {
        "min": values.min(axis=0),
        "max": values.max(axis=0),
        "mean": values.mean(axis=0),
        "std": values.std(axis=0),
        "count": np.array([count]),
        **dict(zip(_QUANTILES, quantiles, strict=True)),
    }

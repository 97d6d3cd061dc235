"""A LeRobot data set: its folders, its features, and their statistics."""

from __future__ import annotations

import dataclasses
import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from caregiver_mj.recording.steps import About, Steps

VERSION = "v3.0"
FILES_IN_CHUNK = 1000
DATA_MEGABYTES, VIDEO_MEGABYTES = 100, 200  # from which on the next episode goes into another file
INFO, STATS, TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
EPISODES = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
IMAGES = "observation.images."  # before the name of a camera
_COUNTERS = {  # which every data set has
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
_OUTCOMES = {  # of a step
    "next.reward": "float32",
    "next.cost": "float32",
    "next.damage": "float32",
    "next.strikes": "int64",
    "next.done": "bool",
    "next.truncated": "bool",
    "intervention": "int64",
}
_TYPES = {"float32": pa.float32(), "int64": pa.int64(), "bool": pa.bool_()}
Stats = dict[str, np.ndarray]  # of one column
_QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
_FRAMES = 100  # of a film that are looked at


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
        """Return where it is; its folder is made."""
        path = root / template.format(**self.place, **names)
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def columns(self, what: str) -> dict[str, int]:
        """Return how the table of the episodes names it."""
        return {f"{what}/{key}": value for key, value in self.place.items()}


def features(episode: Steps, about: About) -> dict[str, dict[str, Any]]:
    """Describe the columns, as `meta/info.json` has them."""
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
                "video.height": height,
                "video.width": width,
                "video.codec": "h264",
                "video.pix_fmt": "yuv420p",
                "video.is_depth_map": False,
                "video.fps": round(about.rate),
                "video.channels": channels,
                "has_audio": False,
            },
        }
    for name, kind in {**_OUTCOMES, **_COUNTERS}.items():
        described[name] = {"dtype": kind, "shape": [1], "names": None}
    return described


def columns(episode: Steps, first: int, rate: float) -> dict[str, np.ndarray]:
    """Return the values of an episode's rows, (n,) or (n, values) each, from number `first` in the data set on."""
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
    kinds = {"observation.state": "float32", "action": "float32", **_OUTCOMES, **_COUNTERS}
    return {name: values.astype(kinds[name]) for name, values in found.items()}


def table(values: dict[str, np.ndarray]) -> pa.Table:
    """Return the same as a table."""
    arrays = {}
    for name, column in values.items():
        kind = _TYPES[str(column.dtype)]
        if column.ndim == 1:
            arrays[name] = pa.array(column, kind)
        else:
            arrays[name] = pa.FixedSizeListArray.from_arrays(pa.array(column.ravel(), kind), column.shape[1])
    return pa.table(arrays)


def of_values(values: np.ndarray) -> Stats:
    """Return those of a column (n,) or (n, values), over its rows."""
    values = values.reshape(len(values), -1).astype(float)
    return _stats(values, len(values))


def of_frames(frames: np.ndarray) -> Stats:
    """Return those of a film's colours (n, height, width, 3), from 0 to 1, (3, 1, 1) each, from some of its frames."""
    which = np.unique(np.linspace(0, len(frames) - 1, _FRAMES).astype(int))
    pixels = frames[which].reshape(-1, frames.shape[-1]) / 255.0
    found = _stats(pixels, len(which))
    return {name: value if name == "count" else value.reshape(-1, 1, 1) for name, value in found.items()}


def together(parts: Sequence[Stats]) -> Stats:
    """Return those of several episodes; quantiles are means of theirs, as LeRobot makes them, so only nearly right."""
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

"""What a row holds: the columns, by the names that LeRobot's learners look for, and their values."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyarrow as pa

from caregiver_mj.recording.about import About
from caregiver_mj.recording.steps import Steps

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


def features(episode: Steps, about: About) -> dict[str, dict[str, Any]]:
    """Describes the columns, as `meta/info.json` has them."""
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
    """The values of an episode's rows, films aside: (n,) or (n, values) each.

    Args:
        episode: The episode.
        first: Number of its first row in the data set.
        rate: Rows a second.
    """
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
    """The same as a table."""
    arrays = {}
    for name, column in values.items():
        kind = _TYPES[str(column.dtype)]
        if column.ndim == 1:
            arrays[name] = pa.array(column, kind)
        else:
            arrays[name] = pa.FixedSizeListArray.from_arrays(pa.array(column.ravel(), kind), column.shape[1])
    return pa.table(arrays)

"""Films that many episodes share: H.264 that can be entered at any frame."""

from __future__ import annotations

import pathlib
from typing import Any

import imageio_ffmpeg
import numpy as np

from caregiver_mj.recording.lerobot.layout import VIDEO, Shard

_BYTES_A_PIXEL = 0.1  # in the file, about; how large that is while it is being written, nobody can tell


class Film:
    """The films of one camera, one after the other."""

    def __init__(self, root: pathlib.Path, key: str, rate: int, most_bytes: float):
        self._root, self._key, self._rate, self._most_bytes = root, key, rate, most_bytes
        self._shard, self._frames = Shard(), 0
        self._writer: Any = None

    def add(self, frames: np.ndarray) -> dict[str, float]:
        """Appends the frames (n, height, width, 3) of an episode; returns where they are, as columns."""
        height, width = frames.shape[1:3]
        if self._frames * height * width * _BYTES_A_PIXEL > self._most_bytes:
            self.close()
            self._shard, self._frames = self._shard.next(), 0
        if self._writer is None:
            path = self._shard.path(self._root, VIDEO, video_key=self._key)
            self._writer = _writer(path, width, height, self._rate)
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
        """Finishes the present film."""
        if self._writer is not None:
            self._writer.close()
            self._writer = None


def _writer(path: pathlib.Path, width: int, height: int, rate: int) -> Any:
    """Takes frames for a file. Every other frame can be understood by itself, and none needs a later one."""
    writer = imageio_ffmpeg.write_frames(
        str(path),
        (width, height),
        fps=rate,
        codec="libx264",
        quality=None,
        macro_block_size=2,
        ffmpeg_log_level="error",
        output_params=["-preset", "veryfast", "-crf", "20", "-g", "2", "-bf", "0"],
    )
    writer.send(None)
    return writer

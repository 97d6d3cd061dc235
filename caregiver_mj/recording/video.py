"""Video files."""

from __future__ import annotations

import pathlib
from collections.abc import Generator

import imageio_ffmpeg
import numpy as np

# x264's quality (lower is better), and how much it works for a small file.
_QUALITY, _PRESET = "20", "veryfast"


def video_writer(
    path: pathlib.Path, width: int, height: int, fps: float, *options: str
) -> Generator[None, np.ndarray, None]:
    """Return a generator that writes the frames (height, width, 3) of `send` to a file; `close` completes it."""
    writer = imageio_ffmpeg.write_frames(
        str(path),
        (width, height),
        fps=fps,
        codec="libx264",
        quality=None,
        macro_block_size=2,
        ffmpeg_log_level="error",
        output_params=["-preset", _PRESET, "-crf", _QUALITY, *options],
    )
    writer.send(None)
    return writer

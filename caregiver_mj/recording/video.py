"""Video files."""

from __future__ import annotations

import pathlib
from typing import Any

import imageio.v2

# x264's quality (lower is better), and how much it works for a small file.
_QUALITY, _PRESET = "20", "veryfast"


def video_writer(path: pathlib.Path, fps: float, *options: str) -> Any:
    """Return imageio's writer of frames, uint8 (height, width, 3), with further options of ffmpeg."""
    params = ["-preset", _PRESET, "-crf", _QUALITY, *options]
    return imageio.v2.get_writer(
        path, "FFMPEG", fps=fps, quality=None, macro_block_size=2, ffmpeg_log_level="error", output_params=params
    )

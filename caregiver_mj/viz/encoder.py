"""Films as files: H.264 in MP4."""

from __future__ import annotations

import contextlib
import os
import pathlib
import tempfile
from collections.abc import Callable, Generator, Iterator

import imageio_ffmpeg
import numpy as np

from caregiver_mj.errors import CaregiverError, check_kind

# x264's quality (lower is better), and how much it works for a small file.
_QUALITY, _PRESET = "20", "veryfast"


@contextlib.contextmanager
def film_writer(path: pathlib.Path, width: int, height: int, fps: float) -> Iterator[Callable[[np.ndarray], None]]:
    """Gives a function to hand frames (height, width, 3) to. The file appears when the film is complete, and only then.

    Raises:
        CaregiverError: It could not be written.
    """
    unfinished = path.with_name(f".{path.name}.part.mp4")
    writer = None

    def write(frame: np.ndarray) -> None:
        nonlocal writer
        if writer is None:  # not before: one that never gets a frame complains when it is closed
            writer = _writer(unfinished, width, height, fps)
        writer.send(np.ascontiguousarray(frame))

    try:
        yield write
        if writer is None:
            raise CaregiverError(f"'{path}' would be a film without a picture")
        writer.close()
        unfinished.replace(path)
    except OSError as error:
        raise CaregiverError(f"'{path}' cannot be written: {error}") from None
    finally:
        if writer is not None:
            writer.close()
        unfinished.unlink(missing_ok=True)


def _writer(path: pathlib.Path, width: int, height: int, fps: float) -> Generator[None, np.ndarray, None]:
    """Takes frames for a file."""
    writer = imageio_ffmpeg.write_frames(
        str(path),
        (width, height),
        fps=fps,
        codec="libx264",
        quality=None,
        macro_block_size=2,
        ffmpeg_log_level="error",
        output_params=[
            *("-preset", _PRESET, "-crf", _QUALITY, "-movflags", "+faststart"),
            # Without this, players take the colours for those of high definition while they are not.
            *("-vf", "scale=out_color_matrix=bt709:out_range=tv"),
            *("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"),
        ],
    )
    writer.send(None)
    return writer


def writable(path: str | os.PathLike[str], suffix: str) -> pathlib.Path:
    """The path, once it is sure that a file of that kind can be written there.

    Raises:
        CaregiverError: It cannot.
    """
    check_kind("a file", path, str, os.PathLike)
    path = pathlib.Path(path)
    if path.suffix.lower() != suffix:
        raise CaregiverError(f"'{path}' must be called FILE{suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path.parent):
            pass
        folder = path.is_dir()  # which also says so if the name is too long
    except OSError as error:
        raise CaregiverError(f"'{path}' cannot be written: {error.strerror}") from None
    if folder:
        raise CaregiverError(f"'{path}' cannot be written: it is a folder")
    return path

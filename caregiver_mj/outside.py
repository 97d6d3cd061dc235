"""Untrusted files and text: limits that hold before anything is unpacked, and text that is safe to print.

A run folder, a submission, a floor plan or an answer may come from a stranger. All limits are far above the package's
own output.
"""

from __future__ import annotations

import contextlib
import errno
import json
import math
import os
import re
import stat
import sys
from collections.abc import Iterator
from typing import Any, NoReturn

MB = 10**6  # bytes
LARGEST_SUBMISSION = 500 * MB  # packed size; 10,000 episodes in the house have 100 MB
LARGEST_UNPACKED = 2_000 * MB  # unpacked size of a submission; 100,000 episodes in the grid have 300 MB
LARGEST_RATIO = 200  # unpacked over packed size; JSON of equal rows reaches 40, zeros 1,000
MOST_PARTS = 200_000  # files in a submission, one a block; each takes 1 kB of memory
LARGEST_JSON = 32 * MB  # JSON text, whose objects may take 12 times the memory; a block of 1,000 episodes has 4 MB
MOST_BRACKETS = 500_000  # lists and objects in a JSON text: "[]," of 3 bytes takes 64 in memory
LARGEST_TABLE = 500 * MB  # parquet file; enough for the 10 million episodes of the largest run
LARGEST_PIECE = 64 * MB  # unpacked size that is allowed for any file
LARGEST_ARRAYS = 64 * MB  # a caregiver's answers as arrays; 1,000 episodes have 8 MB
MOST_NUMBERS = 10**7  # numbers in one of these arrays; a length of 0 counts as 1, because empty rows take memory, too
LARGEST_PLAN = MB  # file with a floor plan
MOST_CELLS = 10_000  # cells of a floor plan, 75 m x 75 m; ten times as many take 10 s and a hundred times the memory
LONGEST_LINE = 1_000  # characters of a message

_TAG = re.compile(r"<(?=[A-Za-z/!?])")  # start of an HTML tag, unlike "< 5 %"
_IN_MARKDOWN = str.maketrans({"|": "/", "`": "'"})


def read_file(path: str | os.PathLike[str], most: int) -> bytes:
    """Return the content of a regular file; a link counts as the file that it leads to.

    Args:
        path: The file. A device or a named pipe, which would wait for a writer, is refused without opening it.
        most: Greatest number of bytes.

    Raises:
        OSError: The file is not regular, is larger, or cannot be read.
        ValueError: The path is invalid.
    """
    _check_regular(os.stat(path), path, most)
    # Non-blocking, because the path may have become a pipe since.
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    with open(os.open(path, flags), "rb") as file:
        _check_regular(os.fstat(file.fileno()), path, most)
        content = file.read(most + 1) or b""
    if len(content) > most:  # it has grown, or states no size, as in /proc
        _raise_too_large(path, most)
    return content


def _check_regular(status: os.stat_result, path: str | os.PathLike[str], most: int) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
    if not stat.S_ISREG(status.st_mode):
        raise OSError(errno.EINVAL, "not a regular file", os.fspath(path))
    if status.st_size > most:
        _raise_too_large(path, most)


def _raise_too_large(path: str | os.PathLike[str], most: int) -> NoReturn:
    raise OSError(errno.EFBIG, f"it must have at most {most:,} bytes, got more", os.fspath(path))


@contextlib.contextmanager
def limited_memory(most: int) -> Iterator[None]:
    """Limit memory in this context, on Linux, so that unpacking more than `most` bytes raises MemoryError.

    A file may unpack to more than it states.
    """
    if not sys.platform.startswith("linux"):
        yield
        return
    import resource  # not on Windows

    before, hard = resource.getrlimit(resource.RLIMIT_DATA)
    with open("/proc/self/status", "rb") as file:
        (used,) = (int(line.split()[1]) * 1024 for line in file if line.startswith(b"VmData"))
    wanted = used + 2 * most  # for the library's data and the result
    resource.setrlimit(resource.RLIMIT_DATA, (min(wanted, before) if before >= 0 else wanted, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (before, hard))


def parse_json(content: bytes | str) -> Any:
    """Parse a JSON text.

    Raises:
        ValueError: It is too large, has too many lists and objects, is too deeply nested, has a number that is not
            finite, or is no JSON in UTF-8.
    """
    if len(content) > LARGEST_JSON:
        raise ValueError(f"a JSON text must have at most {LARGEST_JSON:,} bytes, got {len(content):,}")
    text = content if isinstance(content, str) else content.decode()
    if (brackets := text.count("[") + text.count("{")) > MOST_BRACKETS:
        raise ValueError(f"a JSON text must have at most {MOST_BRACKETS:,} lists and objects, got {brackets:,}")
    try:
        return json.loads(text, parse_constant=_finite, parse_float=_finite)
    except RecursionError:
        raise ValueError("too deeply nested") from None


def _finite(number: str) -> float:
    if math.isfinite(found := float(number)):
        return found
    raise ValueError(f"a number must be finite, got {number[:30]}")


def visible(text: str) -> str:
    """Replace invisible characters that change the display, such as escapes and bidirectional marks, by "?".

    White space stays.
    """
    if text.isprintable():
        return text
    return "".join(one if one.isprintable() or one in "\n\t\N{NO-BREAK SPACE}" else "?" for one in text)


def plain(text: object, most: int = LONGEST_LINE) -> str:
    """Return untrusted text as one visible line of at most `most` characters, for a terminal."""
    line = str(text)
    if len(line) > most:
        line = f"{line[:most]} ..."
    return visible(" ".join(line.split()))


def markdown(text: object) -> str:
    """Return untrusted text as one line without a meaning in Markdown: no cell, code, HTML, link or image."""
    line = plain(text).translate(_IN_MARKDOWN).replace("](", "]&#40;").replace("://", "&#58;//")
    return _TAG.sub("&lt;", line)

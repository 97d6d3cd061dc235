"""Statistics of the columns, which learners scale by: of an episode, and of all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Stats = dict[str, np.ndarray]  # of one column

_QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
_FRAMES = 100  # of a film that are looked at


def of_values(values: np.ndarray) -> Stats:
    """Of a column (n,) or (n, values), over its rows."""
    values = values.reshape(len(values), -1).astype(float)
    return _stats(values, len(values))


def of_frames(frames: np.ndarray) -> Stats:
    """Of each colour of a film (n, height, width, 3), from 0 to 1, in the shape (3, 1, 1); of some of its frames."""
    which = np.unique(np.linspace(0, len(frames) - 1, _FRAMES).astype(int))
    pixels = frames[which].reshape(-1, frames.shape[-1]) / 255.0
    found = _stats(pixels, len(which))
    return {name: value if name == "count" else value.reshape(-1, 1, 1) for name, value in found.items()}


def together(parts: Sequence[Stats]) -> Stats:
    """Of several episodes; quantiles are means of theirs, as LeRobot makes them, and so only nearly right."""
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

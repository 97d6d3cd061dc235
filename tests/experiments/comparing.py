"""What of a run does not depend on the machine, and whether two runs agree in it."""

import os
import signal

import numpy as np
import pandas as pd

from caregiver_mj.errors import CaregiverError


def rows(result):
    """The rows less the one column that depends on the machine."""
    return comparable(result.episodes)


def comparable(episodes):
    """The same of a table, whether it was on disk or not."""
    episodes = episodes.drop(columns="wall_seconds").reset_index(drop=True)
    for column in ("damage_by_child", "toys_by_child"):
        episodes[column] = episodes[column].map(tuple)
    return episodes


def same(result, other):
    pd.testing.assert_frame_equal(rows(result), rows(other), check_exact=True)
    pd.testing.assert_frame_equal(result.maps, other.maps, check_exact=True)


def twelve_houses():
    """Damage in twelve houses of 20 episodes, with a caregiver and without."""
    random = np.random.default_rng(1)
    share = random.uniform(0.2, 0.5, 12)
    theirs = [random.poisson(mean, 20).astype(float) for mean in random.uniform(5, 30, 12)]
    return [random.binomial(x.astype(int), p).astype(float) for x, p in zip(theirs, share, strict=True)], theirs


def square(job):
    """A job for workers, of which some fail."""
    if job == "deadly":
        os.kill(os.getpid(), signal.SIGKILL)
    if job == "wrong":
        raise ValueError("job is wrong")
    if job == "refused":
        raise CaregiverError("job is refused")
    return job**2


def without_times(summary):
    return [{k: v for k, v in row.items() if "wall_seconds" not in k} for row in summary["rows"]]

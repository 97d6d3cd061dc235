"""Recorded episodes, step by step, and their storage until the data set is complete."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import pathlib
import shutil
from collections.abc import Iterator
from typing import Any

import numpy as np

from caregiver_mj.errors import CaregiverError

TARGETS = "targets"  # stands for a task: `Supervise-Targets`
RANDOM = "random-actions"  # stands for a caregiver: actions drawn uniformly
_ARRAYS, _REST = "arrays.npz", "episode.json"


@dataclasses.dataclass(frozen=True)
class Steps:
    """An episode of n steps."""

    number: int  # number in the data set, from 0
    seed: int  # seed of the episode, as in `evaluate` and `render`
    # observations by key, before every step and after the last, (n + 1, ...) each
    observations: dict[str, np.ndarray]
    actions: np.ndarray  # (n, ...)
    rewards: np.ndarray  # (n,)
    costs: np.ndarray  # damage, plus 1 for every strike, as of `CostMeter`, (n,)
    damage: np.ndarray  # damage to the children, (n,)
    strikes: np.ndarray  # strikes of the robot, (n,)
    interventions: np.ndarray  # number of the hazard under intervention, or NOTHING, (n,)
    terminated: bool  # whether the episode ended; else it was truncated
    diverged: bool  # whether it ended because the simulation diverged
    outcome: dict[str, Any]  # measures of the episode, by column
    # camera images by name, with the observations, uint8 (n + 1, height, width, 3) each
    frames: dict[str, np.ndarray] = dataclasses.field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.rewards)

    def save(self, folder: pathlib.Path) -> None:
        """Write everything except the frames, which are in `frames_file` already."""
        arrays = {f"observations/{key}": values for key, values in self.observations.items()}
        rest: dict[str, Any] = {"frames": {name: values.shape for name, values in self.frames.items()}}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                arrays[field.name] = value
            elif field.name not in ("observations", "frames"):
                rest[field.name] = value
        np.savez(folder / _ARRAYS, **arrays)  # type: ignore[arg-type]  # no array is called `allow_pickle`
        (folder / _REST).write_text(json.dumps(rest), encoding="utf-8")

    @classmethod
    def load(cls, folder: pathlib.Path) -> Steps:
        """Read a saved episode; frames stay on disk until they are accessed."""
        rest = json.loads((folder / _REST).read_text("utf-8"))
        with np.load(folder / _ARRAYS) as file:
            arrays = dict(file)
        observations = {key.partition("/")[2]: arrays.pop(key) for key in list(arrays) if "/" in key}
        frames: dict[str, np.ndarray] = {
            name: np.memmap(frames_file(folder, name), np.uint8, "r", shape=tuple(shape))
            for name, shape in rest.pop("frames").items()
        }
        return cls(observations=observations, frames=frames, **arrays, **rest)


def frames_file(folder: pathlib.Path, camera: str) -> pathlib.Path:
    """Return the file with the frames of a camera, one after the other."""
    return folder / f"{camera}.frames"


class Store:
    """Finished episodes in a folder, before they become a data set. An unfinished episode leaves no trace."""

    def __init__(self, path: pathlib.Path):
        self.path = path

    def __contains__(self, number: int) -> bool:
        return (_folder(self.path, number) / _REST).exists()

    def numbers(self) -> list[int]:
        """Return the numbers of the stored episodes."""
        folders = (file.parent.name for file in self.path.glob(f"*/{_REST}"))
        return [int(name) for name in folders if name.isdigit()]  # unfinished ones have a suffix

    def check_none_beyond(self, episodes: int) -> None:
        """Raise CaregiverError if more episodes are stored, because they would be lost."""
        beyond = sum(number >= episodes for number in self.numbers())
        if beyond:
            raise CaregiverError(
                f"'{self.path}' holds {beyond} episodes beyond --episodes: raise it, or remove the folder"
            )

    def load(self, number: int) -> Steps:
        """Return a stored episode."""
        return Steps.load(_folder(self.path, number))

    def remove(self) -> None:
        """Remove everything."""
        shutil.rmtree(self.path)


@contextlib.contextmanager
def new_episode(store: pathlib.Path, number: int) -> Iterator[pathlib.Path]:
    """Yield a folder for an episode, and add it to the store unless the block fails."""
    folder, unfinished = _folder(store, number), store / f"{number:06d}.part"
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir(parents=True)
    yield unfinished
    unfinished.replace(folder)


def _folder(store: pathlib.Path, number: int) -> pathlib.Path:
    return store / f"{number:06d}"


@dataclasses.dataclass(frozen=True)
class About:
    """Description of a data set."""

    task: str  # the task, in a sentence
    robot: str  # name of the robot, "" for none
    policy: str  # name of the policy
    rate: float  # steps per second of simulated time
    actions: tuple[str, ...]  # names of the components of an action
    hazards: tuple[str, ...]  # names of the hazards, by number
    version: str  # of this package

    @property
    def description(self) -> str:
        """The description as text."""
        hazards = ", ".join(f"{number} {name}" for number, name in enumerate(self.hazards))
        robot = f" Robot {self.robot}." if self.robot else ""
        return (
            f"{self.task} Recorded by caregiver_mj {self.version} from {self.policy}, {self.rate:g} steps a second."
            f"{robot} Cost is damage to the children and 1 for every strike; an intervention is the hazard protected "
            f"from, -1 for none: {hazards}."
        )

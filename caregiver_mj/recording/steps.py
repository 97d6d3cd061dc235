"""An episode step by step, as it goes into a data set, and how it is kept until all of them are there."""

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

TARGETS = "targets"  # in the place of a task: `Supervise-Targets`
RANDOM = "random-actions"  # in the place of a caregiver: actions drawn from all that there are
_ARRAYS, _REST = "arrays.npz", "episode.json"


@dataclasses.dataclass(frozen=True)
class Steps:
    """An episode of n steps."""

    number: int  # its number in the data set, from 0
    seed: int  # what it is the episode of, in `evaluate` and `render` as here
    # what was seen, by key: before every step and after the last one, (n + 1, ...) each
    observations: dict[str, np.ndarray]
    actions: np.ndarray  # what was done, (n, ...)
    rewards: np.ndarray  # what came of it, (n,)
    costs: np.ndarray  # harm in each step, as of `CostMeter`: damage, and 1 for every strike, (n,)
    damage: np.ndarray  # damage to the children in each, (n,)
    strikes: np.ndarray  # how often the robot struck one, (n,)
    interventions: np.ndarray  # number of the hazard that was being protected from, or NOTHING, (n,)
    terminated: bool  # whether the episode came to its end; else it was cut off
    diverged: bool  # whether that was because the simulation came apart
    outcome: dict[str, Any]  # what is measured of an episode, as in the tables
    # what cameras saw, by their names, with the observations, uint8 (n + 1, height, width, 3) each
    frames: dict[str, np.ndarray] = dataclasses.field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.rewards)

    def save(self, folder: pathlib.Path) -> None:
        """Write all but the frames, which are there already: `frames_file`."""
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
        """Read what `save` has written; frames stay on disk until they are looked at."""
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
    """Return where the frames of a camera are, one after the other."""
    return folder / f"{camera}.frames"


class Store:
    """Finished episodes in a folder, until there is a data set of them. One that was broken off leaves nothing."""

    def __init__(self, path: pathlib.Path):
        self.path = path

    def __contains__(self, number: int) -> bool:
        return (_folder(self.path, number) / _REST).exists()

    def numbers(self) -> list[int]:
        """Return those of the episodes that are there."""
        folders = (file.parent.name for file in self.path.glob(f"*/{_REST}"))
        return [int(name) for name in folders if name.isdigit()]  # which an unfinished one's is not

    @contextlib.contextmanager
    def gone_if_empty(self) -> Iterator[None]:
        """Remove the store if the block fails before there is an episode: there is nothing to resume."""
        try:
            yield
        except BaseException:
            if not self.numbers():
                self.remove()
            raise

    def check_none_beyond(self, episodes: int) -> None:
        """Raise CaregiverError if there are episodes beyond so many, for they would be thrown away."""
        beyond = sum(number >= episodes for number in self.numbers())
        if beyond:
            raise CaregiverError(
                f"'{self.path}' holds {beyond} episodes beyond --episodes: raise it, or remove the folder"
            )

    def load(self, number: int) -> Steps:
        """Return an episode that is there."""
        return Steps.load(_folder(self.path, number))

    def remove(self) -> None:
        """Remove everything."""
        shutil.rmtree(self.path)


@contextlib.contextmanager
def new_episode(store: pathlib.Path, number: int) -> Iterator[pathlib.Path]:
    """Give a folder to put an episode into; it is in the store once that has gone well."""
    folder, unfinished = _folder(store, number), store / f"{number:06d}.part"
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir(parents=True)
    yield unfinished
    unfinished.replace(folder)


def _folder(store: pathlib.Path, number: int) -> pathlib.Path:
    return store / f"{number:06d}"


@dataclasses.dataclass(frozen=True)
class About:
    """What a data set says of itself."""

    task: str  # what was to be done, in a sentence
    robot: str  # name of the robot; nothing where there is none
    policy: str  # who acted
    rate: float  # steps a second of simulated time
    actions: tuple[str, ...]  # names of the values of an action
    hazards: tuple[str, ...]  # what the numbers of the hazards mean
    version: str  # of this package

    @property
    def description(self) -> str:
        """All of that in a few sentences."""
        hazards = ", ".join(f"{number} {name}" for number, name in enumerate(self.hazards))
        robot = f" Robot {self.robot}." if self.robot else ""
        return (
            f"{self.task} Recorded by caregiver_mj {self.version} from {self.policy}, {self.rate:g} steps a second."
            f"{robot} Cost is damage to the children and 1 for every strike; an intervention is the hazard protected "
            f"from, -1 for none: {hazards}."
        )

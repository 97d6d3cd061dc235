"""All the chance in a child's episode, drawn beforehand: common random numbers."""

from __future__ import annotations

import dataclasses
from typing import TypeAlias

import numpy as np

from caregiver_mj.errors import LARGEST_SEED, check_integer

EPISODE_TIMESTEPS = 200  # novice timesteps an episode (paper, section V.B)

Random: TypeAlias = "np.random.RandomState | np.random.Generator | int | None"  # a source of randomness, or its seed


def random_state(random: Random) -> np.random.RandomState:
    """Return a source of randomness as a `RandomState`; that of a `Generator` draws from the same stream as it.

    Raises:
        CaregiverError: It is neither of these, nor an integer seed, Python's or NumPy's, nor None for a fresh one.
    """
    if isinstance(random, np.random.RandomState):
        return random
    if isinstance(random, np.random.Generator):
        return np.random.RandomState(random.bit_generator)
    if random is not None:
        check_integer("the seed of an episode", random, 0, LARGEST_SEED)
    return np.random.RandomState(random)


@dataclasses.dataclass(frozen=True)
class RandomStream:
    """The uniform draws of one child in one episode.

    Because they do not depend on what happens, the same stream gives the same child alone and with any caregiver, in
    the grid and in the house.
    """

    start: np.ndarray  #: for the start cells of child and caregiver, then the first bin: (3,)
    #: for every timestep, whether the move is random, which move it is, and which bin is next if one is reached:
    #: (timesteps, 3)
    steps: np.ndarray
    caregiver_seed: int = 0  #: seed of this episode for a caregiver that draws lots

    @classmethod
    def draw(cls, random: Random, timesteps: int = EPISODE_TIMESTEPS) -> RandomStream:
        """Draw the stream of an only child.

        Raises:
            CaregiverError: As of `random_state`.
        """
        random = random_state(random)
        draws = random.random_sample((timesteps + 1, 3))
        return cls(draws[0], draws[1:], int(random.randint(2**31 - 1)))

    @classmethod
    def draw_group(cls, random: Random, children: int, timesteps: int = EPISODE_TIMESTEPS) -> tuple[RandomStream, ...]:
        """Draw the streams of several children. The first one is that of an only child, whoever else there is."""
        first = cls.draw(random, timesteps)
        others = (np.random.SeedSequence([first.caregiver_seed, child]) for child in range(1, children))
        draw = (cls.draw(np.random.RandomState(np.random.MT19937(seed)), timesteps) for seed in others)
        return (first, *(dataclasses.replace(stream, caregiver_seed=first.caregiver_seed) for stream in draw))


def pick(draw: np.ndarray | np.float64, count: np.ndarray | int) -> np.ndarray:
    """Return uniform choices out of `count` from uniform draws in [0, 1)."""
    return (draw * count).astype(int)


def start_cells(free_cells: int, landings: int, draws: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where children and caregiver are at first: each uniform over the free cells that are left.

    These are free cells (B, children) and caregiver cells (B,), by the start draws of every child, (B, children, 3).
    Where no free cell is left, a child shares the first one, and the caregiver starts on the last landing, if any.
    """
    taken: list[np.ndarray] = []
    for child in range(draws.shape[1]):
        taken.append(_another(draws[:, child, 0], free_cells, taken, 0))
    last = free_cells + landings - 1
    return np.stack(taken, axis=1), _another(draws[:, 0, 1], free_cells, taken, last)


def _another(draw: np.ndarray, cells: int, taken: list[np.ndarray], otherwise: int) -> np.ndarray:
    """Uniform choices (B,) among the cells that are not taken yet."""
    if cells <= len(taken):
        return np.full(len(draw), otherwise)
    cell = pick(draw, cells - len(taken))
    for other in np.sort(np.array(taken), axis=0):  # the lowest one first, so that each moves those above it up
        cell = cell + (cell >= other)
    return cell

"""Random streams: all draws of a child's episode, made in advance (common random numbers)."""

from __future__ import annotations

import dataclasses
from typing import TypeAlias

import numpy as np

from caregiver_mj.errors import LARGEST_SEED, check_integer

EPISODE_TIMESTEPS = 200  # novice timesteps an episode (paper, section V.B)

Random: TypeAlias = "np.random.RandomState | np.random.Generator | int | None"  # source of randomness, or its seed


def random_state(random: Random) -> np.random.RandomState:
    """Return a source of randomness as a `RandomState`; a `Generator` shares its bit stream with the result.

    Raises:
        CaregiverError: `random` is none of these, nor an integer seed, nor None for a fresh one.
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
    """The uniform draws of one child in one episode: the same alone and with any caregiver, in grid and house."""

    start: np.ndarray  #: draws for the start cells of child and caregiver, and for the first bin, (3,)
    #: draws of every timestep: whether the move is random, the move, and the next bin, (timesteps, 3)
    steps: np.ndarray
    caregiver_seed: int = 0  #: seed of this episode for a random caregiver

    @classmethod
    def draw(cls, random: Random, timesteps: int = EPISODE_TIMESTEPS) -> RandomStream:
        """Draw the stream of a single child, with the errors of `random_state`."""
        random = random_state(random)
        draws = random.random_sample((timesteps + 1, 3))
        return cls(draws[0], draws[1:], int(random.randint(2**31 - 1)))

    @classmethod
    def draw_group(cls, random: Random, children: int, timesteps: int = EPISODE_TIMESTEPS) -> tuple[RandomStream, ...]:
        """Draw the streams of a child group; the first does not depend on the number of children."""
        first = cls.draw(random, timesteps)
        others = (np.random.SeedSequence([first.caregiver_seed, child]) for child in range(1, children))
        draw = (cls.draw(np.random.RandomState(np.random.MT19937(seed)), timesteps) for seed in others)
        return (first, *(dataclasses.replace(stream, caregiver_seed=first.caregiver_seed) for stream in draw))


def pick(draw: np.ndarray | np.float64, count: np.ndarray | int) -> np.ndarray:
    """Return uniform integers below `count` from uniform draws in [0, 1)."""
    return (draw * count).astype(int)


def start_cells(free_cells: int, landings: int, draws: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the start cells of children, (B, K), and caregiver, (B,), uniform over the free cells that remain.

    `draws` are the start draws of every child, (B, K, 3). If no free cell remains, a child shares the first, and the
    caregiver starts on the last landing, if any.
    """
    taken: list[np.ndarray] = []
    for child in range(draws.shape[1]):
        taken.append(_another(draws[:, child, 0], free_cells, taken, 0))
    last = free_cells + landings - 1
    return np.stack(taken, axis=1), _another(draws[:, 0, 1], free_cells, taken, last)


def _another(draw: np.ndarray, cells: int, taken: list[np.ndarray], otherwise: int) -> np.ndarray:
    """Return uniform choices, (B,), among untaken cells; `otherwise` if there are none."""
    if cells <= len(taken):
        return np.full(len(draw), otherwise)
    cell = pick(draw, cells - len(taken))
    for other in np.sort(np.array(taken), axis=0):  # ascending, so that each skips a taken cell
        cell = cell + (cell >= other)
    return cell

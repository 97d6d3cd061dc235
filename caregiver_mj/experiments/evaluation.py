"""Evaluation: every caregiver against every novice, in the grid or in the house, an episode a row.

Episode i starts from the same seed, and so has the same novice, under every caregiver and epsilon and in both worlds
(common random numbers). A row depends on nothing but the settings and its own place in them.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import importlib.metadata
import platform
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from caregiver_mj.caregivers.caregiver import CAREGIVERS, make_caregiver
from caregiver_mj.children.novice import EPISODE_TIMESTEPS, NoviceTape, check_epsilon
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.run_folder import Result, Row, RunFolder
from caregiver_mj.experiments.workers import run_jobs
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan

if TYPE_CHECKING:
    import pandas as pd  # imported where used: workers, and commands that only read a plan, do without

WORLDS = ("house", "grid")
EPSILONS = (1.0, 0.75, 0.5, 0.25, 0.05)  # the paper's five novices

DAMAGES = ("damage", "damage_stairwell", "damage_candle", "damage_table")
COUNTS = (
    "timesteps_to_threshold",
    "cells_visited",
    "toys_reached",
    "moves_blocked",
    "interventions",
    "interventions_done",
    "candles_dropped",
    "strikes",
)
TIMES = ("sim_seconds", "wall_seconds")
MEASURES = DAMAGES + COUNTS + TIMES
COLUMNS = ("world", "house", "caregiver", "epsilon", "episode", "seed", *MEASURES)
MAPS = ("visits", "damage")  # summed for every free cell

_NOVICE_SPEED = 1.6 / 3.6  # metres a second (paper, section V.C)
_GRID_BLOCK = 1000  # episodes at once: enough to be fast, and a few seconds' work to lose
_LIBRARIES = ("numpy", "mujoco", "dm_control", "mink", "ruckig")


@dataclasses.dataclass(frozen=True)
class Settings:
    """What to evaluate: everything that the results depend on.

    Attributes:
        plan: The house.
        world: "house", the physical one, or "grid".
        caregivers: Names of caregivers.
        epsilons: The novices.
        episodes: Episodes for each caregiver and novice.
        seed: Seed of the episodes, and of what is random in the caregivers.
    """

    plan: FloorPlan
    world: str = "house"
    caregivers: tuple[str, ...] = ("none", "paper")
    epsilons: tuple[float, ...] = EPSILONS
    episodes: int = 20
    seed: int = 0

    def check(self) -> None:
        """Raises CaregiverError unless this can be run."""
        if self.world not in WORLDS:
            raise CaregiverError(f"no world '{self.world}': there are {', '.join(WORLDS)}")
        for name in self.caregivers:
            if name not in CAREGIVERS:
                raise CaregiverError(f"no caregiver '{name}': there are {', '.join(CAREGIVERS)}")
            CAREGIVERS.get(name)  # one that comes from another package may fail to load
        for epsilon in self.epsilons:
            check_epsilon(epsilon)
        for what, values in (("caregivers", self.caregivers), ("epsilons", self.epsilons)):
            if not values or len(set(values)) < len(values):
                raise CaregiverError(f"{what} must be one or more, each of them once, not {values}")
        if self.episodes < 1:
            raise CaregiverError(f"episodes must be at least 1, not {self.episodes}")
        if self.seed < 0:
            raise CaregiverError(f"the seed must not be negative: {self.seed}")

    def record(self) -> dict[str, Any]:
        """The settings and versions as JSON, to tell whether two runs can be one."""
        return {
            "world": self.world,
            "house": self.plan.name,
            "plan": list(self.plan.rows),
            "cell_size": self.plan.cell_size,
            "caregivers": list(self.caregivers),
            "epsilons": list(self.epsilons),
            "episodes": self.episodes,
            "seed": self.seed,
            "versions": versions(),
        }

    def blocks(self) -> list[Block]:
        """The work in pieces, each of which is done as a whole."""
        size = _GRID_BLOCK if self.world == "grid" else 1
        return [
            Block(caregiver, epsilon, first, min(first + size, self.episodes))
            for epsilon in self.epsilons
            for caregiver in self.caregivers
            for first in range(0, self.episodes, size)
        ]


@dataclasses.dataclass(frozen=True)
class Block:
    """Episodes [first, end) of one caregiver and one novice."""

    caregiver: str
    epsilon: float
    first: int
    end: int

    def __len__(self) -> int:
        return self.end - self.first

    def __str__(self) -> str:
        """Says which, in messages and file names."""
        episodes = f"{self.first:06d}" + (f"-{self.end - 1:06d}" if len(self) > 1 else "")
        return f"{self.caregiver}_epsilon_{self.epsilon}_episode_{episodes}"


@dataclasses.dataclass(frozen=True)
class Evaluation:
    """What came out.

    Attributes:
        episodes: A row an episode.
        summary: The table made of them.
        maps: A row for each caregiver, novice and free cell: over all their episodes, the timesteps that novices ended
            in the cell (`visits`), and the damage that they took there.
    """

    episodes: pd.DataFrame
    summary: dict[str, Any]
    maps: pd.DataFrame


def evaluate(
    settings: Settings,
    folder: RunFolder | None = None,
    *,
    jobs: int = 1,
    progress: Callable[[int], None] = lambda episodes: None,
) -> Evaluation:
    """Runs every combination of caregiver and novice.

    Args:
        settings: What to run.
        folder: Where finished episodes are kept at once, and those of an earlier run are found.
        jobs: Worker processes; the results do not depend on it.
        progress: Called with the number of episodes that have just been finished, or found so.

    Raises:
        CaregiverError: The settings are wrong, a worker failed, or a result could not be written.
    """
    settings.check()
    if jobs < 1:
        raise CaregiverError(f"jobs must be at least 1, not {jobs}")
    blocks = settings.blocks()
    done: dict[Block, Result] = {}
    for block in blocks if folder else ():
        found = folder.read(str(block))
        if found is not None:
            done[block] = found
            progress(len(block))
    pending = [block for block in blocks if block not in done]
    work = functools.partial(run_block, settings)
    # Closed at once when a write fails or Ctrl-C comes, so that no worker outlives the run.
    with contextlib.closing(run_jobs(work, pending, max(1, min(jobs, len(pending))))) as results:
        for block, result in results:
            if folder:
                folder.write(str(block), result)
            done[block] = result
            progress(len(block))
    import pandas as pd

    episodes = pd.DataFrame([row for block in blocks for row in done[block]["rows"]])
    evaluation = Evaluation(episodes, summarise(settings, episodes), _maps(settings, done))
    if folder:
        folder.finish(evaluation.episodes, evaluation.summary, evaluation.maps)
    return evaluation


def summarise(settings: Settings, episodes: pd.DataFrame) -> dict[str, Any]:
    """The content of summary.json."""
    from caregiver_mj.experiments import statistics  # scipy.stats takes a second to import

    pairs = [(caregiver, "none") for caregiver in settings.caregivers if caregiver != "none"]
    pairs += [("paper", baseline) for baseline in settings.caregivers if baseline not in ("none", "paper")]
    return {
        "rows": statistics.summarise(episodes, MEASURES),
        "comparisons": [
            row
            for caregiver, baseline in pairs
            if {caregiver, baseline} <= set(settings.caregivers)
            for row in statistics.compare(episodes, caregiver, baseline)
        ],
        "versions": versions(),
        "seed": settings.seed,
    }


def run_block(settings: Settings, block: Block) -> Result:
    """Runs the episodes of a block: their rows, with `COLUMNS` as keys, and their maps."""
    run = _run_in_grid if settings.world == "grid" else _run_in_house
    seeds = [episode_seed(settings.seed, episode) for episode in range(block.first, block.end)]
    outcomes, maps = run(settings, block, seeds)
    rows = []
    for episode, seed, measured in zip(range(block.first, block.end), seeds, outcomes, strict=True):
        row: Row = {"world": settings.world, "house": settings.plan.name, "caregiver": block.caregiver}
        row |= {"epsilon": block.epsilon, "episode": episode, "seed": seed}
        row |= {column: float(measured[column]) for column in DAMAGES}
        row |= {column: int(measured[column]) for column in COUNTS}
        row |= {column: float(measured[column]) for column in TIMES}
        rows.append(row)
    return {"rows": rows, "maps": {name: values.tolist() for name, values in zip(MAPS, maps, strict=True)}}


def episode_seed(seed: int, episode: int) -> int:
    """The seed of an episode, by the run's seed and the episode's number alone."""
    return int(np.random.SeedSequence([seed, episode]).generate_state(1)[0])


def versions() -> dict[str, str]:
    """Versions of everything that results can depend on."""
    packages = {name: importlib.metadata.version(name) for name in ("caregiver_mj", *_LIBRARIES)}
    return {"caregiver_mj": packages.pop("caregiver_mj"), "python": platform.python_version(), **packages}


def _maps(settings: Settings, done: dict[Block, Result]) -> pd.DataFrame:
    """Sums the blocks' maps."""
    import pandas as pd

    sums: dict[tuple[str, float], np.ndarray] = {}  # each (maps, free cells)
    for block in settings.blocks():
        maps = np.array([done[block]["maps"][name] for name in MAPS])
        key = block.caregiver, block.epsilon
        sums[key] = sums.get(key, 0) + maps
    row, column = np.array(settings.plan.free_cells).T
    tables = []
    for (caregiver, epsilon), (visits, damage) in sums.items():
        what = {"world": settings.world, "house": settings.plan.name, "caregiver": caregiver, "epsilon": epsilon}
        tables.append(pd.DataFrame(what | {"row": row, "column": column, "visits": visits, "damage": damage}))
    return pd.concat(tables, ignore_index=True)


# What every episode came to, and the maps (`MAPS`) of all of them together.
_Measured = tuple[list[dict[str, float]], tuple[np.ndarray, np.ndarray]]


def _run_in_grid(settings: Settings, block: Block, seeds: list[int]) -> _Measured:
    start = time.perf_counter()
    caregiver = make_caregiver(block.caregiver, settings.plan, settings.seed)
    world = GridWorld(settings.plan, block.epsilon, caregiver)
    outcome = dataclasses.asdict(world.run([NoviceTape.draw(np.random.RandomState(seed)) for seed in seeds]))
    same = {
        "candles_dropped": 0,
        "strikes": 0,
        "sim_seconds": EPISODE_TIMESTEPS * settings.plan.cell_size / _NOVICE_SPEED,
        "wall_seconds": (time.perf_counter() - start) / len(seeds),
    }
    measured = [{name: values[i] for name, values in outcome.items()} | same for i in range(len(seeds))]
    return measured, (world.visits, world.damage_at)


def _run_in_house(settings: Settings, block: Block, seeds: list[int]) -> _Measured:
    env, policy = _house(settings.plan, block.epsilon, block.caregiver, settings.seed)
    measured, visits, damage = [], 0.0, 0.0
    for seed in seeds:
        start = time.perf_counter()
        env.task.reseed(np.random.RandomState(seed))
        timestep = env.reset()
        while not timestep.last():
            timestep = env.step(policy(timestep) if policy else np.zeros(env.action_spec().shape))
        figures = dict(env.task.outcome())
        figures["interventions"] = policy.interventions if policy else 0
        figures["interventions_done"] = policy.interventions_done if policy else 0
        figures["sim_seconds"] = env.physics.time()
        figures["wall_seconds"] = time.perf_counter() - start
        measured.append(figures)
        visits, damage = visits + env.task.visits, damage + env.task.damage_at
    return measured, (visits, damage)


@functools.lru_cache(maxsize=1)  # blocks of one caregiver and novice follow each other
def _house(plan: FloorPlan, epsilon: float, caregiver: str, seed: int) -> tuple[Any, Any]:
    """A house, and the policy of the caregiver in it (None for "none"). Building them takes a second."""
    import caregiver_mj  # here, for the package itself imports this module's neighbours

    env = caregiver_mj.load(
        "supervise",
        house=plan,
        epsilon=epsilon,
        random=np.random.RandomState(0),
        task_kwargs={"robot": caregiver != "none"},
    )
    return env, caregiver_mj.CaregiverPolicy(env, caregiver=caregiver, seed=seed) if caregiver != "none" else None

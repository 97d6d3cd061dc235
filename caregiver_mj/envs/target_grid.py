"""Targets in the grid: a batch of episodes as a vector environment."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from caregiver_mj.caregivers.instructed import CommandedCaregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.caregivers.target_observation import Encoder, Observations
from caregiver_mj.children.child_group import ChildGroup, ChildrenLike
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS, RandomStream
from caregiver_mj.envs.spaces import CostMeter, Seed, check_render_mode, episode_seed, observation_space, plain_seed
from caregiver_mj.errors import CaregiverError, check_integer
from caregiver_mj.experiments.score import Scorer
from caregiver_mj.experiments.spec import WORLDS
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan

MOST_EPISODES = 100_000  # episodes at once, all of which take memory from the start
LEAST_PIXELS, MOST_PIXELS = 32, (1920, 1080)  # limits of an image's sides, as in the house
FRAME_RATE = 5  # novice timesteps per second of film, some eight times real time
OVERVIEW = "overview"  # default camera in the house


def check_world(world: str) -> None:
    """Raise CaregiverError for an unknown world."""
    if world not in WORLDS:
        raise CaregiverError(f"no world '{world}': there are {', '.join(WORLDS)}")


class TargetGrid:
    """A batch of B episodes in the grid that runs from decision to decision.

    Attributes:
        world: The grid.
        caregiver: The caregiver, which executes the targets.
        family: The children.
        children: Number of children.
        encoder: Makes the observations.
        ended: Whether the episodes are over.
        diverged: False: the grid has no physics.
        dm_env: None: the grid has no physics.
    """

    diverged, dm_env = False, None

    def __init__(
        self,
        house: str | os.PathLike[str] | FloorPlan,
        epsilon: ChildrenLike | Sequence[ChildrenLike],
        task_kwargs: dict[str, Any] | None = None,
        camera: str = OVERVIEW,
        **options: Any,
    ):
        """Prepare the episodes; the options are further arguments of `Encoder`.

        Raises:
            CaregiverError: There are task_kwargs or a camera, or an option is invalid.
        """
        if task_kwargs or camera != OVERVIEW:
            raise CaregiverError(
                "task_kwargs and camera must be left out in the grid, which has neither a task nor cameras"
            )
        plan = house if isinstance(house, FloorPlan) else FloorPlan.load(house)
        self.family, self.caregiver = ChildGroup.of(epsilon), CommandedCaregiver(plan)
        self.children = len(self.family)
        self._scorer = Scorer(plan, self.family)
        self.world = GridWorld(plan, self.family, self.caregiver)
        self.encoder = Encoder(self.caregiver, self.children, **options)
        self.ended = False

    def begin(self, seeds: Sequence[int]) -> None:
        """Begin the episodes with seeds, and make the children's first moves."""
        self.world.reset([RandomStream.draw_group(np.random.RandomState(seed), self.children) for seed in seeds])
        self._cost = CostMeter(self.world.ledger)
        self.ended = False
        self.encoder.trace.clear()
        self.world.move_children()
        self.encoder.trace.appendleft(self.world.previous_cell)

    def act(self, actions: np.ndarray) -> None:
        """Run the caregiver's half of a novice timestep, then the children's half of the next one, if any."""
        self.caregiver.targets = self.encoder.slots.targets(actions, len(self.caregiver.targets))
        self.world.care(self.caregiver)
        self.ended = self.world.timestep >= EPISODE_TIMESTEPS
        if not self.ended:
            self.world.move_children()
            self.encoder.trace.appendleft(self.world.previous_cell)

    def percept(self) -> Percept:
        """Return the caregiver's percept."""
        return self.world.percept()

    def cost(self) -> dict[str, np.ndarray]:
        """Return the cost of the last decision in each world, see `CostMeter`."""
        return self._cost.read()

    def outcome(self) -> dict[str, Any]:
        """Return the measures of the first world, by column."""
        return self.world.ledger.outcome()

    def scores(self) -> np.ndarray:
        """Return the scores of the episodes so far, (B,), see `caregiver_mj.experiments.score`."""
        return self._scorer(self.world.timestep, self.world.ledger.totals())

    def painter(self, width: int, height: int) -> Callable[..., np.ndarray]:
        """Return a function that draws the world with a number, uint8 (height, width, 3).

        Raises:
            CaregiverError: The image size is invalid.
        """
        for what, size, most in (("width", width, MOST_PIXELS[0]), ("height", height, MOST_PIXELS[1])):
            check_integer(f"the {what} of a picture, in pixels,", size, LEAST_PIXELS, most)
        return functools.partial(self._paint, int(width), int(height))

    def _paint(self, width: int, height: int, number: int = 0) -> np.ndarray:
        from caregiver_mj.viz import hud, moment  # only needed for rendering

        return hud.draw_plan(moment.grid_state(self.world, self.family, number), width, height)


class GridTargetsVector(gymnasium.vector.VectorEnv):
    """`Supervise-Targets` in the grid, many episodes at once; see `TargetsEnv` for actions, rewards and `info`.

    All episodes have the same length, so they begin and end together: the step after the last one begins new ones,
    regardless of the actions (autoreset on the next step).

    Attributes:
        grid: The episodes.
    """

    metadata = {  # noqa: RUF012 (Gymnasium's own manner)
        "render_modes": ["rgb_array"],
        "render_fps": FRAME_RATE,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        world: str = "grid",
        house: str | os.PathLike[str] | FloorPlan = "paper",
        epsilon: ChildrenLike | Sequence[ChildrenLike] = 0.5,
        *,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 480,
        **options: Any,
    ):
        """Make an environment; see `make_targets` for the arguments.

        Raises:
            CaregiverError: The world is not the grid, or there are too many episodes; or as of `make_targets`.
        """
        check_world(world)
        if world != "grid":
            raise CaregiverError(
                f"world must be 'grid' for one batch of episodes, got '{world}': use vectorization_mode='sync'"
            )
        check_render_mode(render_mode)
        check_integer("num_envs", num_envs, 1, MOST_EPISODES)
        self.num_envs, self.grid = num_envs, TargetGrid(house, epsilon, **options)
        self.render_mode, self._paint = render_mode, self.grid.painter(width, height) if render_mode else None
        self.single_observation_space = observation_space(self.grid.encoder)
        self.single_action_space = gymnasium.spaces.Discrete(self.grid.encoder.actions)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._is_reset = False
        self._randoms: list[np.random.Generator | None] = [None] * num_envs

    def reset(
        self, *, seed: Seed | Sequence[Seed] = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin episodes with the seeds from `seed` on, with a seed for each, or with random seeds.

        A `Generator` or a `RandomState` draws its seed.

        Raises:
            CaregiverError: The options reset only some of the episodes, or the seeds are no integers, or too few.
        """
        if options and not np.all(options.get("reset_mask", True)):
            raise CaregiverError("reset_mask must be left out: all episodes of the batch begin together")
        seeds = _seeds(seed, self.num_envs)
        super().reset(seed=seeds[0])
        drawn = []
        for i, own in enumerate(seeds):
            random = self._randoms[i]
            if own is not None or random is None:
                random, _ = seeding.np_random(own)
                self._randoms[i] = random
            drawn.append(episode_seed(own, random))
        self.grid.begin(drawn)
        self._is_reset = True
        observations, mask = self.grid.encoder.look(self.grid.percept())
        return observations, self._of_all({"seed": np.array(drawn), "action_mask": mask})

    def step(self, actions: np.ndarray) -> tuple[Observations, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        none = np.zeros(self.num_envs, bool)
        if not self._is_reset:
            raise gymnasium.error.ResetNeeded("call reset() before the first step")
        if self.grid.ended:
            observations, info = self.reset()
            return observations, np.zeros(self.num_envs), none, none.copy(), info
        self.grid.act(actions)
        cost = self.grid.cost()
        observations, mask = self.grid.encoder.look(self.grid.percept())
        info = self._of_all({**cost, "diverged": none.copy(), "action_mask": mask})
        if self.grid.ended:
            last = {"outcome": self._of_all(self._outcome()), "episode_score": self.grid.scores()}
            info |= self._of_all(last)
        return observations, 0.0 - cost["damage"], none, np.full(self.num_envs, self.grid.ended), info

    def render(self) -> tuple[np.ndarray, ...] | None:
        """Return an image of each world."""
        if self._paint and not self._is_reset:
            raise gymnasium.error.ResetNeeded("call reset() before the first picture")
        return tuple(map(self._paint, range(self.num_envs))) if self._paint else None

    def _outcome(self) -> dict[str, np.ndarray]:
        """Return the measures of every episode by column, (B,) each; measures of each child are lists."""
        ledger = self.grid.world.ledger
        found: dict[str, np.ndarray] = dict(ledger.totals())
        for name, of_children in ledger.by_child().items():
            found[name] = np.empty(self.num_envs, object)
            found[name][:] = of_children.tolist()
        return found

    def _of_all(self, info: dict[str, Any]) -> dict[str, Any]:
        """Add Gymnasium's masks, which are True for all episodes."""
        return info | {f"_{key}": np.ones(self.num_envs, bool) for key in info}


def _seeds(seed: Seed | Sequence[Seed], count: int) -> list[int | None]:
    """Return a seed for each of `count` episodes: consecutive ones, the given ones, or None."""
    if seed is None or isinstance(seed, (np.random.Generator, np.random.RandomState)):
        return [plain_seed(seed) for _ in range(count)]
    if isinstance(seed, (int, np.integer)):
        return [int(seed) + i for i in range(count)]
    if isinstance(seed, (str, bytes)) or not isinstance(seed, (Sequence, np.ndarray)):
        raise CaregiverError(f"the seed must be an integer, or one for each of {count} episodes, got {seed!r}")
    if len(seed) != count:
        raise CaregiverError(f"seeds must be {count}, one for each episode, got {len(seed)}")
    seeds = [plain_seed(own) for own in seed]
    for own in seeds:
        if own is not None:
            check_integer("a seed", own, 0)
    return seeds

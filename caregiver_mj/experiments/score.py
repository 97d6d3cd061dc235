"""The score of an episode: 0 for children left alone, 1 for the damage of bare tables only, less what the robot does.

    score = (none - damage - robot harm) / (none - bare_tables)

`none` and `floor` are means over `EPISODES` episodes in the grid, as long as the one that is scored: the damage to the
same children without a caregiver, and that of bare tables only, which no intervention prevents. What the caregiver sees
changes neither. So the mean score of many episodes in a house is the score of their mean damage.

Robot harm has no constant of its own: a strike costs what the lightest collision of the house's `DamageWeights` costs
(1, a bump into a bare table), a thing that the robot drops what the worst thing on a table costs.

A single episode varies widely: the score may be far below 0, and above 1 where the children were lucky.

Tables of a run have its own episodes without a caregiver, so `none` is exactly 0 in them: the score of a caregiver is
the mean of `prevented` over that of `preventable`, of paired episodes. What bare tables only do follows from bumps into
tables without a caregiver, whatever is on them: in the grid that is the damage of `floor` for all children of the
package, for a shut stairwell stops them as an open one does.
"""

from __future__ import annotations

import copy
import functools
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from caregiver_mj import tasks
from caregiver_mj.children.child_group import ChildGroup, ChildSpec, parts_of
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS, RandomStream
from caregiver_mj.grid.world import BareTablesWorld, GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import TABLE, Where, kinds_at

if TYPE_CHECKING:
    import pandas as pd

EPISODES = 500  # the mean damage of `none` has a standard error of 1 to 3 % of it in the houses of the package


class Expected(NamedTuple):
    """Mean damage by the end of each novice timestep, from none to 200 of them, (201,) or (201, B) for B episodes."""

    none: np.ndarray
    bare_tables: np.ndarray


def score(
    damage: float | np.ndarray,
    none: float | np.ndarray,
    bare_tables: float | np.ndarray,
    robot_harm: float | np.ndarray = 0,
) -> np.ndarray:
    """Return the score of a damage, given the damage expected without a caregiver and with bare tables only.

    All arguments are in units of damage: numbers, or arrays of a common shape, of an episode or of a mean. The score is
    NaN where the damage without a caregiver is no greater than with bare tables only: nothing can be prevented there.
    """
    preventable = np.subtract(none, bare_tables)
    prevented = np.subtract(none, damage) - robot_harm
    return np.divide(prevented, preventable, np.full(prevented.shape, np.nan), where=preventable > 0)


def robot_harm(plan: FloorPlan, outcome: Mapping[str, Any] | pd.DataFrame) -> Any:
    """Return what `strikes` and `candles_dropped` of an episode, or of several, come to in units of damage."""
    lightest = min(filter(None, plan.damage.values()), default=0.0)
    return outcome["strikes"] * lightest + outcome["candles_dropped"] * plan.hazards.worst(Where.ON_TABLE)


def with_costs(episodes: pd.DataFrame, plans: Sequence[FloorPlan]) -> pd.DataFrame:
    """Return a table with a row an episode, and two columns more, in units of damage.

    They are `preventable`, its damage less that of its bumps into tables if all of them were bare, and `all_harm`, its
    damage and robot harm. Bumps into a thing on a table that costs nothing leave no trace: then `preventable` is NaN.
    Episodes of an older version that has not counted all of that come back without them.
    """
    weights, on_tables = plans[0].damage, kinds_at(Where.ON_TABLE)
    counted = ("strikes", "candles_dropped", *(f"damage_{kind.name}" for kind in (TABLE, *on_tables)))
    if not {*counted} <= {*episodes}:
        return episodes
    bare = episodes[f"damage_{TABLE.name}"].astype(float)
    for kind in on_tables:
        share = weights[TABLE.name] / weights[kind.name] if weights[kind.name] else np.nan
        bare = bare + share * episodes[f"damage_{kind.name}"]
    harm = np.zeros(len(episodes))
    for plan in plans:
        here = (episodes["house"] == plan.name).to_numpy()
        harm[here] = robot_harm(plan, episodes[here])
    return episodes.assign(preventable=episodes["damage"] - bare, all_harm=episodes["damage"] + harm)


class Scorer:
    """Scores episodes of some children in a house. What it needs to know is found out when it is first asked.

    Attributes:
        plan: The house.
        family: The children.
    """

    def __init__(self, plan: FloorPlan, family: ChildGroup):
        self.plan, self.family = plan, family

    def __call__(self, timestep: int, outcome: Mapping[str, Any]) -> np.ndarray:
        """Return the score of episodes up to a novice timestep, (B,).

        Beyond 200 timesteps the expected damage grows at its mean rate. The outcome has the names of `EpisodeRecord`,
        and numbers of one episode, or arrays (B,).
        """
        last, longer = min(timestep, EPISODE_TIMESTEPS), max(1.0, timestep / EPISODE_TIMESTEPS)
        none, bare_tables = (curve[last] * longer for curve in self.expected)
        return score(outcome["damage"], none, bare_tables, robot_harm(self.plan, outcome))

    @functools.cached_property
    def expected(self) -> Expected:
        """What is to be expected in each of the B episodes; of a family that is none of several B is 1."""
        parts, sizes = zip(*parts_of(self.family), strict=True)
        curves = np.array([expected_damage(self.plan, part) for part in parts])  # (parts, 2, timesteps + 1)
        return Expected(*np.repeat(curves.transpose(1, 2, 0), sizes, axis=2))


def expected_damage(plan: FloorPlan, family: ChildGroup) -> Expected:
    """Return the mean damage to a family without a caregiver, and that of bare tables only, of each (201,).

    It is worked out once in a process for children by name. A child of your own class is copied first, for it may be in
    the midst of an episode. Where that, or a batch of episodes with it, fails, there is a warning, and it is NaN.
    """
    if all(isinstance(child, ChildSpec) for child in family.children):
        return _of_named(plan, family)
    try:
        return _simulated(plan, copy.deepcopy(family, {id(plan): plan}))
    except Exception as error:  # whatever somebody else's class raises
        warnings.warn(f"there is no score with children {family}, for they cannot be simulated: {error}", stacklevel=2)
        return Expected(*np.full((2, EPISODE_TIMESTEPS + 1), np.nan))


def _simulated(plan: FloorPlan, family: ChildGroup) -> Expected:
    worlds = GridWorld(plan, family, None), BareTablesWorld(plan, family)
    return Expected(*(_curve(world, len(family)) for world in worlds))


_of_named = functools.lru_cache(maxsize=4096)(_simulated)


def _curve(world: GridWorld, children: int) -> np.ndarray:
    """Mean damage so far, at the start and after each novice timestep."""
    found = [0.0]
    world.reset(_streams(children))
    for _ in range(EPISODE_TIMESTEPS):
        world.step()
        found.append(float(world.ledger.damage.mean()))
    return np.array(found)


@functools.lru_cache(maxsize=2)  # they take as long as the episodes
def _streams(children: int) -> Sequence[Sequence[RandomStream]]:
    return [RandomStream.draw_group(np.random.RandomState(seed), children) for seed in range(EPISODES)]


@functools.wraps(tasks.load)
def load(*args: Any, **options: Any) -> Any:
    """Make an environment with a score, for a task may not know the grid; the documentation is that of the other."""
    env = tasks.load(*args, **options)
    env.task.scorer = Scorer(env.task.plan, env.task.family)
    return env

"""The score of an episode: 0 for the damage without a caregiver, 1 for that of bare tables only, less robot harm.

    score = (none - damage - robot harm) / (none - bare_tables)

`none` and `bare_tables` are means over `EPISODES` episodes in the grid, as long as the one to score: the damage to the
same children without a caregiver, and that of bare tables only, which no intervention prevents. Neither depends on the
caregiver's sight, so the mean score of many episodes in a house is the score of their mean damage.

Robot harm uses the house's `DamageWeights`: a strike costs as much as its lightest collision (1, a bump into a bare
table), a dropped thing as much as the worst thing on a table.

A single episode varies widely: the score may be far below 0, or above 1 where the children were lucky.

Tables of a run contain episodes without a caregiver, so `none` is exactly 0 in them: the score of a caregiver is the
mean of `prevented` over that of `preventable`, in paired episodes. The damage of bare tables only follows from bumps
into tables without a caregiver, with or without a candle: in the grid it equals that of `floor` for all children of the
package, because a shut stairwell stops them as an open one does.
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

EPISODES = 500  # the relative standard error of the mean damage of `none` is 1 to 3 % in the package's houses


class Expected(NamedTuple):
    """Mean damage after 0 to 200 novice timesteps, (201,), or (201, B) for B episodes."""

    none: np.ndarray
    bare_tables: np.ndarray


def score(
    damage: float | np.ndarray,
    none: float | np.ndarray,
    bare_tables: float | np.ndarray,
    robot_harm: float | np.ndarray = 0,
) -> np.ndarray:
    """Return the score of a damage, of an episode or a mean; NaN where bare tables alone cost as much as no caregiver.

    The arguments are in units of damage: numbers, or arrays of a common shape.
    """
    preventable = np.subtract(none, bare_tables)
    prevented = np.subtract(none, damage) - robot_harm
    return np.divide(prevented, preventable, np.full(prevented.shape, np.nan), where=preventable > 0)


def robot_harm(plan: FloorPlan, outcome: Mapping[str, Any] | pd.DataFrame) -> Any:
    """Return the cost of `strikes` and `candles_dropped` of one or more episodes, in units of damage."""
    lightest = min(filter(None, plan.damage.values()), default=0.0)
    return outcome["strikes"] * lightest + outcome["candles_dropped"] * plan.hazards.worst(Where.ON_TABLE)


def with_costs(episodes: pd.DataFrame, plans: Sequence[FloorPlan]) -> pd.DataFrame:
    """Return a table of episodes with two more columns, in units of damage.

    `preventable` is the damage less that of the bumps into tables if all were bare; it is NaN where a thing on a table
    costs nothing, because bumps into it are not counted. `all_harm` is the damage plus robot harm. Episodes of an older
    version that lacks the counts return without these columns.
    """
    weights, there = plans[0].damage, {kind for plan in plans for kind in plan.hazards.kinds}
    on_tables = [kind for kind in kinds_at(Where.ON_TABLE) if kind in there]
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
    """Scores episodes of some children in a house; the first call simulates the expected damage."""

    def __init__(self, plan: FloorPlan, family: ChildGroup):
        self.plan, self.family = plan, family

    def __call__(self, timestep: int, outcome: Mapping[str, Any]) -> np.ndarray:
        """Return the score of episodes up to a novice timestep, (B,).

        Beyond 200 timesteps the expected damage grows at its mean rate. The keys of `outcome` are columns of
        `EpisodeRecord`, the values numbers or arrays (B,).
        """
        last, longer = min(timestep, EPISODE_TIMESTEPS), max(1.0, timestep / EPISODE_TIMESTEPS)
        none, bare_tables = (curve[last] * longer for curve in self.expected)
        return score(outcome["damage"], none, bare_tables, robot_harm(self.plan, outcome))

    @functools.cached_property
    def expected(self) -> Expected:
        """Expected damage in each of the B episodes of a batch of families; B is 1 for a single family."""
        parts, sizes = zip(*parts_of(self.family), strict=True)
        curves = np.array([expected_damage(self.plan, part) for part in parts])  # (parts, 2, timesteps + 1)
        return Expected(*np.repeat(curves.transpose(1, 2, 0), sizes, axis=2))


def expected_damage(plan: FloorPlan, family: ChildGroup) -> Expected:
    """Return the mean damage to a family without a caregiver and with bare tables only, (201,) each.

    Children given by name are simulated once in a process. A child of another class is copied first, because it may be
    in an episode. If the copy or the simulation fails, there is a warning, and the result is NaN.
    """
    if all(isinstance(child, ChildSpec) for child in family.children):
        return _of_named(plan, family)
    try:
        return _simulated(plan, copy.deepcopy(family, {id(plan): plan}))
    except Exception as error:  # raised by foreign code
        warnings.warn(f"there is no score with children {family}, for they cannot be simulated: {error}", stacklevel=2)
        return Expected(*np.full((2, EPISODE_TIMESTEPS + 1), np.nan))


def _simulated(plan: FloorPlan, family: ChildGroup) -> Expected:
    worlds = GridWorld(plan, family, None), BareTablesWorld(plan, family)
    return Expected(*(_curve(world, len(family)) for world in worlds))


_of_named = functools.lru_cache(maxsize=4096)(_simulated)


def _curve(world: GridWorld, children: int) -> np.ndarray:
    """Return the mean damage at the start and after each novice timestep."""
    found = [0.0]
    world.reset(_streams(children))
    for _ in range(EPISODE_TIMESTEPS):
        world.step()
        found.append(float(world.ledger.damage.mean()))
    return np.array(found)


@functools.lru_cache(maxsize=2)  # drawing takes as long as the episodes
def _streams(children: int) -> Sequence[Sequence[RandomStream]]:
    return [RandomStream.draw_group(np.random.RandomState(seed), children) for seed in range(EPISODES)]


@functools.wraps(tasks.load)
def load(*args: Any, **options: Any) -> Any:
    """Make an environment with a score: tasks may not import the grid. `functools.wraps` gives the documentation."""
    env = tasks.load(*args, **options)
    env.task.scorer = Scorer(env.task.plan, env.task.family)
    return env

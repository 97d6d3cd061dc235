"""The episodes of a block, run in the grid or in the house: their rows and their maps.

A row depends on nothing but the settings and its own place in them.
"""

from __future__ import annotations

import functools
import os
import sys
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from caregiver_mj.caregivers.answers import ReplayedCaregiver, ReplayedPolicy, kept, packed, replayed, unpacked
from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.registry import find_caregiver, is_caregiver, make_caregiver, needs_pictures
from caregiver_mj.children.family import Family, side_by_side
from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.run_folder import Result
from caregiver_mj.experiments.settings import (
    FLOOR,
    NOBODY,
    Block,
    Settings,
    episode_random,
    episode_seed,
    episode_tapes,
)
from caregiver_mj.grid.world import FloorWorld, GridWorld
from caregiver_mj.outside import plain
from caregiver_mj.plans.floor_plan import FloorPlan, check_house
from caregiver_mj.recording.record import COLUMNS, EpisodeRecord

if TYPE_CHECKING:
    import pandas as pd  # imported where used: workers, and commands that only read a plan, do without


MAPS = ("visits", "damage")  # summed for every free cell over all episodes
# What is measured of every episode, one family after the other; each of the maps (`MAPS`), (episodes, free cells); and
# what the caregiver has answered.
_Measured = tuple[list[dict[str, Any]], tuple[np.ndarray, np.ndarray], str]


def _make_house(
    plan: FloorPlan, family: Family, caregiver: str | Caregiver | ReplayedPolicy, seed: int, embodiment: str, sight: str
) -> tuple[Any, Any]:
    """A house, and the policy of the caregiver in it (None for "none"). Building them takes a second."""
    from caregiver_mj import tasks  # here, for the grid does without MuJoCo

    robot = caregiver != "none"
    kwargs = {"robot": robot, "embodiment": embodiment}
    visuals = isinstance(caregiver, str) and needs_pictures(caregiver)
    env = tasks.load(
        "supervise", plan, family, np.random.RandomState(0), task_kwargs=kwargs, visuals=visuals, sight=sight
    )
    if not robot:
        return env, None
    from caregiver_mj.policy.own import make_policy

    return env, make_policy(env, caregiver, seed)


# Blocks of one caregiver and family follow each other; how a server is asked, the environment says: as it was then.
_house = functools.lru_cache(maxsize=1)(lambda _, *which: _make_house(*which))
_WHICH = ("world", "house", "caregiver", "family", "episode", "seed")
_TYPES = {column.name: column.type for column in COLUMNS}
_TEXTS = [name for name, kind in _TYPES.items() if kind == "str"]
_LARGEST = 2.0**53  # from which on a number in a table is none that was counted


@functools.lru_cache(maxsize=1)  # asked before a folder is made, and again by whoever runs them
def try_all(settings: Settings) -> None:
    """Make every caregiver and all children in each house, and every policy of the robot's actions in the first one.

    So that a mistake in somebody's own shows before the others have run for hours. It takes milliseconds for each of
    the package's own, and a second for a policy of actions.

    Raises:
        CaregiverError: One cannot be made.
    """
    for plan in settings.plans:
        for family in settings.families:
            family.make(plan)
        for name in settings.caregivers:
            found = None if name == FLOOR else find_caregiver(name)
            if found is not None and is_caregiver(found):
                check_house(make_caregiver(name, plan, settings.seed), plan)
            elif found is not None and plan is settings.plans[0]:
                _make_house(plan, settings.families[0], name, settings.seed, settings.embodiment, settings.sight)


def run_block(settings: Settings, block: Block, answers: str | None = None) -> Result:
    """Run the episodes of a block; or give a caregiver's `answers` of when it ran before again, and make none.

    Returns:
        Their `rows`, with the columns of `EpisodeRecord` as keys, each family's `maps`, and the caregiver's `answers`.

    Raises:
        CaregiverError: There are no answers to be given again, though there is a caregiver, or some without one.
    """
    if answers is not None:
        check_answers(block, answers)
    plan = settings.plan_of[block.house] if block.house else settings.plan
    run = _run_in_grid if settings.world == "grid" or block.caregiver == FLOOR else _run_in_house
    seeds = [episode_seed(settings.seed, episode) for episode in block.numbers]
    outcomes, maps, answers = run(settings, plan, block, seeds, answers)
    which = [(family, i) for family in block.families for i in range(len(seeds))]
    rows = [
        EpisodeRecord(
            world=settings.world,
            house=plan.name,
            caregiver=block.caregiver,
            family=str(family),
            epsilon=family.epsilon,
            children=len(family),
            episode=block.numbers[i],
            seed=seeds[i],
            sight=settings.sight,
            **measured,
        )
        for (family, i), measured in zip(which, outcomes, strict=True)
    ]
    sums = [values.reshape(len(block.families), len(seeds), -1).sum(axis=1).tolist() for values in maps]
    return {
        "rows": list(map(vars, rows)),
        "maps": {
            str(family): dict(zip(MAPS, of_family, strict=True))
            for family, *of_family in zip(block.families, *sums, strict=True)
        },
        "answers": answers,
    }


def check_answers(block: Block, answers: Any) -> None:
    """Raise CaregiverError unless they can be a caregiver's of a block: a text, empty where nobody answers."""
    if not isinstance(answers, str) or bool(answers) == (block.caregiver in NOBODY):
        wanted = "none" if block.caregiver in NOBODY else "the text of its arrays"
        raise CaregiverError(f"the answers of '{block.caregiver}' must be {wanted}, got {plain(repr(answers), 40)}")


def _run_in_grid(settings: Settings, plan: FloorPlan, block: Block, seeds: list[int], answers: str | None) -> _Measured:
    start = time.perf_counter()
    children, caregiver = side_by_side(plan, block.families, len(seeds)), None
    if block.caregiver == FLOOR:
        world: GridWorld = FloorWorld(plan, children)
    else:
        given = ReplayedCaregiver(plan, unpacked(answers)) if answers else None
        caregiver = given or make_caregiver(block.caregiver, plan, settings.seed)
        world = GridWorld(plan, children, caregiver, sight=settings.sight)
    with kept(caregiver) as text:
        ledger = world.run([episode_tapes(seed, len(children)) for seed in seeds] * len(block.families))
    times = {
        "sim_seconds": EPISODE_TIMESTEPS * plan.cell_size / WALKING_SPEED,
        "wall_seconds": (time.perf_counter() - start) / len(block),
    }
    return [ledger.outcome(i) | times for i in range(len(block))], (ledger.visits, ledger.damage_at), text()


def _run_in_house(
    settings: Settings, plan: FloorPlan, block: Block, seeds: list[int], answers: str | None
) -> _Measured:
    (family,) = block.families
    from caregiver_mj.house.rendering import control  # here, for the grid does without MuJoCo

    which = settings.seed, settings.embodiment, settings.sight
    if answers:
        env, policy = _make_house(plan, family, replayed(plan, answers), *which)
    else:
        env, policy = _house(frozenset(os.environ.items()), plan, family, block.caregiver, *which)
    nothing, caregiver = np.zeros(env.action_spec().shape), getattr(policy, "caregiver", None)
    measured, visits, damage, actions = [], [], [], []
    with kept(caregiver) as text:
        for seed in seeds:
            start = time.perf_counter()
            env.task.reseed(episode_random(seed))
            timestep = env.reset()
            try:
                while not timestep.last():
                    action = policy(timestep) if policy else nothing
                    if policy and not caregiver:
                        actions.append(action)
                    timestep = env.step(action)
            except control.PhysicsError:
                raise CaregiverError(
                    f"the actions of '{block.caregiver}' made the simulation diverge at {env.physics.time():.1f} s of "
                    f"{block}"
                ) from None
            times = {"sim_seconds": env.physics.time(), "wall_seconds": time.perf_counter() - start}
            measured.append(env.task.outcome() | times)
            visits.append(env.task.ledger.visits)
            damage.append(env.task.ledger.damage_at)
    given = packed(actions=np.array(actions, float)) if actions else text()
    return measured, (np.concatenate(visits), np.concatenate(damage)), given


class Tables(NamedTuple):
    """What came of a block, or of a run."""

    episodes: pd.DataFrame  # a row an episode
    maps: pd.DataFrame  # a row for each caregiver, family and free cell


def tables_of(settings: Settings, block: Block, result: Result) -> Tables:
    """Return the tables of one block."""
    import pandas as pd

    episodes = pd.DataFrame(result["rows"])
    for column in _TEXTS:
        episodes[column] = [sys.intern(text) for text in episodes[column]]
    plan = settings.plan_of[block.house] if block.house else settings.plan
    row, column = np.array(plan.free_cells).T
    maps = []
    for family in block.families:
        what: dict[str, Any] = {"world": settings.world, "house": plan.name, "caregiver": block.caregiver}
        what |= {"family": str(family), "epsilon": family.epsilon}
        maps.append(pd.DataFrame(what | {"row": row, "column": column} | result["maps"][str(family)]))
    return Tables(episodes, pd.concat(maps, ignore_index=True))


def belongs(settings: Settings, block: Block, result: Result) -> bool:
    """Return whether a result found in a folder is one of this block: all its rows, and a map for each family."""
    plan = settings.plan_of[block.house] if block.house else settings.plan
    try:
        found = [tuple(row[key] for key in _WHICH) for row in result["rows"]]
        families = {str(family) for family in block.families}
        maps = [result["maps"][str(family)][name] for family in block.families for name in MAPS]
        rows = [[_fits(row[name], kind) for name, kind in _TYPES.items()] for row in result["rows"]]
        if any(row.keys() != _TYPES.keys() for row in result["rows"]) or not all(map(all, rows)):
            return False
        if not all(_fits(values, "list[float]") for values in maps) or result["maps"].keys() != families:
            return False
        if any(of_family.keys() != {*MAPS} for of_family in result["maps"].values()):
            return False
    except (AttributeError, KeyError, TypeError):
        return False
    who = settings.world, plan.name, block.caregiver
    wanted = [
        (*who, str(family), episode, episode_seed(settings.seed, episode))
        for family in block.families
        for episode in block.numbers
    ]
    return found == wanted and {*map(len, maps)} == {len(plan.free_cells)}


def _fits(value: Any, kind: str) -> bool:
    """Whether something can be in a column of a type: numbers are finite, and never negative."""
    if kind == "str":
        return isinstance(value, str)
    if kind == "list[float]":
        return isinstance(value, list) and all(_fits(one, "float") for one in value)
    kinds = (int, float) if kind == "float" else (int,)
    return isinstance(value, kinds) and not isinstance(value, bool) and 0 <= value < _LARGEST


def put_together(settings: Settings, blocks: Sequence[Tables]) -> Tables:
    """Return those of a run: house by house, family by family, caregiver by caregiver."""
    import pandas as pd

    episodes = pd.concat([block.episodes for block in blocks], ignore_index=True)
    maps = pd.concat([block.maps for block in blocks], ignore_index=True)
    orders = {
        "house": {plan.name: i for i, plan in enumerate(settings.plans)},
        "family": {str(family): i for i, family in enumerate(settings.families)},
        "caregiver": {name: i for i, name in enumerate(settings.caregivers)},
    }

    def in_order(table: pd.DataFrame) -> pd.DataFrame:
        in_turn = functools.partial(table.sort_values, [*orders], kind="stable", ignore_index=True)
        return in_turn(key=lambda column: column.map(orders[column.name]))

    keys = [column for column in maps if column not in MAPS]
    return Tables(in_order(episodes), in_order(maps.groupby(keys, sort=False, as_index=False)[list(MAPS)].sum()))

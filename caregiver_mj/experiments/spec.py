"""The specification of an episode: all that its row depends on, checked, written as JSON and hashed."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import itertools
import json
import os
from collections.abc import Mapping, Sequence
from numbers import Integral
from typing import Any

import numpy as np

from caregiver_mj.caregivers.registry import CAREGIVERS, RULE, find_caregiver, is_caregiver
from caregiver_mj.caregivers.server import REAL_TIME, Queries
from caregiver_mj.children.child_group import ChildGroup, ChildSpec
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.children.walk import WALKING_SPEED, check_speed
from caregiver_mj.errors import CaregiverError, check_integer, check_kind
from caregiver_mj.outside import plain
from caregiver_mj.plans.floor_plan import FloorPlan, check_starts
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.plans.visibility import Sight
from caregiver_mj.recording.steps import RANDOM, TARGETS
from caregiver_mj.robot.embodiment import DEFAULT
from caregiver_mj.tasks import TASKS

WORLDS = ("house", "grid")
SUPERVISE = "supervise"  # the task of an evaluation
BARE_TABLES = "floor"  # bare-tables baseline: damage that no caregiver can prevent
NOBODY = ("none", BARE_TABLES)  # baselines without a caregiver


# Arguments of a task with their own fields.
_OWN_FIELDS = ("family", "random", "robot", "embodiment", "sight", "child_speed")
# Default values, as JSON, of fields that a record omits.
_USUAL: dict[str, Any] = {
    "file": "",
    "sight": "all",
    "child_speed": WALKING_SPEED,
    "task": SUPERVISE,
    "task_kwargs": {},
    "queries": Queries().record(),
}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Conditions:
    """The conditions common to all episodes of a run, beside world and seed."""

    embodiment: str = DEFAULT  #: name of the robot in the house
    sight: str = "all"  #: the caregivers' sight, as `plans.visibility.Sight.of` takes it
    child_speed: float = WALKING_SPEED  #: m/s; speed of walking children, by default the paper's 1.6 km/h
    task: str = SUPERVISE  #: one of `ALL_TASKS`, or `targets`
    #: further arguments of the task in the house, as `load` takes them, such as `sensing`, `control_timestep` and
    #: `time_limit`: a dictionary, stored as JSON
    task_kwargs: str = "{}"
    queries: Queries = Queries()  #: how to query remote caregivers
    #: file of a single house, "" if it has a name; no row depends on it
    file: str = ""

    def __post_init__(self) -> None:
        options: Any = self.task_kwargs
        check_kind("queries", self.queries, Queries)
        vars(self).update(
            sight=self.sight if self.sight == "all" else str(Sight.of(self.sight)),
            child_speed=check_speed(self.child_speed),
            task_kwargs="{}" if options == "{}" else _json(options),
        )

    @property
    def options(self) -> dict[str, Any]:
        """The further arguments of the task."""
        return json.loads(self.task_kwargs)

    def shared_record(self) -> dict[str, Any]:
        """Return these fields as JSON, except the robot and default values."""
        found = {name: getattr(self, name) for name in _USUAL}
        found |= {"task_kwargs": self.options, "queries": self.queries.record()}
        return {name: value for name, value in found.items() if value != _USUAL[name]}

    @staticmethod
    def of_shared_record(record: Mapping[str, Any]) -> dict[str, Any]:
        """Return these fields from a record, which may be a stranger's: one of another type raises CaregiverError."""
        found = {
            "embodiment": record["embodiment"],
            **{name: record.get(name, usual) for name, usual in _USUAL.items()},
        }
        for name, value in found.items():
            check_kind(name, value, type(_USUAL.get(name, "")))
        if others := found["queries"].keys() - _USUAL["queries"].keys():
            raise CaregiverError(f"queries must be {', '.join(_USUAL['queries'])}, got '{plain(min(others))}'")
        found["queries"] = Queries(**found["queries"])
        found["queries"].check()
        return found

    def check_episodes(
        self, world: str, plans: Sequence[FloorPlan], families: Sequence[ChildGroup], caregivers: Sequence[str]
    ) -> None:
        """Raise CaregiverError unless every caregiver can act with each family in every house."""
        self.check_world(world)
        if self.task not in (*TASKS, TARGETS):
            raise CaregiverError(f"no task '{self.task}': there are {', '.join([*TASKS, TARGETS])}")
        if world == "grid" and (self.task not in (SUPERVISE, TARGETS) or self.options):
            raise CaregiverError(f"task must be {SUPERVISE} or {TARGETS} in the grid, with no task_kwargs")
        self.queries.check()
        usual_only = self.task == TARGETS or self.queries.thinking == REAL_TIME
        if world == "grid" and usual_only and self.child_speed != WALKING_SPEED:
            raise CaregiverError(
                f"child_speed must be {WALKING_SPEED:.3g} m/s in the grid with targets, or where time does not wait, "
                f"got {self.child_speed}"
            )
        for plan in plans:
            check_kind("a house", plan, FloorPlan, advice=": FloorPlan.load makes one")
        self._check_house(world, plans, families, caregivers)
        for name in caregivers:
            self._check_caregiver(name, world)
        for family in families:
            family.check()

    @staticmethod
    def check_world(world: str) -> None:
        """Raise CaregiverError for an unknown world."""
        if world not in WORLDS:
            raise CaregiverError(f"no world '{world}': there are {', '.join(WORLDS)}")

    def _check_house(
        self, world: str, plans: Sequence[FloorPlan], families: Sequence[ChildGroup], caregivers: Sequence[str]
    ) -> None:
        """Raise CaregiverError unless the robot exists and everybody has room to start."""
        if world == "grid" and self.embodiment == DEFAULT:
            return
        # Imported here: the grid does not need MuJoCo. Rendering first: it checks `MUJOCO_GL` before MuJoCo fails.
        import caregiver_mj.house.rendering  # noqa: F401
        from caregiver_mj.robot.embodiments import find_embodiment

        find_embodiment(self.embodiment)
        if world == "house" and set(caregivers) - {*NOBODY}:
            for plan, family in itertools.product(plans, families):
                check_starts(plan, len(family))

    def _check_caregiver(self, name: str, world: str) -> None:
        if name == BARE_TABLES:
            CAREGIVERS.tell_of_namesakes(BARE_TABLES, f"'{BARE_TABLES}' is what bare tables alone do")
        if name in (BARE_TABLES, RANDOM):
            return
        found = find_caregiver(name, others=(BARE_TABLES,), queries=self.queries)
        if world == "grid" and not (found is None or is_caregiver(found)):
            raise CaregiverError(f"world must be house for '{name}', a policy of the robot's actions, got grid")
        if world == "grid" and getattr(found, "needs_pictures", False):
            raise CaregiverError(f"world must be house for '{name}' with frames, for there are no cameras, got grid")


@dataclasses.dataclass(frozen=True)
class EpisodeSpec(Conditions):
    """An episode: everything that changes its row.

    `EpisodeSpec(FloorPlan.load("paper"), 0.5, "foresight", 3)` is episode 3 of the run of seed 0.
    """

    plan: FloorPlan  #: the house, with the damage of collisions; or its name or file
    family: ChildGroup = dataclasses.field(default_factory=ChildGroup)  #: the children, as `ChildGroup.of` takes them
    #: name of the caregiver or policy, as `find_caregiver` takes it, or BARE_TABLES, or, to record, `random-actions`
    caregiver: str = RULE[0]
    #: number of the episode in the run; None if `seed` is that of the episode, as in the column `seed`
    episode: int | None = 0
    world: str = "house"  #: one of `WORLDS`
    seed: int = 0  #: seed of the run, and of the caregiver

    def __post_init__(self) -> None:
        super().__post_init__()
        plan: Any = self.plan
        check_kind("caregiver", self.caregiver, str)
        vars(self).update(
            plan=FloorPlan.load(plan) if isinstance(plan, (str, os.PathLike)) else plan,
            family=self.family if isinstance(self.family, ChildGroup) else ChildGroup.of(self.family),
            queries=self.queries.for_caregivers([self.caregiver]),
            seed=int(self.seed) if isinstance(self.seed, Integral) else self.seed,
        )

    def check(self, replayed: bool = False) -> None:
        """Raise CaregiverError unless the episode can be run; `replayed` accepts any caregiver."""
        check_integer("seed", self.seed, 0)
        if self.episode is not None:
            check_integer("episode", self.episode, 0)
        self.check_episodes(self.world, (self.plan,), (self.family,), () if replayed else (self.caregiver,))

    @property
    def house(self) -> str:
        """Name or file of the house, as commands take it."""
        return self.file or self.plan.name

    @property
    def own_seed(self) -> int:
        """Seed of the episode, as in the column `seed`."""
        return self.seed if self.episode is None else episode_seed(self.seed, self.episode)

    @property
    def in_grid(self) -> bool:
        """Whether it runs in the grid; the bare-tables baseline always does."""
        return self.world == "grid" or self.caregiver == BARE_TABLES

    @property
    def has_robot(self) -> bool:
        """Whether a caregiver acts."""
        return self.caregiver not in NOBODY

    def __str__(self) -> str:
        """Return its name in messages."""
        number = "the single episode" if self.episode is None else f"episode {self.episode}"
        return (
            f"{number} of seed {self.seed}, '{self.caregiver}' with epsilon {self.family} in house '{self.plan.name}'"
        )

    def record(self) -> dict[str, Any]:
        """Return it as JSON; raise CaregiverError if a child has no name."""
        if any(not isinstance(child, ChildSpec) for child in self.family.children):
            raise CaregiverError("children of a specification must be given by name, such as module:object")
        return {
            "world": self.world,
            "plan": record_of_plan(self.plan),
            "damage": str(self.plan.damage),
            "family": str(self.family),
            "caregiver": self.caregiver,
            "seed": self.seed,
            "episode": self.episode,
            "embodiment": self.embodiment,
            **self.shared_record(),
        }

    def digest(self) -> str:
        """Return the SHA-256 of all that its row depends on."""
        whole = {name: value for name, value in self.record().items() if name != "file"}
        return hashlib.sha256(json.dumps(whole, sort_keys=True, allow_nan=False).encode()).hexdigest()


def _json(options: Mapping[str, Any] | str) -> str:
    """Return a task's options as JSON; they may be data classes such as `Sensing`, or NumPy's numbers."""

    def plainly(value: Any) -> Any:
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            return dataclasses.asdict(value)
        return value.item() if isinstance(value, np.generic) else np.asarray(value, float).tolist()

    try:
        found = dict(json.loads(options) if isinstance(options, str) else options)
        if own := [name for name in _OWN_FIELDS if name in found]:
            raise CaregiverError(f"task_kwargs must be without {own[0]}, for which there is another field")
        return json.dumps(found, sort_keys=True, allow_nan=False, default=plainly)
    except (TypeError, ValueError, RecursionError) as error:
        raise CaregiverError(f"task_kwargs must be numbers, texts, or lists or dictionaries of such: {error}") from None


def record_of_plan(plan: FloorPlan) -> dict[str, Any]:
    """Return a house as JSON, without the damage of collisions."""
    return {"name": plan.name, "cell_size": plan.cell_size, "rows": list(plan.rows)}


def plan_of_record(record: Any, damage: DamageWeights) -> FloorPlan:
    """Return the house of a `record_of_plan`; raise CaregiverError if it is invalid, KeyError if it lacks a field."""
    check_kind("a house", record, dict)
    return FloorPlan.parse("\n".join(record["rows"]), record["name"], record["cell_size"], damage)


@functools.lru_cache(maxsize=2048)  # shared by the families of a batch
def episode_seed(seed: int, episode: int) -> int:
    """Return the seed of an episode from the run's seed and the episode's number."""
    return int(np.random.SeedSequence([seed, episode]).generate_state(1)[0])


def episode_random(seed: int) -> np.random.RandomState:
    """Return the random state of an episode; the house draws more from it than the grid."""
    return np.random.RandomState(seed)


def episode_streams(seed: int, children: int) -> tuple[RandomStream, ...]:
    """Return the children's random streams, which both worlds draw first."""
    return RandomStream.draw_group(episode_random(seed), children)

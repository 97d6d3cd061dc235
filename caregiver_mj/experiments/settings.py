"""The settings of a run: everything that its results depend on, and its division into blocks of episodes."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Mapping, Sequence
from numbers import Integral, Real
from typing import Any

from caregiver_mj.caregivers.server import SCHEMES, Queries
from caregiver_mj.children.behaviour import Behaviour
from caregiver_mj.children.child_group import CHILDREN, ChildGroup, ChildSpec
from caregiver_mj.danger import child_model
from caregiver_mj.errors import CaregiverError, check_integer, check_kind
from caregiver_mj.experiments.provenance import origins, source_digest, versions
from caregiver_mj.experiments.spec import (
    BARE_TABLES,
    SUPERVISE,
    Conditions,
    EpisodeSpec,
    plan_of_record,
    record_of_plan,
)
from caregiver_mj.outside import plain
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import DamageWeights

EPSILONS = child_model.EPSILONS[::-1]  # the paper's five novices
GRID_BLOCK = 1000  # episodes at once: enough to be fast, and few seconds of work lost with a block
MOST_ROWS = 10_000_000  # episodes of a run; more do not fit into memory
_MOST_FAMILIES = 10  # families of a block, whose name lists them
_LONGEST_NAME, _LONGEST_LIST = 500, 100_000  # characters of a name, and of the name of a set of houses


@dataclasses.dataclass(frozen=True)
class Settings(Conditions):
    """A set of episodes: every caregiver with every family in every house, `episodes` times.

    `plans`, `caregivers` and `families` may each be a single one.
    """

    #: the houses, with the damage of collisions
    plans: tuple[FloorPlan, ...]
    world: str = "house"  #: "house", the physical one, or "grid"
    #: names of caregivers or policies, as `find_caregiver` takes them, and BARE_TABLES, the baseline with bare tables
    #: only. It has no caregiver, so both worlds compute it in the grid
    caregivers: tuple[str, ...] = ("none", "expected-danger")
    #: the children; each may be given as `ChildGroup.of` takes it, such as by an epsilon
    families: tuple[ChildGroup, ...] = tuple(map(ChildGroup.of, EPSILONS))
    episodes: int = 20  #: episodes for each caregiver and family
    seed: int = 0  #: seed of the episodes and of random caregivers
    #: name of the set of houses, such as "test-100"; "" if they are listed by name
    houses: str = dataclasses.field(default="", kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        alone = isinstance(self.families, (str, Real, ChildGroup, ChildSpec, Behaviour))
        counts = {name: getattr(self, name) for name in ("episodes", "seed")}
        caregivers = (self.caregivers,) if isinstance(self.caregivers, str) else tuple(self.caregivers)
        vars(self).update(
            plans=(self.plans,) if isinstance(self.plans, FloorPlan) else tuple(self.plans),
            caregivers=caregivers,
            families=tuple(map(ChildGroup.of, (self.families,) if alone else self.families)),
            queries=self.queries.for_caregivers(caregivers),
            **{name: int(count) if isinstance(count, Integral) else count for name, count in counts.items()},
        )

    @classmethod
    def around(cls, spec: EpisodeSpec, caregivers: Sequence[str], episodes: int) -> Settings:
        """Return a run with the house and family of an episode."""
        shared = {field: getattr(spec, field) for field in _COMMON}
        return cls((spec.plan,), caregivers=tuple(caregivers), families=(spec.family,), episodes=episodes, **shared)

    @classmethod
    def of_record(cls, record: dict[str, Any]) -> Settings:
        """Return the settings from a `record`, which may be a stranger's: names of code are not imported.

        Invalid ones raise CaregiverError, missing ones KeyError.
        """
        texts = ("world", "houses", "damage")
        for key, kind in (*((text, str) for text in texts), ("caregivers", list), ("families", list), ("plans", list)):
            check_kind(key, record[key], kind)
        for name in (*record["caregivers"], *record["families"]):
            check_kind("the name of a caregiver or of children", name, str)
        damage = DamageWeights.of(record["damage"])
        found = cls(
            tuple(plan_of_record(plan, damage) for plan in record["plans"]),
            caregivers=tuple(record["caregivers"]),
            families=tuple(map(ChildGroup.named, record["families"])),
            **{key: record[key] for key in ("world", "episodes", "seed", "houses")},
            **cls.of_shared_record(record),
        )
        found.check_whole()
        return found

    @property
    def plan(self) -> FloorPlan:
        """The house; CaregiverError if there are several."""
        if len(self.plans) != 1:
            raise CaregiverError(f"houses must be 1, got {len(self.plans)}")
        return self.plans[0]

    @property
    def place(self) -> str:
        """Name of the houses, for people."""
        return self.houses or " ".join(plan.name for plan in self.plans)

    @functools.cached_property
    def plan_of(self) -> dict[str, FloorPlan]:
        """The houses by name."""
        return {plan.name: plan for plan in self.plans}

    def house_of(self, block: Block) -> FloorPlan:
        """Return the house of a block."""
        return self.plan_of[block.house] if block.house else self.plan

    def check(self) -> None:
        """Raise CaregiverError unless this can be run."""
        self.check_episodes(self.world, self.plans, self.families, self.caregivers)
        self.check_whole()

    def check_whole(self) -> None:
        """Raise CaregiverError unless this is consistent, without importing the code that it names."""
        self.check_world(self.world)
        for plan in self.plans:
            check_kind("a house", plan, FloorPlan, advice=": FloorPlan.load makes one")
        names, houses = tuple(map(str, self.families)), tuple(plan.name for plan in self.plans)
        for what, values in (("caregivers", self.caregivers), ("epsilons", names), ("houses", houses)):
            if not values or len(set(values)) < len(values):
                raise CaregiverError(f"{what} must be at least 1, all different, got {values}")
        if len(damages := {str(plan.damage) for plan in self.plans}) > 1:
            raise CaregiverError(f"damage must be the same in all houses, got {' and '.join(sorted(damages))}")
        check_integer("episodes", self.episodes, 1)
        rows = len(self.plans) * len(self.caregivers) * len(self.families) * self.episodes
        if rows > MOST_ROWS:
            raise CaregiverError(f"episodes must be at most {MOST_ROWS:,} in all, got {rows:,}")
        check_integer("the seed", self.seed, 0)
        for name in (*self.caregivers, *houses, self.embodiment, *self._behaviours()):
            if len(name) > _LONGEST_NAME or not name.isprintable():  # for tables, figures and file names
                most = f"at most {_LONGEST_NAME:,} printable characters"
                raise CaregiverError(f"a name must have {most}, got '{plain(name)}'")
        if (longest := max(len(self.houses), len(self.file))) > _LONGEST_LIST:
            raise CaregiverError(f"houses must have names of at most {_LONGEST_LIST:,} characters, got {longest:,}")

    def _behaviours(self) -> list[str]:
        """The names of the children, each once."""
        children = (child for family in self.families for child in family.children)
        return [*dict.fromkeys(child.behaviour for child in children if isinstance(child, ChildSpec))]

    def check_installed(self) -> None:
        """Raise CaregiverError unless children and robot come from the package or from installed plug-ins.

        The task must be `SUPERVISE` without options, which could make an episode run for ever. Any caregiver is
        accepted, because its answers are replayed.
        """
        if self.task != SUPERVISE or self.options:
            raise CaregiverError(f"its task must be {SUPERVISE} without task_kwargs: --trust runs another one")
        names: list[tuple[str, Mapping[str, Any], str]] = [("child", CHILDREN, name) for name in self._behaviours()]
        if self.world == "house":
            from caregiver_mj.robot.embodiments import EMBODIMENTS  # here, for the grid does without MuJoCo

            names.append(("robot", EMBODIMENTS, self.embodiment))
        for what, registry, name in names:
            if name not in registry:
                raise CaregiverError(
                    f"its {what} must be one of {', '.join(registry)}, got '{name}': --trust imports and runs its code"
                )

    def record(self) -> dict[str, Any]:
        """Return the settings and versions as JSON; two runs with equal records can be merged."""
        return {
            "world": self.world,
            "houses": self.houses,
            "plans": [record_of_plan(plan) for plan in self.plans],
            "damage": str(self.plans[0].damage),
            "caregivers": list(self.caregivers),
            "families": list(map(str, self.families)),
            "epsilons": [family.epsilon for family in self.families],
            "episodes": self.episodes,
            "seed": self.seed,
            "embodiment": self.embodiment,
            "versions": versions(),
            "source": source_digest(self.world),
            **({"code": code} if (code := self.code()) else {}),
            **self.shared_record(),
        }

    def code(self) -> dict[str, str]:
        """Return the origins of foreign code that the results depend on, by its role: see `origins`.

        For a remote caregiver this is only whether it has the default queries.
        """
        caregivers = [name for name in self.caregivers if name != BARE_TABLES]
        how = "asked by default" if self.queries.record() == Queries().record() else "asked as queries say"
        asked = {f"caregiver {name}": how for name in caregivers if name.startswith(SCHEMES)}
        return origins(caregivers, self.families, self.embodiment if self.world == "house" else None) | asked

    def spec(self, plan: FloorPlan, family: ChildGroup, caregiver: str, number: int = 0) -> EpisodeSpec:
        """Return one of its episodes."""
        return EpisodeSpec(plan, family, caregiver, number, **{field: getattr(self, field) for field in _COMMON})

    def specs(self, block: Block) -> list[EpisodeSpec]:
        """Return the episodes of a block, one family after the other."""
        plan = self.house_of(block)
        return [self.spec(plan, family, block.caregiver, i) for family in block.families for i in block.numbers]

    def blocks(self, grid_block: int = GRID_BLOCK, extended_at: Sequence[int] = ()) -> list[Block]:
        """Return the blocks of the run: one episode each in the house, at most `grid_block` in the grid.

        In the grid a block combines families with the same number of children. No block crosses a number of episodes
        in `extended_at`, because earlier blocks are finished.
        """
        together = _alike(self.families) if self.world == "grid" else [(family,) for family in self.families]
        return [
            Block("" if len(self.plans) == 1 else plan.name, caregiver, families, first, min(first + size, end))
            for plan in self.plans
            for families in together
            for size in [max(1, grid_block // len(families)) if self.world == "grid" else 1]
            for caregiver in self.caregivers
            for start, end in itertools.pairwise([0, *extended_at, self.episodes])
            for first in range(start, end, size)
        ]


# Fields that a set and its episodes share.
_COMMON = ("world", "seed", *(field.name for field in dataclasses.fields(Conditions)))


@dataclasses.dataclass(frozen=True)
class Block:
    """Episodes [first, end) of one caregiver and some families in the named house ("": the only one)."""

    house: str
    caregiver: str
    families: tuple[ChildGroup, ...]
    first: int
    end: int

    @property
    def numbers(self) -> range:
        """Numbers of the episodes."""
        return range(self.first, self.end)

    def __len__(self) -> int:
        return len(self.families) * len(self.numbers)

    def __str__(self) -> str:
        """Return its name in messages and files."""
        house, families = self.house and f"{self.house}_", "+".join(map(str, self.families))
        episodes = f"{self.first:06d}" + (f"-{self.end - 1:06d}" if len(self.numbers) > 1 else "")
        return f"{house}{self.caregiver}_epsilon_{families}_episode_{episodes}"


def _alike(families: tuple[ChildGroup, ...]) -> list[tuple[ChildGroup, ...]]:
    groups: list[tuple[ChildGroup, ...]] = []
    for _, alike in itertools.groupby(sorted(families, key=len), key=len):
        found = tuple(alike)
        groups += [found[first : first + _MOST_FAMILIES] for first in range(0, len(found), _MOST_FAMILIES)]
    return groups

"""What to evaluate: everything that the results depend on, the work in pieces, and the seeds of its episodes."""

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
GRID_BLOCK = 1000  # episodes at once: enough to be fast, and a few seconds' work to lose
MOST_ROWS = 10_000_000  # episodes of a run; more do not fit into memory
_MOST_FAMILIES = 10  # in a block, whose name has them all
_LONGEST_NAME, _LONGEST_LIST = 500, 100_000  # characters of a name, and of what several houses are called together


@dataclasses.dataclass(frozen=True)
class Settings(Conditions):
    """A set of episodes: every caregiver with every family in every house, so many times."""

    #: the houses, with what a collision costs; or a single one, as also of caregivers and families
    plans: tuple[FloorPlan, ...]
    world: str = "house"  #: "house", the physical one, or "grid"
    #: names of caregivers or policies, as `find_caregiver` takes them, and BARE_TABLES, the baseline with bare tables
    #: only. It has no caregiver, so both worlds compute it in the grid
    caregivers: tuple[str, ...] = ("none", "expected-danger")
    #: the children; each may be given as `ChildGroup.of` takes it, such as by an epsilon
    families: tuple[ChildGroup, ...] = tuple(map(ChildGroup.of, EPSILONS))
    episodes: int = 20  #: episodes for each caregiver and family
    seed: int = 0  #: seed of the episodes, and of what is random in the caregivers
    #: what the houses are called together, such as "test-100"; nothing if by their names
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
        """Return a run that an episode belongs to, with its house and its family."""
        shared = {field: getattr(spec, field) for field in _COMMON}
        return cls((spec.plan,), caregivers=tuple(caregivers), families=(spec.family,), episodes=episodes, **shared)

    @classmethod
    def of_record(cls, record: dict[str, Any]) -> Settings:
        """Return the settings of a run, from what `record` has made of them, perhaps a stranger.

        Its names of children, robots and caregivers stay names: no code is imported for them.

        Raises:
            CaregiverError: They can be of no run.
            KeyError: Something is missing.
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
        """The house.

        Raises:
            CaregiverError: There are several.
        """
        if len(self.plans) != 1:
            raise CaregiverError(f"houses must be 1, got {len(self.plans)}")
        return self.plans[0]

    @property
    def place(self) -> str:
        """What the houses are called, in few words."""
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
        """Raise CaregiverError unless this can be that of a run, whatever its names are of."""
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
            _check_name(name, _LONGEST_NAME)
        if (longest := max(len(self.houses), len(self.file))) > _LONGEST_LIST:
            raise CaregiverError(f"houses must have names of at most {_LONGEST_LIST:,} characters, got {longest:,}")

    def _behaviours(self) -> list[str]:
        """The names of the children, each once."""
        children = (child for family in self.families for child in family.children)
        return [*dict.fromkeys(child.behaviour for child in children if isinstance(child, ChildSpec))]

    def check_installed(self) -> None:
        """Raise CaregiverError if its children or its robot are others than the package's own or installed plug-ins.

        Nor may its task be another one, whose options could make an episode run for ever. A caregiver may be any, for
        its answers are given again.
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
        """Return the settings and versions as JSON, to tell whether two runs can be one."""
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
        """Return where the code of others that the results depend on comes from, by what it is: see `origins`.

        Of caregivers elsewhere it is only whether they are asked as by default: `queries` says how.
        """
        caregivers = [name for name in self.caregivers if name != BARE_TABLES]
        how = "asked by default" if self.queries.record() == Queries().record() else "asked as queries say"
        asked = {f"caregiver {name}": how for name in caregivers if name.startswith(SCHEMES)}
        return origins(caregivers, self.families, self.embodiment if self.world == "house" else None) | asked

    def spec(self, plan: FloorPlan, family: ChildGroup, caregiver: str, number: int = 0) -> EpisodeSpec:
        """Return an episode of it."""
        return EpisodeSpec(plan, family, caregiver, number, **{field: getattr(self, field) for field in _COMMON})

    def specs(self, block: Block) -> list[EpisodeSpec]:
        """Return the episodes of a block, one family after the other."""
        plan = self.house_of(block)
        return [self.spec(plan, family, block.caregiver, i) for family in block.families for i in block.numbers]

    def blocks(self, grid_block: int = GRID_BLOCK, extended_at: Sequence[int] = ()) -> list[Block]:
        """Return the work in pieces, each done as a whole: one episode in the house, at most so many in the grid.

        In the grid children of all epsilons go side by side, as long as there are as many of them in the house. None
        goes on beyond the numbers of episodes in `extended_at`, for those before have been run already.
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


def _check_name(name: str, longest: int) -> None:
    """Raise CaregiverError unless it can be shown: a name stands in tables, figures and file names."""
    if len(name) > longest or not name.isprintable():
        raise CaregiverError(f"a name must have at most {longest:,} printable characters, got '{plain(name)}'")


@dataclasses.dataclass(frozen=True)
class Block:
    """Episodes [first, end) of one caregiver and each of some families, in the house of a name ("": the only one)."""

    house: str
    caregiver: str
    families: tuple[ChildGroup, ...]
    first: int
    end: int

    @property
    def numbers(self) -> range:
        """Those of the episodes."""
        return range(self.first, self.end)

    def __len__(self) -> int:
        return len(self.families) * len(self.numbers)

    def __str__(self) -> str:
        """Say which, in messages and file names."""
        house, families = self.house and f"{self.house}_", "+".join(map(str, self.families))
        episodes = f"{self.first:06d}" + (f"-{self.end - 1:06d}" if len(self.numbers) > 1 else "")
        return f"{house}{self.caregiver}_epsilon_{families}_episode_{episodes}"


def _alike(families: tuple[ChildGroup, ...]) -> list[tuple[ChildGroup, ...]]:
    groups: list[tuple[ChildGroup, ...]] = []
    for _, alike in itertools.groupby(sorted(families, key=len), key=len):
        found = tuple(alike)
        groups += [found[first : first + _MOST_FAMILIES] for first in range(0, len(found), _MOST_FAMILIES)]
    return groups

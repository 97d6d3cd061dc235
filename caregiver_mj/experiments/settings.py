"""What to evaluate: everything that the results depend on, the work in pieces, and the seeds of its episodes."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Mapping, Sequence
from numbers import Integral, Real
from typing import Any

import numpy as np

from caregiver_mj.caregivers.registry import CAREGIVERS, find_caregiver, is_caregiver, needs_pictures
from caregiver_mj.caregivers.remote import SCHEMES, way_of_asking
from caregiver_mj.children.behaviour import Behaviour
from caregiver_mj.children.family import CHILDREN, ChildSpec, Family
from caregiver_mj.children.tape import Tape
from caregiver_mj.danger import child_model
from caregiver_mj.errors import CaregiverError, check_integer, check_kind
from caregiver_mj.experiments.provenance import origins, source_digest, versions
from caregiver_mj.outside import plain
from caregiver_mj.plans.floor_plan import FloorPlan, check_starts
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.plans.visibility import Sight
from caregiver_mj.robot.embodiment import DEFAULT

WORLDS = ("house", "grid")
FLOOR = "floor"  # bare-tables baseline: damage that no caregiver can prevent
NOBODY = ("none", FLOOR)  # baselines, in the place of a caregiver
EPSILONS = child_model.EPSILONS[::-1]  # the paper's five novices
GRID_BLOCK = 1000  # episodes at once: enough to be fast, and a few seconds' work to lose
MOST_ROWS = 10_000_000  # episodes of a run; more do not fit into memory
_MOST_FAMILIES = 10  # in a block, whose name has them all
_LONGEST_NAME, _LONGEST_LIST = 500, 100_000  # characters of a name, and of what several houses are called together


@dataclasses.dataclass(frozen=True)
class Settings:
    """What to evaluate."""

    #: the houses, with what a collision costs; or a single one, as also of caregivers and families
    plans: tuple[FloorPlan, ...]
    world: str = "house"  #: "house", the physical one, or "grid"
    #: names of caregivers, or of policies, as `find_caregiver` takes them; and FLOOR, which stands for the damage that
    #: remains when nothing but bare tables is left. It is a child's alone, and so reckoned in the grid for both worlds
    caregivers: tuple[str, ...] = ("none", "expected-danger")
    #: the children; each may be given as `Family.of` takes it, such as by an epsilon
    families: tuple[Family, ...] = tuple(map(Family.of, EPSILONS))
    episodes: int = 20  #: episodes for each caregiver and family
    seed: int = 0  #: seed of the episodes, and of what is random in the caregivers
    embodiment: str = DEFAULT  #: name of the robot in the house
    houses: str = ""  #: what the houses are called together, such as "test-100"; nothing if by their names
    #: where a single house of the user's own was read from; nothing if it has a name. Nothing depends on it
    file: str = ""
    sight: str = "all"  #: what the caregivers see, as `plans.visibility.Sight.of` takes it

    def __post_init__(self) -> None:
        alone = isinstance(self.families, (str, Real, Family, ChildSpec, Behaviour))
        counts = {name: getattr(self, name) for name in ("episodes", "seed")}
        vars(self).update(
            plans=(self.plans,) if isinstance(self.plans, FloorPlan) else tuple(self.plans),
            caregivers=(self.caregivers,) if isinstance(self.caregivers, str) else tuple(self.caregivers),
            families=tuple(map(Family.of, (self.families,) if alone else self.families)),
            sight=str(Sight.of(self.sight)),
            **{name: int(count) if isinstance(count, Integral) else count for name, count in counts.items()},
        )

    @classmethod
    def of_record(cls, record: dict[str, Any]) -> Settings:
        """Return the settings of a run, from what `record` has made of them, perhaps a stranger.

        Its names of children, robots and caregivers stay names: no code is imported for them.

        Raises:
            CaregiverError: They can be of no run.
            KeyError: Something is missing.
        """
        record = {"file": "", "sight": "all"} | record
        texts = ("world", "embodiment", "houses", "file", "sight", "damage")
        for key, kind in (*((text, str) for text in texts), ("caregivers", list), ("families", list), ("plans", list)):
            check_kind(key, record[key], kind)
        for name in (*record["caregivers"], *record["families"]):
            check_kind("the name of a caregiver or of children", name, str)
        damage = DamageWeights.of(record["damage"])
        plans = (
            FloorPlan.parse("\n".join(plan["rows"]), plan["name"], plan["cell_size"], damage)
            for plan in record["plans"]
        )
        found = cls(
            tuple(plans),
            caregivers=tuple(record["caregivers"]),
            families=tuple(map(Family.named, record["families"])),
            **{key: record[key] for key in ("world", "episodes", "seed", "embodiment", "houses", "file", "sight")},
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

    def check(self) -> None:
        """Raise CaregiverError unless this can be run."""
        self._check_world()
        self._check_house()
        for name in self.caregivers:
            _check_caregiver(name, self.world)
        for family in self.families:
            family.check()
        self.check_whole()

    def _check_world(self) -> None:
        if self.world not in WORLDS:
            raise CaregiverError(f"no world '{self.world}': there are {', '.join(WORLDS)}")

    def check_whole(self) -> None:
        """Raise CaregiverError unless this can be that of a run, whatever its names are of."""
        self._check_world()
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

        A caregiver may be any, for its answers are given again.
        """
        names: list[tuple[str, Mapping[str, Any], str]] = [("child", CHILDREN, name) for name in self._behaviours()]
        if self.world == "house":
            from caregiver_mj.robot.embodiments import EMBODIMENTS  # here, for the grid does without MuJoCo

            names.append(("robot", EMBODIMENTS, self.embodiment))
        for what, registry, name in names:
            if name not in registry:
                raise CaregiverError(
                    f"its {what} must be one of {', '.join(registry)}, got '{name}': --trust imports and runs its code"
                )

    def _check_house(self) -> None:
        """Raise CaregiverError unless what only the house knows can be run."""
        if self.world == "grid" and self.embodiment == DEFAULT:
            return
        # Here, for the grid does without MuJoCo; rendering first, for MuJoCo stumbles over a wrong `MUJOCO_GL`.
        import caregiver_mj.house.rendering  # noqa: F401
        from caregiver_mj.robot.embodiments import find_embodiment

        find_embodiment(self.embodiment)
        if self.world == "house" and set(self.caregivers) - {"none", FLOOR}:
            for plan, family in itertools.product(self.plans, self.families):
                check_starts(plan, len(family))

    def record(self) -> dict[str, Any]:
        """Return the settings and versions as JSON, to tell whether two runs can be one."""
        return {
            "world": self.world,
            "houses": self.houses,
            "plans": [{"name": p.name, "cell_size": p.cell_size, "rows": list(p.rows)} for p in self.plans],
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
            **({"file": self.file} if self.file else {}),
            **({"sight": self.sight} if self.sight != "all" else {}),
        }

    def code(self) -> dict[str, str]:
        """Return where the code of others that the results depend on comes from, by what it is: see `origins`.

        Of caregivers elsewhere it is how they are asked.
        """
        caregivers = [name for name in self.caregivers if name != FLOOR]
        asked = {f"caregiver {name}": way_of_asking(name) for name in caregivers if name.startswith(SCHEMES)}
        return origins(caregivers, self.families, self.embodiment if self.world == "house" else None) | asked

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


def _check_name(name: str, longest: int) -> None:
    """Raise CaregiverError unless it can be shown: a name stands in tables, figures and file names."""
    if len(name) > longest or not name.isprintable():
        raise CaregiverError(f"a name must have at most {longest:,} printable characters, got '{plain(name)}'")


def _check_caregiver(name: str, world: str) -> None:
    if name == FLOOR:
        CAREGIVERS.tell_of_namesakes(FLOOR, f"'{FLOOR}' is what bare tables alone do")
        return
    found = find_caregiver(name, others=(FLOOR,))
    if world == "grid" and not (found is None or is_caregiver(found)):
        raise CaregiverError(f"world must be house for '{name}', a policy of the robot's actions, got grid")
    if world == "grid" and needs_pictures(name):
        raise CaregiverError(f"world must be house for '{name}' with frames, for there are no cameras, got grid")


@dataclasses.dataclass(frozen=True)
class Block:
    """Episodes [first, end) of one caregiver and each of some families, in the house of a name ("": the only one)."""

    house: str
    caregiver: str
    families: tuple[Family, ...]
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


def _alike(families: tuple[Family, ...]) -> list[tuple[Family, ...]]:
    groups: list[tuple[Family, ...]] = []
    for _, alike in itertools.groupby(sorted(families, key=len), key=len):
        found = tuple(alike)
        groups += [found[first : first + _MOST_FAMILIES] for first in range(0, len(found), _MOST_FAMILIES)]
    return groups


def episode_seed(seed: int, episode: int) -> int:
    """Return the seed of an episode, by the run's seed and the episode's number alone."""
    return int(np.random.SeedSequence([seed, episode]).generate_state(1)[0])


def episode_random(seed: int) -> np.random.RandomState:
    """Return the source of all chance in the episode of a seed; the house draws more from it than the grid."""
    return np.random.RandomState(seed)


def episode_tapes(seed: int, children: int) -> tuple[Tape, ...]:
    """Return what is drawn of it first in both worlds: the chance of the children."""
    return Tape.draw_family(episode_random(seed), children)

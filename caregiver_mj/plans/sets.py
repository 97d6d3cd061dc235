"""Names of generated houses, and sets of houses for training and testing.

A set is `train-N` or `test-N`, the first N houses of one of two disjoint lists. `test-100/17` is house 17 of
`test-100`, counted from 0, and of every other large enough `test-N`. Its own name has its seed: `house-200017`.

`shapes-train-N` and `shapes-test-N` are lists of plain houses and all `SHAPES` in turn. `drawn-10` are ten hand-drawn
test houses. `home-train-N` and `home-test-N` are homes with gates, mugs and small objects on the floor.

`test-100@SECRET`, and the same for other lists, are houses that nobody can tune to without the secret: the judge
publishes its SHA-256 before the tests, and the secret after them.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping

from caregiver_mj.errors import FloorPlanError
from caregiver_mj.plans.floor_plan import FloorPlan, house_names
from caregiver_mj.plans.generator import Request, design, generate_shape
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.plans.rooms import SHAPES

LARGEST_SET = 1000  # houses
FIRST_SEEDS = {
    "train": 100_000,
    "test": 200_000,
    "shapes-train": 300_000,
    "shapes-test": 400_000,
    "home-train": 500_000,
    "home-test": 600_000,
}
SETS = {  # patterns of names for sets, and their meaning
    "train-N": "The first N of 1000 generated houses to learn in.",
    "test-N": "The first N of 1000 generated houses to be tested in, none of them in train-N.",
    "shapes-train-N": "The first N of 1000 houses to learn in, also of other shapes: halls, alcoves, loops and so on.",
    "shapes-test-N": "The first N of 1000 houses to be tested in, also of other shapes.",
    "home-train-N": "The first N of 1000 homes to learn in, with gates, mugs and small objects.",
    "home-test-N": "The first N of 1000 homes to be tested in, with gates, mugs and small objects.",
    "drawn-N": "The first N of 10 houses drawn by hand, to be tested in.",
    "SET@SECRET": "Any set but drawn-N, of houses that nobody knows without the secret.",
}
DRAWN = (
    "bungalow", "courtyard", "farmhouse", "flat", "loft", "maisonette", "railroad", "tenement", "terrace", "villa",
)  # fmt: skip


def house(name: str) -> FloorPlan | None:
    """Make the house with a name such as `house-17` or `test-100/17`; return None for any other name."""
    if (request := Request.from_name(name)) is not None:
        return design(request)[0]
    shape, _, seed = name.rpartition("-")
    if shape in SHAPES and _is_seed(seed):
        return generate_shape(shape, int(seed))
    found, _, index = name.rpartition("/")
    if not _is_seed(index) or (names := _names(found)) is None:
        return None
    if int(index) >= len(names):
        raise FloorPlanError(f"no floor plan '{name}': the houses of {found} are {found}/0 to {found}/{len(names) - 1}")
    return FloorPlan.load(names[int(index)])


def is_generated(name: str) -> bool:
    """Return whether a name is that of a generated house."""
    shape, _, seed = name.rpartition("-")
    return Request.from_name(name) is not None or (shape in SHAPES and _is_seed(seed))


def _is_seed(text: str) -> bool:
    return re.fullmatch(r"\d{1,20}", text, re.ASCII) is not None


def house_set(name: str) -> tuple[FloorPlan, ...]:
    """Make all houses of a set: one of `SETS`, with N from 1 to 1000, for `drawn-N` to 10; or raise FloorPlanError."""
    names = _names(name)
    if names is None:
        raise FloorPlanError(
            f"no set of floor plans '{name}': there are {', '.join(SETS)}, with a number for N, such as test-100"
        )
    return tuple(FloorPlan.load(one) for one in names)


def packaged(name: str) -> tuple[FloorPlan, ...] | None:
    """Make the package's houses with the name of a house or a set; return None for any other name, such as a file's."""
    if name in house_names():
        return (FloorPlan.load(name),)
    if _names(name) is not None:
        return house_set(name)
    return None if (made := house(name)) is None else (made,)


def houses_named(
    names: str | Iterable[str], damage: Mapping[str, float] | str = DamageWeights()
) -> tuple[FloorPlan, ...]:
    """Return the houses with some names, in order: of sets, or as `FloorPlan.load` takes them.

    `damage` is as `DamageWeights.of` takes it.

    Raises:
        FloorPlanError: A house or set is unknown, or two houses have the same name.
    """
    found: dict[str, tuple[str, FloorPlan]] = {}  # by the plan's name: the given one, and the plan
    for name in [names] if isinstance(names, str) else names:
        members = _names(name)
        for one in [name] if members is None else members:
            plan = FloorPlan.load(one, damage=damage)
            other, same = found.setdefault(plan.name, (one, plan))
            if same != plan:
                raise FloorPlanError(
                    f"houses must have different names, got '{plan.name}' in '{other}' and '{one}': rename a file"
                )
            if same is not plan:
                raise FloorPlanError(f"houses must be different, got '{plan.name}' twice")
    return tuple(plan for _, plan in found.values())


def _names(name: str) -> list[str] | None:
    """Return the names of the houses of a set; None for a name that is no set."""
    sets = r"((?:shapes-|home-)?(?:train|test)|drawn)-(\d+)(@.+)?"
    found = isinstance(name, str) and re.fullmatch(sets, name, re.ASCII)
    if not found or (found[1] == "drawn" and found[3]):
        return None
    kind, size, secret = found[1], int(found[2]), found[3]
    largest = len(DRAWN) if kind == "drawn" else LARGEST_SET
    if not 1 <= size <= largest:
        raise FloorPlanError(f"no set of floor plans '{name}': a set has 1 to {largest} houses")
    if kind == "drawn":
        return list(DRAWN[:size])
    first = FIRST_SEEDS[kind]
    shapes = ("house", *SHAPES) if kind.startswith("shapes-") else ("home" if kind.startswith("home-") else "house",)
    seeds = range(first, first + size) if secret is None else _secret_seeds(f"{kind}{secret}", size)
    return [f"{shapes[i % len(shapes)]}-{seed}" for i, seed in enumerate(seeds)]


def _secret_seeds(secret: str, size: int) -> list[int]:
    """Return seeds derived from a secret, outside all lists."""
    numbers = (int(hashlib.sha256(f"{secret} {i}".encode()).hexdigest()[:12], 16) for i in range(size))
    return [10**6 + number % (10**9 - 10**6) for number in numbers]

"""Which children are in the house: one or several, each with its behaviour."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterable, Sequence
from typing import TypeAlias

import numpy as np

from caregiver_mj.children.behaviour import Behaviour, ChildPercept, check_epsilon
from caregiver_mj.children.changing import Drifter, Switcher, Waverer
from caregiver_mj.children.explorer import Explorer
from caregiver_mj.children.novice import Expert, Novice
from caregiver_mj.children.robot_related import Adversary, Avoider, Seeker
from caregiver_mj.children.toddler import Toddler
from caregiver_mj.errors import CaregiverError, check_kind
from caregiver_mj.plans.floor_plan import FloorPlan, check_house
from caregiver_mj.registry import Registry, check_call, errors_of

CHILDREN: Registry[type[Behaviour]] = Registry(
    "child",
    "caregiver_mj.children",
    "caregiver_mj.children.behaviour.Behaviour",
    {
        "novice": Novice,
        "expert": Expert,
        "adversary": Adversary,
        "seeker": Seeker,
        "avoider": Avoider,
        "explorer": Explorer,
        "toddler": Toddler,
        "drifter": Drifter,
        "waverer": Waverer,
        "switcher": Switcher,
    },
)
NOVICE = "novice"


@dataclasses.dataclass(frozen=True)
class ChildSpec:
    """Who a child is."""

    epsilon: float = 0.5  #: share of its moves that are random
    behaviour: str = NOVICE  #: name of what decides its moves, one of `CHILDREN`

    def check(self) -> None:
        """Raise CaregiverError unless there can be such a child, whose code is imported."""
        check_epsilon(self.epsilon)
        check_kind("the name of a child", self.behaviour, str)
        CHILDREN[self.behaviour]  # there may be none, and one that comes from another package may fail to load

    def make(self, plan: FloorPlan) -> Behaviour:
        """Make what decides its moves.

        Raises:
            CaregiverError: There can be no such child, or it cannot be made of a house and an epsilon.
        """
        self.check()
        maker = CHILDREN[self.behaviour]
        check_call(f"child '{self.behaviour}'", maker, plan, self.epsilon)
        with errors_of(f"child '{self.behaviour}'", "as it was made"):
            return maker(plan, self.epsilon)

    def __str__(self) -> str:
        """Return its name in tables and files, of which `ChildGroup.parse` makes the same child again."""
        share = np.format_float_positional(self.epsilon, trim="-")
        return share if self.behaviour == NOVICE else f"{self.behaviour}:{share}"


MOST_CHILDREN = 100  # in a family: of more, no house has room

ChildrenLike: TypeAlias = "ChildGroup | ChildSpec | Behaviour | float | str"  # of one child, or of several


@dataclasses.dataclass(frozen=True)
class ChildGroup:
    """The children that are in a house together."""

    #: at least one. A ready-made behaviour may stand for a child, for one only and in one house only
    children: tuple[ChildSpec | Behaviour, ...] = (ChildSpec(),)

    @classmethod
    def of(cls, who: ChildrenLike | Sequence[ChildrenLike]) -> ChildGroup:
        """Make a family: of an epsilon, a text for `parse`, a child or a family that is made, or several of these.

        Raises:
            CaregiverError: There is no such family.
        """
        if isinstance(who, ChildGroup):
            return who
        if isinstance(who, str):
            return cls.parse(who)
        if isinstance(who, ChildSpec | Behaviour):
            return cls((who,))
        if not isinstance(who, bytes) and (isinstance(who, Sequence) or (isinstance(who, np.ndarray) and who.ndim)):
            return cls(tuple(child for one in who for child in cls.of(one).children))
        try:
            return cls((ChildSpec(float(who)),))
        except (TypeError, ValueError, OverflowError):
            raise CaregiverError(f"children must be an epsilon, a text, or several of these, got {who!r}") from None

    @classmethod
    def parse(cls, text: str, behaviour: str = NOVICE) -> ChildGroup:
        """Read a family: the epsilon of each child, separated by commas, such as "0.5" or "1,.25".

        One with a behaviour other than that given has its name before it, as in "adversary:0.5".

        Raises:
            CaregiverError: It cannot be read, or there is no such child.
        """
        family = cls.named(text, behaviour)
        family.check()
        return family

    @classmethod
    def named(cls, text: str, behaviour: str = NOVICE) -> ChildGroup:
        """Read a family as `parse` does, but import no child: from outside its name may be that of any code.

        Raises:
            CaregiverError: It cannot be read.
        """
        if (most := text.count(",") + 1) > MOST_CHILDREN:
            raise CaregiverError(f"a family must have at most {MOST_CHILDREN} children, got {most}")
        children = []
        for part in text.split(","):
            name, colon, epsilon = part.strip().rpartition(":")
            try:
                share = float(epsilon)
            except ValueError:
                raise CaregiverError(
                    f"a family must be the epsilon of each child, such as 0.5 or 1,.25 or adversary:0.5, got '{text}'"
                ) from None
            children.append(ChildSpec(check_epsilon(share), name if colon else behaviour))
        return cls(tuple(children))

    def check(self) -> None:
        """Raise CaregiverError unless there can be such a family."""
        if not self.children:
            raise CaregiverError("a family must have at least 1 child, got none")
        if len(self.children) > MOST_CHILDREN:
            raise CaregiverError(f"a family must have at most {MOST_CHILDREN} children, got {len(self.children)}")
        for child in self.children:
            if isinstance(child, ChildSpec):
                child.check()

    def make(self, plan: FloorPlan) -> tuple[Behaviour, ...]:
        """Make what decides the moves of each child.

        Raises:
            CaregiverError: There can be no such family, or not in this house.
        """
        self.check()
        check_different([self])
        made = tuple(child.make(plan) if isinstance(child, ChildSpec) else child for child in self.children)
        for child in made:
            check_house(child, plan)
        return made

    def times(self, count: int) -> ChildGroup:
        """Return a family with every child so many times; the draws, and so the moves, of each are its own."""
        if count < 1:
            raise CaregiverError(f"a family must have at least 1 child, got {count}")
        if count * len(self) > MOST_CHILDREN:
            raise CaregiverError(f"a family must have at most {MOST_CHILDREN} children, got {count * len(self)}")
        return ChildGroup(self.children * count)

    @property
    def epsilon(self) -> float:
        """Share of random moves, the mean of its children."""
        return sum(child.epsilon for child in self.children) / len(self.children)

    def __len__(self) -> int:
        return len(self.children)

    def __str__(self) -> str:
        return ",".join(map(str, self.children))


def check_different(families: Iterable[ChildGroup]) -> None:
    """Raise CaregiverError if one object is to be two children: they would share what it remembers."""
    seen: set[int] = set()
    for child in (child for family in families for child in family.children):
        if isinstance(child, Behaviour):
            if id(child) in seen:
                raise CaregiverError(
                    f"each child must be an object of its own, got the same {type(child).__name__} twice: "
                    "make one for each, or give its name"
                )
            seen.add(id(child))


# -- Different children in one batch of episodes, which is as fast as that of one kind of them -------


class SideBySide(Behaviour):
    """Behaviours each of which decides for so many episodes of the batch, the first one for the first.

    Attributes:
        parts: The behaviours.
        sizes: For how many episodes each decides.
        children: Who they are; the behaviours themselves if that is not said.
    """

    def __init__(
        self,
        plan: FloorPlan,
        parts: Sequence[Behaviour],
        sizes: Sequence[int],
        children: Sequence[ChildSpec | Behaviour] = (),
    ):
        super().__init__(plan, sum(part.epsilon for part in parts) / len(parts))
        self.parts, self.sizes, self.children = tuple(parts), tuple(sizes), tuple(children) or tuple(parts)
        ends = np.cumsum([0, *sizes]).tolist()
        self._shares = [slice(*share) for share in itertools.pairwise(ends)]

    def reset(self, batch: int) -> None:
        if batch != sum(self.sizes):
            raise CaregiverError(f"batch must be {sum(self.sizes)}, the episodes of these behaviours, got {batch}")
        for part, size in zip(self.parts, self.sizes, strict=True):
            part.reset(size)

    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        return self._each(lambda part, share: part.act(sight.of(share), draws[share]))

    def epsilons(self, batch: int) -> np.ndarray:
        parts = zip(self.parts, self.sizes, strict=True)
        return np.concatenate([part.epsilons(size) for part, size in parts])

    def reconsider(self, goal: np.ndarray, draw: np.ndarray) -> np.ndarray:
        return self._each(lambda part, share: part.reconsider(goal[share], draw[share]))

    def next_bin(self, draw: np.ndarray) -> np.ndarray:
        return self._each(lambda part, share: part.next_bin(draw[share]))

    def _each(self, answer: Callable[[Behaviour, slice], np.ndarray]) -> np.ndarray:
        return np.concatenate([answer(part, share) for part, share in zip(self.parts, self._shares, strict=True)])


def side_by_side(plan: FloorPlan, families: Sequence[ChildGroup], episodes: int) -> ChildGroup:
    """Return one family that stands for several with as many children each: so many episodes of the first, and so on.

    Raises:
        CaregiverError: One has more children than another, or the same object for one; or as of `ChildGroup.make`.
    """
    if len({len(family) for family in families}) > 1:
        raise CaregiverError(
            f"families must have equally many children, got {', '.join(str(len(family)) for family in families)}"
        )
    check_different(families)
    sizes = [episodes] * len(families)
    made = [family.make(plan) for family in families]
    who = zip(*(family.children for family in families), strict=True)
    each = zip(zip(*made, strict=True), who, strict=True)
    return ChildGroup(tuple(SideBySide(plan, parts, sizes, children) for parts, children in each))


def parts_of(family: ChildGroup) -> list[tuple[ChildGroup, int]]:
    """Return the families that stand side by side in one, each with its number of episodes; else itself, with 1."""
    first = family.children[0]
    if not isinstance(first, SideBySide):
        return [(family, 1)]
    children = [child.children for child in family.children if isinstance(child, SideBySide)]
    return [(ChildGroup(tuple(parts)), size) for *parts, size in zip(*children, first.sizes, strict=True)]

"""Child groups: the children of a house, one or several, each with its behaviour."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterable, Sequence
from typing import TypeAlias

import numpy as np

from caregiver_mj.children.behaviour import Behaviour, ChildPercept, check_epsilon
from caregiver_mj.children.novice import Expert, Novice
from caregiver_mj.children.toddler import Toddler
from caregiver_mj.children.variants import Adversary, Avoider, Drifter, Explorer, Seeker, Switcher, Waverer
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
    """Specification of a child."""

    epsilon: float = 0.5  #: share of random moves
    behaviour: str = NOVICE  #: name of its behaviour, one of `CHILDREN`

    def check(self) -> None:
        """Raise CaregiverError unless this is valid; imports the code of the behaviour."""
        check_epsilon(self.epsilon)
        check_kind("the name of a child", self.behaviour, str)
        CHILDREN[self.behaviour]  # raises for unknown names and packages that fail to load

    def make(self, plan: FloorPlan) -> Behaviour:
        """Make its behaviour.

        Raises:
            CaregiverError: The specification is invalid, or the behaviour cannot be made from a house and an epsilon.
        """
        self.check()
        maker = CHILDREN[self.behaviour]
        check_call(f"child '{self.behaviour}'", maker, plan, self.epsilon)
        with errors_of(f"child '{self.behaviour}'", "as it was made"):
            return maker(plan, self.epsilon)

    def __str__(self) -> str:
        """Return its name in tables and files, the inverse of `ChildGroup.parse`."""
        share = np.format_float_positional(self.epsilon, trim="-")
        return share if self.behaviour == NOVICE else f"{self.behaviour}:{share}"


MOST_CHILDREN = 100  # children of a group; no house has room for more

ChildrenLike: TypeAlias = "ChildGroup | ChildSpec | Behaviour | float | str"  # of one child, or of several


@dataclasses.dataclass(frozen=True)
class ChildGroup:
    """The children of a house."""

    #: at least one; a `Behaviour` object stands for one child in one house
    children: tuple[ChildSpec | Behaviour, ...] = (ChildSpec(),)

    @classmethod
    def of(cls, who: ChildrenLike | Sequence[ChildrenLike]) -> ChildGroup:
        """Make a group from an epsilon, a text for `parse`, a child, a group, or several of these.

        Raises:
            CaregiverError: `who` is none of these, or the text is invalid.
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
        """Parse the epsilon of each child, separated by commas, such as "0.5" or "1,.25".

        A name before an epsilon, as in "adversary:0.5", replaces the given behaviour.

        Raises:
            CaregiverError: The text is invalid, or a behaviour is unknown.
        """
        group = cls.named(text, behaviour)
        group.check()
        return group

    @classmethod
    def named(cls, text: str, behaviour: str = NOVICE) -> ChildGroup:
        """Parse a text like `parse`, but import no behaviours: an untrusted text may name any code.

        Raises:
            CaregiverError: The text is invalid.
        """
        _check_count(text.count(",") + 1)
        children = []
        for part in text.split(","):
            name, colon, epsilon = part.strip().rpartition(":")
            try:
                share = float(epsilon)
            except ValueError:
                raise CaregiverError(
                    f"children must be the epsilon of each, such as 0.5 or 1,.25 or adversary:0.5, got '{text}'"
                ) from None
            children.append(ChildSpec(check_epsilon(share), name if colon else behaviour))
        return cls(tuple(children))

    def check(self) -> None:
        """Raise CaregiverError unless the group is valid."""
        _check_count(len(self.children))
        for child in self.children:
            if isinstance(child, ChildSpec):
                child.check()

    def make(self, plan: FloorPlan) -> tuple[Behaviour, ...]:
        """Make the behaviour of each child; raise CaregiverError if the group is invalid, or for another house."""
        self.check()
        check_different([self])
        made = tuple(child.make(plan) if isinstance(child, ChildSpec) else child for child in self.children)
        for child in made:
            check_house(child, plan)
        return made

    def times(self, count: int) -> ChildGroup:
        """Return a group with `count` of each child; each has its own draws."""
        _check_count(count * len(self))
        return ChildGroup(self.children * count)

    @property
    def epsilon(self) -> float:
        """Mean share of random moves."""
        return sum(child.epsilon for child in self.children) / len(self.children)

    def __len__(self) -> int:
        return len(self.children)

    def __str__(self) -> str:
        return ",".join(map(str, self.children))


def _check_count(children: int) -> None:
    if children < 1:
        raise CaregiverError(f"children must be at least 1, got {children}")
    if children > MOST_CHILDREN:
        raise CaregiverError(f"children must be at most {MOST_CHILDREN}, got {children}")


def check_different(groups: Iterable[ChildGroup]) -> None:
    """Raise CaregiverError if one behaviour object, and its state, would be shared by two children."""
    seen: set[int] = set()
    for child in (child for group in groups for child in group.children):
        if isinstance(child, Behaviour):
            if id(child) in seen:
                raise CaregiverError(
                    f"each child must be a different object, got the same {type(child).__name__} twice: "
                    "make one for each, or give its name"
                )
            seen.add(id(child))


# -- Different child groups in one batch of episodes ------------------------------------------------


class SideBySide(Behaviour):
    """Several behaviours, each for a part of the batch, in order.

    Attributes:
        parts: The behaviours.
        sizes: Number of episodes of each.
        children: Their specifications; the behaviours themselves by default.
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


def side_by_side(plan: FloorPlan, groups: Sequence[ChildGroup], episodes: int) -> ChildGroup:
    """Combine groups of the same size into one for a batch with `episodes` of each, one group after the other.

    Raises:
        CaregiverError: The groups differ in size, share a behaviour object, or are invalid as for `ChildGroup.make`.
    """
    if len({len(group) for group in groups}) > 1:
        raise CaregiverError(
            f"child groups must be of the same size, got {', '.join(str(len(group)) for group in groups)}"
        )
    check_different(groups)
    sizes = [episodes] * len(groups)
    made = [group.make(plan) for group in groups]
    who = zip(*(group.children for group in groups), strict=True)
    each = zip(zip(*made, strict=True), who, strict=True)
    return ChildGroup(tuple(SideBySide(plan, parts, sizes, children) for parts, children in each))


def parts_of(group: ChildGroup) -> list[tuple[ChildGroup, int]]:
    """Return the groups that `side_by_side` combined, each with its number of episodes; else the group, with 1."""
    first = group.children[0]
    if not isinstance(first, SideBySide):
        return [(group, 1)]
    children = [child.children for child in group.children if isinstance(child, SideBySide)]
    return [(ChildGroup(tuple(parts)), size) for *parts, size in zip(*children, first.sizes, strict=True)]

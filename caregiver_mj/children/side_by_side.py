"""Different children side by side in one batch of episodes, which is as fast as that of one kind of them."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np

from caregiver_mj.children.behaviour import Behaviour, Sight
from caregiver_mj.children.family import Family, check_different
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan


class SideBySide(Behaviour):
    """Behaviours each of which decides for so many episodes of the batch, the first one for the first."""

    def __init__(self, plan: FloorPlan, parts: Sequence[Behaviour], sizes: Sequence[int]):
        super().__init__(plan, sum(part.epsilon for part in parts) / len(parts))
        self._parts, self._sizes = tuple(parts), tuple(sizes)
        ends = np.cumsum([0, *sizes]).tolist()
        self._shares = [slice(*share) for share in itertools.pairwise(ends)]

    def reset(self, batch: int) -> None:
        if batch != sum(self._sizes):
            raise CaregiverError(f"batch must be {sum(self._sizes)}, the episodes of these behaviours, got {batch}")
        for part, size in zip(self._parts, self._sizes, strict=True):
            part.reset(size)

    def act(self, sight: Sight, draws: np.ndarray) -> np.ndarray:
        return self._each(lambda part, share: part.act(sight.of(share), draws[share]))

    def epsilons(self, batch: int) -> np.ndarray:
        parts = zip(self._parts, self._sizes, strict=True)
        return np.concatenate([part.epsilons(size) for part, size in parts])

    def reconsider(self, goal: np.ndarray, draw: np.ndarray) -> np.ndarray:
        return self._each(lambda part, share: part.reconsider(goal[share], draw[share]))

    def next_bin(self, draw: np.ndarray) -> np.ndarray:
        return self._each(lambda part, share: part.next_bin(draw[share]))

    def _each(self, answer: Callable[[Behaviour, slice], np.ndarray]) -> np.ndarray:
        return np.concatenate([answer(part, share) for part, share in zip(self._parts, self._shares, strict=True)])


def side_by_side(plan: FloorPlan, families: Sequence[Family], episodes: int) -> Family:
    """Return one family that stands for several with as many children each: so many episodes of the first, and so on.

    Raises:
        CaregiverError: One has more children than another, or the same object for one; or as of `Family.make`.
    """
    if len({len(family) for family in families}) > 1:
        raise CaregiverError(
            f"families must have equally many children, got {', '.join(str(len(family)) for family in families)}"
        )
    check_different(families)
    sizes = [episodes] * len(families)
    made = [family.make(plan) for family in families]
    return Family(tuple(SideBySide(plan, parts, sizes) for parts in zip(*made, strict=True)))

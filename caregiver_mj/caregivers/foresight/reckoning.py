"""What the caregiver reckons with when it looks ahead."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Reckoning:
    """What there is to change about it; studies do. In houses too large for `Values` only the discount counts.

    Attributes:
        discount: Of damage, a timestep.
        rounds: Of iteration over relocations. With none of them none is thought of but the one that would be begun now.
        price: Of a move into a free cell that it denies a child, in damage: so much that it denies no more than the
            rule does, at any epsilon. On `train-100` 0.02 is enough for that; this leaves room (docs/foresight.md).
        obstacle: Whether the child is in its way.
    """

    discount: float = 0.985
    rounds: int = 8
    price: float = 0.05
    obstacle: bool = True


SOUND = Reckoning()

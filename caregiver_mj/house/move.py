"""What a child does in a novice timestep, and what comes of it."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np

from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.recording.ledger import BLOCKED, KINDS, MET


class Booking(NamedTuple):
    """What came of a child's move, as `Ledger.book` wants it of every child."""

    begun: int
    ended: int
    harm: np.ndarray  # (kinds,)
    toy: bool
    blocked: np.ndarray  # (what it led to,), in the order of `BLOCKED`
    met: np.ndarray  # (how it met the caregiver,), in the order of `MET`


@dataclasses.dataclass
class Move:
    """One move of one child.

    Attributes:
        begun: Free cell in which it begins.
        going: Free cell in which it ends, as far as the floor plan tells.
        target: What it leads to, or None if the child stays where it is.
        to_toy: Whether that is the bin that the child wants to get to.
        draw: Uniform draw for the next bin, should the child reach the one that it wants to get to, (1,).
        harm: Damage of the worst thing that has happened so far.
        kind: What that was, one of `KINDS`, or "" if nothing has.
        fell: Whether the child has fallen down stairs.
        reached_toy: Whether it has reached its bin.
        met_robot: Whether the robot was in its way.
        entered: Whether the robot came into the cell that it leads to after the child had set out, or None if it was
            there before.
    """

    begun: int
    going: int
    target: Target | None = None
    to_toy: bool = False
    draw: np.ndarray | None = None
    harm: float = 0.0
    kind: str = ""
    fell: bool = False
    reached_toy: bool = False
    met_robot: bool = False
    entered: bool | None = False

    def hurt(self, kind: str, damage: float) -> None:
        """Takes note of a harm; only the worst one of a timestep counts."""
        if damage > self.harm:
            self.harm, self.kind = damage, kind

    def booking(self, ended: int) -> Booking:
        """What came of it, once it has ended in a free cell."""
        harm = np.array([self.harm if kind == self.kind else 0.0 for kind in KINDS])
        blocked = self.met_robot and ended == self.begun and not self.fell
        what = np.array([blocked and self.target == Target[name.upper()] for name in BLOCKED])
        met = {
            "entered": bool(self.entered),
            "entered_blocked": bool(self.entered and what.any()),
            "held_up": self.met_robot and self.target == Target.FREE and ended != self.begun,
        }
        return Booking(self.begun, ended, harm, self.reached_toy, what, np.array([met[name] for name in MET]))

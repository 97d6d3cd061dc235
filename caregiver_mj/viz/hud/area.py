"""A part of the card along the lower edge."""

from __future__ import annotations

import dataclasses

from caregiver_mj.viz.hud.text import Scale


@dataclasses.dataclass(frozen=True)
class Area:
    """Where two rows of text may stand, in pixels of the card.

    Attributes:
        left: Its left edge.
        right: Its right edge.
        top: Where the upper row begins.
        bottom: The baseline of the lower row.
        scale: Turns lengths of the design into pixels.
    """

    left: int
    right: int
    top: int
    bottom: int
    scale: Scale

    @property
    def width(self) -> int:
        return self.right - self.left

    @property
    def small(self) -> int:
        """Size of labels."""
        return self.scale.font(13)

    @property
    def medium(self) -> int:
        """Size of values."""
        return self.scale.font(17)

    @property
    def large(self) -> int:
        """Size of what matters most."""
        return self.scale.font(24)

    @property
    def row(self) -> int:
        """Distance of the two rows."""
        return self.small + self.medium + self.scale.px(14)

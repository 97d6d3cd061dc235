"""Figures of the report and of studies, from arrays or tables.

They fit a column some 400 pixels wide, to be legible on a phone: bars as in the paper's figures 2 to 4, damage left by
house and by kind, toys kept, survival curves, and maps.
"""

from caregiver_mj.viz.figures.house_map import HURT, WENT, heat_map
from caregiver_mj.viz.figures.shares import KINDS, bars, damage_left, houses, kinds, kinds_in, survival, toys_kept
from caregiver_mj.viz.figures.style import ALONE, GUARDED, Series, as_bytes

__all__ = [
    "ALONE", "GUARDED", "HURT", "KINDS", "WENT", "Series", "as_bytes", "bars", "damage_left", "heat_map", "houses",
    "kinds", "kinds_in", "survival", "toys_kept",
]  # fmt: skip

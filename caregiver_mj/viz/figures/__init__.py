"""The report's figures, which studies use too; their data come as arrays or as plain tables.

They are drawn for a column some 400 pixels wide, so that they can be read on a phone as they are. Bars are as in the
paper's figures 2 to 4; beside them there are the damage that is left, house by house and kind by kind, the toys that
are kept, how long children go on, and maps of the house.
"""

from caregiver_mj.viz.figures.house_map import HURT, WENT, heat_map
from caregiver_mj.viz.figures.shares import KINDS, bars, damage_left, houses, kinds, kinds_in, survival, toys_kept
from caregiver_mj.viz.figures.style import ALONE, GUARDED, Series, as_bytes

__all__ = [
    "ALONE", "GUARDED", "HURT", "KINDS", "WENT", "Series", "as_bytes", "bars", "damage_left", "heat_map", "houses",
    "kinds", "kinds_in", "survival", "toys_kept",
]  # fmt: skip

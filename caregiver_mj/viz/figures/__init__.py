"""The report's figures: bars as in the paper's figures 2 to 4, what is left of the damage, and maps of the house.

They are drawn for a column some 400 pixels wide, so that they can be read on a phone as they are.
"""

from caregiver_mj.viz.figures.bars import Series, bars, damage_left
from caregiver_mj.viz.figures.house_map import HURT, WENT, heat_map
from caregiver_mj.viz.figures.style import ALONE, GUARDED, as_bytes

__all__ = ["ALONE", "GUARDED", "HURT", "WENT", "Series", "as_bytes", "bars", "damage_left", "heat_map"]

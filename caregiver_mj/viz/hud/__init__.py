"""The head-up display: the caregiver's knowledge and actions, drawn on a rendered frame.

A card along the lower edge shows numbers, another in the upper left corner the floor plan with the children's trails.
"""

from caregiver_mj.viz.hud.display import column_inset_size, draw, draw_plan, inset_size, strip_top
from caregiver_mj.viz.moment import ChildState, HudState

__all__ = ["ChildState", "HudState", "column_inset_size", "draw", "draw_plan", "inset_size", "strip_top"]

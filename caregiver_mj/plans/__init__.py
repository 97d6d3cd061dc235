"""Floor plans: the contents of a house, on the grid and in metres."""

from caregiver_mj.plans import floor_plan, sets

floor_plan.SOURCES.append(sets.house)

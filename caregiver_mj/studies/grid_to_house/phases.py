"""The phases of what a caregiver does, in both worlds, and what they are made of."""

from __future__ import annotations

from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.grid.world import CAREGIVER_ACTIONS
from caregiver_mj.plans.floor_plan import FloorPlan

BLOCK, FETCH, CARRY = PHASES = ("block", "fetch", "carry")
DONE, FAILED, GIVEN_UP = "done", "failed", "given up"  # how they end

# What a phase's time in the house goes into, and what that is called.
PARTS = {
    "full": "driving at full rate",
    "slowed": "slowed",
    "stopped": "stopped",
    "aside": "stepping aside",
    "hand": "hand",
}
FULL_RATE, STOPPED_RATE = 0.97, 0.1  # shares of the planned speed: from there on it is full, below this it is stopped


def action_time(plan: FloorPlan) -> float:
    """Seconds of an action of the grid's caregiver."""
    return plan.cell_size / WALKING_SPEED / CAREGIVER_ACTIONS

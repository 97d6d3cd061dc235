"""A prototype's figures, measured before this project, on 2 cores without a GPU."""

from __future__ import annotations

# Names of what is compared with it.
HOUSE = "paper"
MANIPULATOR = "manipulator:bring_ball"  # dm_control's
SOLVE, PLAN, SAMPLE = "mink: one iteration (solve_ik)", "ruckig: plan, 1 axis to a position", "ruckig: sample"
RENDERING = "rendering"

PROTOTYPE = {
    HOUSE: 108.0,  # x real time: the closed loop, an episode of 270 s with 44 candles taken and put down
    MANIPULATOR: 35.0,  # x real time, zero action
    SOLVE: 86.0,  # us
    PLAN: 4.4,  # us
    SAMPLE: 0.5,  # us
    RENDERING: 49.0,  # ms for a frame of 640 x 480 with shadows and 4 x MSAA
}


def prototype(name: str) -> str:
    """Its figure as text; empty where there is none."""
    return f"{PROTOTYPE[name]:g}" if name in PROTOTYPE else ""

"""What there is to see in the tasks: every key of an observation once, with its shape, its unit and what it is."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Observed:
    """What stands under a key of an observation.

    Attributes:
        shape: Its shape in words, such as "(candles, 3)".
        unit: Its units.
        meaning: What it is.
        of: Name of the only task that shows it; empty if all do.
        asked: Whether it is only shown if that is asked for.
    """

    shape: str
    unit: str
    meaning: str
    of: str = ""
    asked: bool = False


OBSERVED = {
    "clock": Observed("()", "timesteps", "novice timesteps since the start, with fraction"),
    "toddler_position": Observed("(3,), of several children (children, 3)", "m, m, rad", "x, y and yaw of each child"),
    "toddler_velocity": Observed("(3,), of several children (children, 3)", "m/s, m/s, rad/s", "their rates"),
    "candle_position": Observed("(candles, 3)", "m", "x, y and height of each candle's foot"),
    "candle_orientation": Observed("(candles, 4)", "", "of each candle, a quaternion (w, x, y, z)"),
    "base_position": Observed("(3,)", "m, m, rad", "x, y and yaw of the robot's base"),
    "base_velocity": Observed("(3,)", "m/s, m/s, rad/s", "their rates"),
    "arm_position": Observed("(joints,)", "rad", "the arm's joints from the shoulder on"),
    "arm_velocity": Observed("(joints,)", "rad/s", "their rates"),
    "finger_position": Observed("(2,)", "m", "how far each finger stands off the middle"),
    "table_height": Observed("(tables,)", "m", "how high each table is, if that is asked for", asked=True),
    "goal_candle": Observed("(candles,)", "", "the candle that is asked for, one-hot", "relocate_candle"),
    "goal_table": Observed("(tables,)", "", "the table that it shall go to, one-hot", "relocate_candle"),
    "candle_to_goal": Observed("(3,)", "m", "the way that is left for the candle", "relocate_candle"),
    "goal_stairwell": Observed("(stairwells,)", "", "the stairwell that is asked for, one-hot", "block_stairs"),
    "base_to_goal": Observed("(2,)", "m", "the way that is left for the base", "block_stairs"),
}

"""What there is to see in all tasks: every key of an observation once, with its shape, its unit and what it is."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Observed:
    """What stands under a key of an observation.

    Attributes:
        shape: Its shape in words, such as "(candles, 3)".
        unit: Its units.
        meaning: What it is.
        within: Its bounds, by a name of `envs.bounds`; empty for wide ones.
        asked: Whether it is only shown if that is asked for, or if there is such a thing in the house.
    """

    shape: str
    unit: str
    meaning: str
    within: str = ""
    asked: bool = False


_OF_EACH_CHILD = "(3,), of several children (children, 3)"
OBSERVED = {
    "clock": Observed("()", "timesteps", "novice timesteps since the start, with fraction", "clock"),
    "toddler_position": Observed(_OF_EACH_CHILD, "m, m, rad", "x, y and yaw of each child", "pose"),
    "toddler_velocity": Observed(_OF_EACH_CHILD, "m/s, m/s, rad/s", "their rates", "rates"),
    "toddler_seen": Observed(
        "(children,)", "", "1 for a child that is seen, or felt, else 0, and all else of it 0, too", "share", True
    ),
    "cell_seen": Observed(
        "(free cells,)", "", "1 for a cell in which a child would be seen wherever it stood, else 0", "share", True
    ),
    "candle_position": Observed("(candles, 3)", "m", "x, y and height of each candle's foot", "place"),
    "candle_orientation": Observed("(candles, 4)", "", "of each candle, a quaternion (w, x, y, z)", "quaternion"),
    "battery_position": Observed("(batteries, 3)", "m", "x, y and height of each battery's foot", "place", True),
    "gate_position": Observed("(gates,)", "rad", "how far each gate stands open; 0 is closed", "gate", True),
    "base_position": Observed("(3,)", "m, m, rad", "x, y and yaw of the robot's base", "pose"),
    "base_velocity": Observed("(3,)", "m/s, m/s, rad/s", "their rates", "rates"),
    "arm_position": Observed("(joints,)", "rad", "the arm's joints from the shoulder on", "arm"),
    "arm_velocity": Observed("(joints,)", "rad/s", "their rates", "arm speed"),
    "finger_position": Observed("(2,)", "m", "how far each finger stands off the middle", "fingers"),
    "table_height": Observed("(tables,)", "m", "how high each table is, if that is asked for", "height", asked=True),
}

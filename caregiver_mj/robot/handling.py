"""How a robot handles candles: where its hand is, how far out while the base drives, and how it grips.

Attributes in metres, radians and seconds unless they say otherwise.
"""

from __future__ import annotations

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True, eq=False)
class Bends:
    """Where to look for the arm's joint positions, as inverse kinematics finds what is near its guess.

    Attributes:
        tucked: Joint positions near those of the tucked arm.
        bend: Index of the joint that pitches the hand.
        bends: Guesses for a hand that points to the ground: so much more than in the tucked arm.
        turn: Index of the joint that turns the hand about its approach.
        held: Index of a joint to hold where the guess has it, in an arm with one more than it needs.
    """

    tucked: np.ndarray
    bend: int
    bends: tuple[float, ...]
    turn: int
    held: int | None = None


@dataclasses.dataclass(frozen=True)
class Postures:
    """Where the hand is, in the base's frame: x ahead of its middle, z above the floor.

    Attributes:
        carry: The pinch point when the arm is tucked, (x, z). A candle held there passes over a child's head, clear
            of it by `WAX_CLEAR` and `FLAME_CLEAR` (`caregiver_mj.recording.contacts`).
        reach: How far ahead a candle on a table is gripped, and put down.
        hand_pitch: Of the hand below the horizontal, so that the wrist clears a table's top.
        lying_reaches: How far ahead a candle that lies may be gripped.
        lying_pitches: Of a hand that takes a candle up level; the later ones reach farther.
        floor_reach: How far ahead a candle is laid on open floor.
    """

    carry: tuple[float, float]
    reach: float
    hand_pitch: float
    lying_reaches: tuple[float, ...]
    lying_pitches: tuple[float, ...]
    floor_reach: float


@dataclasses.dataclass(frozen=True)
class Approach:
    """How far out the hand may be, as a share of its reach, while the base drives.

    Attributes:
        turn: When the base turns.
        drive: When it sets off: the hand is clear of a candle that it has let go, and meets no wall.
        drive_loaded: When it sets off with a candle that is clear of the table.
        above: When it nears a table: all of the hand is higher than a candle.
        above_distance: Metres to go from which on it may be out like that.
        above_yaw: Radians to go, likewise.
        hover: When it is nearly in line with the candle: only the fingertips are not higher.
        hover_across: Metres to go across, likewise.
        hover_distance: Metres to go ahead, likewise.
        hover_yaw: Radians to go, likewise.
        last_time: Seconds before the base has arrived at which the last of the way down begins, such that the base is
            there before the fingers are beside the candle.
        last_distance: Metres to go, likewise.
        last_yaw: Radians to go, likewise.
    """

    turn: float
    drive: float
    drive_loaded: float
    above: float
    above_distance: float
    above_yaw: float
    hover: float
    hover_across: float
    hover_distance: float
    hover_yaw: float
    last_time: float
    last_distance: float
    last_yaw: float


@dataclasses.dataclass(frozen=True)
class Grasp:
    """How the hand takes a candle.

    Attributes:
        open: How far each finger stands off the middle when open.
        closed: The same when closed: less than a candle's radius, and the difference is what squeezes it.
        height: Above a standing candle's foot.
        depth: How much nearer the candle shall be than the middle of the fingers: too far out it is lost sooner than
            too far in.
        grip_time: Seconds from closing to a firm grip.
        release_time: Seconds before the hand is down at which the fingers begin to give way: they squeeze less and
            less. Much earlier, and the candle is not yet pressed upright.
        above_lying: Above the middle of a candle that lies, to keep the fingertips off the ground.
    """

    open: float
    closed: float
    height: float
    depth: float
    grip_time: float
    release_time: float
    above_lying: float


@dataclasses.dataclass(frozen=True)
class Clearances:
    """Room that the robot needs besides its footprint.

    Attributes:
        furniture: Between the base and furniture on a planned path; blended corners and tracking need it.
        corner: How much of that a cut corner may use up.
        standing: How much of it the base may use up where it stands still.
        turning: From the middle of the base to a wall, so that a candle in the tucked hand can be swung round.
        child_turning: From the middle of the base to that of a child, likewise.
        hand: To both sides of the hand's middle when it is out: half its width, and what the arm may be off.
        hand_width: From the middle of a candle that is put down, or taken, to the nearest end of another one; half of
            it counts for a hand that passes a wall.
    """

    furniture: float
    corner: float
    standing: float
    turning: float
    child_turning: float
    hand: float
    hand_width: float

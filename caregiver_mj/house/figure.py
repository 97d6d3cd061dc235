"""The figure of a child, for display only: limbs that swing as it walks, and a head that looks around.

The parts of `models/toddler.xml` are bodies without mass or joints below the child's own. Before a control step a
figure turns them in the model itself, so that every renderer shows them. They are no part of state or physics. Without
visuals there is no figure.

Angles are in rad, about the child's axes: forward (x), left (y) and up (z).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import mujoco

from caregiver_mj.children.walk import ToddlerWalk

_STATE = "walked", "_pace", "_sits", "_reaches", "_holds", "_looks"
_PARTS = "look", "torso", "head", "leg_l", "leg_r", "shin_l", "shin_r", "arm_l", "arm_r", "forearm_l", "forearm_r"
_SIDES = ("l", 1.0), ("r", -1.0)  # side, sign of y
_IN_HAND, _HELD = (0.038, -0.005, -0.103), (0.05, -0.005, -0.133)  # m from the right elbow: in the hand; held

_STEP = 0.17  # m; 12 to 25 cm in the first months of walking (Adolph, Vereijken & Shrout 2003)
_HIPS, _LEG = 0.27, 0.26  # m; hips above the floor, hips to sole, as in models/toddler.xml
_SWING = math.asin(_STEP / 2 / _LEG)  # amplitude of a leg with which feet do not slip
_EVEN = 0.995  # shape of the swing, from a sine (0) to a zigzag (1)
_KNEE, _LIFT = 0.85, 0.12  # bend of knee and hip while the foot is in the air
_SWAY, _ROLL = 0.016, 0.07  # m, rad; shift and roll towards the standing foot: toddlers waddle
_TWIST = 0.16  # of the shoulders against the hips
_ARM_SWING, _GUARD, _ELBOW = 0.45, 0.55, 0.75  # swing, spread and bend of arms, as of beginners
_WALKS = 0.1  # m/s; speed above which it walks
_SEAT = -0.185  # m; height change of the hips of a child sitting on the floor
_TURNS_HEAD, _SEES_ROBOT = 1.0, 1.6  # rad; greatest turn of the head. m; range within which it looks at the robot
_THERE = 1e-6  # rad, or share; no picture shows less
# s; time constants
_PACE_TIME, _SIT_TIME, _RISE_TIME, _REACH_TIME, _HEAD_TIME = 0.10, 0.12, 0.35, 0.15, 0.25


class Mood(NamedTuple):
    """A child's visible behaviour besides walking."""

    hurt: bool = False  # hurt in its present move
    reaches: bool = False  # on its way to a table or toy bin
    holds: bool = False  # has taken a thing


class Figure:
    """The visible parts of one child."""

    walked: float  #: m; walking backwards decreases it

    def __init__(self, model: mujoco.MjModel, prefix: str):
        """Find the parts of the child with a name prefix in a model with visuals."""
        self._turns = {part: model.body_quat[model.body(prefix + part).id] for part in _PARTS}
        self._place = model.body_pos[model.body(f"{prefix}look").id]
        self._held = model.body_pos[model.body(f"{prefix}held").id]
        self.walked = 0.0
        self._pace = self._sits = self._reaches = self._holds = self._looks = 0.0

    @property
    def state(self) -> dict[str, float]:
        """Everything that the next step depends on."""
        return {name: getattr(self, name) for name in _STATE}

    @state.setter
    def state(self, state: dict[str, float]) -> None:
        vars(self).update(state)

    def reset(self) -> None:
        """Stand still at the start of an episode."""
        self.walked = 0.0
        self._pace = self._sits = self._reaches = self._holds = self._looks = 0.0
        self._held[:] = _IN_HAND
        self._pose()

    def step(self, walk: ToddlerWalk, mood: Mood, robot: Sequence[float] | None, seconds: float) -> None:
        """Follow a child for a control step, with a robot at x, y (m), if any."""
        (vx, vy), ahead = walk.velocity, (math.cos(walk.yaw), math.sin(walk.yaw))
        speed = math.hypot(vx, vy)
        self.walked += math.copysign(speed, vx * ahead[0] + vy * ahead[1]) * seconds
        self._sits = _towards(self._sits, mood.hurt, seconds, _SIT_TIME if mood.hurt else _RISE_TIME)
        self._pace = _towards(self._pace, speed > _WALKS, seconds, _PACE_TIME)
        self._reaches = _towards(self._reaches, mood.reaches, seconds, _REACH_TIME)
        self._holds = _towards(self._holds, mood.holds, seconds, _REACH_TIME)
        look = 0.0 if walk.returns or speed < _WALKS else math.atan2(vy, vx) - walk.yaw
        if robot is not None and math.dist(robot, walk.position) < _SEES_ROBOT:
            look = math.atan2(robot[1] - walk.position[1], robot[0] - walk.position[0]) - walk.yaw
        look = min(max(math.remainder(look, math.tau), -_TURNS_HEAD), _TURNS_HEAD)
        self._looks = _towards(self._looks, look, seconds, _HEAD_TIME)
        self._held[:] = _HELD if mood.holds else _IN_HAND
        self._pose()

    def _pose(self) -> None:
        phase = math.pi * self.walked / _STEP  # of the left leg: 0 as it passes the other one forward
        # Uniform except at the turns: the standing foot moves back as the body moves on.
        sine, cosine = math.asin(_EVEN * math.sin(phase)) / math.asin(_EVEN), math.cos(phase)
        sits, stands = self._sits, 1.0 - self._sits
        walks, reaches = self._pace * stands, self._reaches * stands
        swing = walks * _SWING * sine
        sinks = _LEG * (1.0 - math.cos(swing))
        self._place[1] = -walks * _SWAY * cosine
        self._place[2] = _HIPS - sinks + sits * _SEAT
        self._turn("look", roll=walks * _ROLL * cosine)
        self._turn(
            "torso",
            roll=-1.4 * walks * _ROLL * cosine,
            pitch=0.07 * walks + 0.30 * reaches - 0.12 * sits,
            yaw=walks * _TWIST * sine,
        )
        self._turn("head", pitch=0.10 * reaches + 0.22 * sits - 0.07 * walks, yaw=self._looks)
        for side, y in _SIDES:
            self._turn_limbs(side, y, y * sine, max(0.0, y * cosine), walks, reaches)

    def _turn_limbs(self, side: str, y: float, forward: float, lifted: float, walks: float, reaches: float) -> None:
        """Turn leg and arm of a side; `forward` and `lifted` are shares of the leg's greatest swing and lift."""
        sits, mouth = self._sits, self._holds if y < 0 else 0.0
        self._turn(
            f"leg_{side}",
            roll=y * 0.05 * walks,
            pitch=-walks * (_SWING * forward + _LIFT * lifted) - 1.45 * sits,
            yaw=y * 0.35 * sits,
        )
        self._turn(f"shin_{side}", pitch=walks * _KNEE * lifted + 0.15 * sits)
        guard = _GUARD * walks * (1.0 - reaches) + 0.35 * sits
        shoulder = walks * _ARM_SWING * forward - 0.25 * walks - 2.05 * reaches - 0.25 * sits
        elbow = -_ELBOW * walks * (1.0 - reaches) - 0.1 * reaches - 0.2 * sits
        self._turn(
            f"arm_{side}",
            roll=y * guard * (1.0 - mouth),
            pitch=shoulder * (1.0 - mouth) - 1.4 * mouth,
            yaw=-y * 0.8 * mouth,
        )
        self._turn(f"forearm_{side}", pitch=elbow * (1.0 - mouth) - 0.9 * mouth)

    def _turn(self, part: str, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> None:
        """Turn a part about its joint: first about the upward axis, then left, then forward."""
        mujoco.mju_euler2Quat(self._turns[part], (yaw, pitch, roll), "zyx")


def _towards(value: float, aim: float, seconds: float, time: float) -> float:
    """Return a value moved towards its aim for some seconds, with a time constant, and at last set to it."""
    # Decaying on to the smallest numbers, with which processors are slow, it made poses 20 times as slow.
    return aim if abs(aim - value) < _THERE else value + (aim - value) * min(1.0, seconds / time)

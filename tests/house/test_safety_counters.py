"""Every safety counter, in a scenario in which it must rise and a quiet one, beside it, in which it must not.

What happens is physics: the base and the arm are driven by actions, and nothing here keeps the robot from a child.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import mujoco
import numpy as np
import pytest
from scripted_child import Scripted

from caregiver_mj import FloorPlan, load
from caregiver_mj.plans import layout
from caregiver_mj.plans.hazards import CANDLE, MUG
from caregiver_mj.recording.ledger import FAR
from caregiver_mj.recording.record import names
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.view import CHILD_RADIUS

# The house's origin is the middle of the cell (3, 5). The gate's landing is at (.75, 1.5), and its stairs go north.
HOUSE = FloorPlan.parse(
    "###########\n#B....G...#\n#.........#\n#.........#\n#.........#\n#C..M..T..#\n###########", "safety"
)
LANDING = (0.75, 1.5)
AWAY = (-3.0, 0.9)  # where children stand who have nothing to do with it
SIDE = {"mobile_fr3": 0.27, "mobile_ur5e": 0.205}  # metres from the base's middle to its side
FINGERS = {CANDLE: 0.022, MUG: 0.028}  # metres that each stands off the middle, round one
ENERGY = ("contact_energy", "contact_energy_total")
STRUCK = ("strikes_surface", "contact_speed", "contact_seconds_driven")
PRESSED = ("contact_seconds", "contact_force", "contact_impulse")


class Setting(NamedTuple):
    """Where a scenario happens; the last child is the one that it happens to."""

    robot: str
    sight: str
    children: int
    compliant: bool


class Stage:
    def __init__(self, setting: Setting):
        how = {"embodiment": setting.robot, "sight": setting.sight, "compliant_children": setting.compliant}
        children = ",".join([".5"] * setting.children)
        self._env = load("supervise", HOUSE, children, random=0, task_kwargs=how, visuals=False)
        self.robot = self._env.task.embodiment
        self.arm = arm_of(self.robot)
        self.physics = self._env.physics
        self.side = SIDE[setting.robot]

    def begin(self, child, base=(0.0, 0.0, 0.0), arm=None):
        """Begin an episode with a child at x, y, the base in a pose, and the arm tucked or as it is said."""
        self._env.reset()
        self.physics = self._env.physics
        for number, there in enumerate(self._env.task.children):
            there.behaviour = Scripted(HOUSE)
            there.put_at(AWAY[0], AWAY[1] - 0.6 * number)
        there.put_at(*child)
        self._arm = self.arm.tucked if arm is None else arm
        self._gripper = self.robot.grasp.open
        self.physics.set_robot(np.array(base), self._arm)
        self.physics.forward()

    def hold(self, kind, number):
        """Put a thing into the hand, by its number among those on tables."""
        foot = self.physics.pinch_position() - [0.0, 0.0, kind.grip]
        fingers = [self.physics.model.joint(f"robot/{joint}").qposadr[0] for joint in self.robot.names.fingers]
        self.physics.data.qpos[fingers] = FINGERS[kind]
        self.physics.set_candle(number, foot, 0.0)
        self._gripper = 0.0

    def open(self):
        self._gripper = self.robot.grasp.open

    def go(self, seconds, base=(0.0, 0.0, 0.0), swing=0.0):
        """Drive the base (m/s, m/s, rad/s) and swing the arm about the shoulder (rad/s)."""
        action = np.zeros(self._env.action_spec().shape)
        for _ in range(round(seconds / 0.02)):
            self._arm = self._arm + np.eye(len(self._arm))[0] * 0.02 * swing
            action[self.robot.layout.base], action[self.robot.layout.arm] = base, self._arm
            action[self.robot.layout.gripper] = self._gripper
            self._env.step(action)

    def outcome(self):
        return self._env.task.outcome()


def drive_at(speed, gap, quietly):
    """The base drives at the child; in the quiet scenario with another velocity."""

    def run(stage: Stage, loud: bool):
        stage.begin((stage.side + CHILD_RADIUS + gap, 0.0))
        stage.go(1.0, (speed if loud else quietly, 0.0, 0.0))

    return run


def turn_along(stage: Stage, loud: bool):
    stage.begin((0.0, -(stage.side + CHILD_RADIUS - 0.001)))
    stage.go(0.4, (0.0, -0.1, 1.6) if loud else (0.0, -0.01, 0.1))  # it follows a child that gives way


def swing_hand_at(height):
    """The arm swings the hand, at a height, onto the child beside it; or away."""

    def run(stage: Stage, loud: bool):
        ahead = stage.robot.postures.reach
        stage.begin((ahead, -0.35), arm=stage.arm.solve(ahead, height))
        stage.go(0.7, swing=-0.8 if loud else 0.8)

    return run


def let_fall(kind, number):
    """The hand holds a thing for a second, and opens; or holds it on."""

    def run(stage: Stage, loud: bool):
        stage.begin(AWAY)
        stage.hold(kind, number)
        stage.go(1.0)
        if loud:
            stage.open()
        stage.go(0.68 + 1.68)  # to the end of a novice timestep, and another one

    return run


def spill(stage: Stage, loud: bool):
    stage.begin(AWAY)
    if loud:  # it lies on its table
        pose = stage.physics.model.joint("mug_0/joint").qposadr[0]
        stage.physics.data.qpos[pose + 2] += 0.045
        stage.physics.data.qpos[pose + 3 : pose + 7] = [np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0]
    stage.go(1.68)


def close_gate(stage: Stage, loud: bool):
    """The base pushes the panel shut from the stairs, onto a child in the way of it, or with nobody there."""
    x, y = LANDING
    stage.begin((x + 0.1, y - 0.42) if loud else AWAY, base=(x, y + 0.45, 0.0))
    stage.physics.set_gates(0.8)
    stage.go(1.4, (0.0, -0.4, 0.0))


def pinch(stage: Stage, loud: bool):
    """The base presses a child against the wall in the west, or in the middle of the hall."""
    walls = layout.Layout(HOUSE).walls
    west = min(x + half_x for x, y, half_x, half_y in walls if abs(y) < half_y)
    child = west + CHILD_RADIUS - 0.001 if loud else -1.0
    stage.begin((child, 0.0), base=(child + CHILD_RADIUS + stage.side + 0.02, 0.0, 0.0))
    stage.go(0.5, (-0.2, 0.0, 0.0))
    assert stage.outcome()["contact_seconds"] > 0


def carry_past(stage: Stage, loud: bool):
    ahead = stage.robot.postures.reach
    stage.begin((ahead + 0.22, 0.3) if loud else AWAY, base=(0.0, 0.6, 0.0), arm=stage.arm.solve(ahead, 0.5))
    stage.hold(CANDLE, 0)
    stage.go(0.2)
    stage.go(1.0, (0.0, -0.3, 0.0))
    assert stage.outcome()["contact_seconds"] == 0


def touch_with_candle(stage: Stage, loud: bool):
    """The candle in the hand touches the child, and the hand does not."""
    ahead = stage.robot.postures.reach
    stage.begin((ahead + CHILD_RADIUS + 0.022 + (0.01 if loud else 0.2), 0.0), arm=stage.arm.solve(ahead, 0.5))
    stage.hold(CANDLE, 0)
    stage.go(0.2)
    stage.go(0.16, (0.1, 0.0, 0.0))
    assert stage.outcome()["contact_seconds"] == 0


class Scenario(NamedTuple):
    """What happens, which counters rise by it, and which do not."""

    run: Callable[[Stage, bool], None]
    rises: tuple[str, ...]
    stays: tuple[str, ...] = ("pinches", "gate_strikes", "candles_dropped")


BASE = ("contact_seconds_base", "contact_seconds_legs", "contact_force_legs")
SCENARIOS = {
    "base driven into a child": Scenario(
        drive_at(0.4, 0.1, -0.4), ("strikes", "contacts_fast", "pressings", *STRUCK, *PRESSED, *BASE, *ENERGY)
    ),
    "base driven slowly, not creeping": Scenario(
        drive_at(0.15, 0.02, 0.03),
        ("strikes", "strikes_surface", "contacts_slow", "contact_seconds_driven"),
        ("contacts_fast", "pinches"),
    ),
    "base creeping": Scenario(
        drive_at(0.03, 0.003, -0.03), ("contacts_creeping", *PRESSED), ("strikes", "strikes_surface", "contacts_slow")
    ),
    "base turned along a child": Scenario(
        turn_along, ("strikes_surface", "contacts_fast", "contact_seconds_driven"), ("contact_seconds_arm", "pinches")
    ),
    "hand swung at the trunk": Scenario(
        swing_hand_at(0.45), ("strikes", *STRUCK, "contact_seconds_arm", "contact_seconds_trunk", "contact_force_trunk")
    ),
    "hand swung at the head": Scenario(
        swing_hand_at(0.62), ("strikes", *STRUCK, "contact_seconds_arm", "contact_seconds_head", "contact_force_head")
    ),
    "candle let fall": Scenario(let_fall(CANDLE, 0), ("candles_dropped",), ("strikes", "contact_seconds_arm")),
    "mug let fall": Scenario(let_fall(MUG, 1), ("candles_dropped",), ("strikes", "contact_seconds_arm")),
    "mug spilt": Scenario(spill, ("candles_dropped",), ("strikes", "contact_seconds_arm")),
    "gate closed on a child": Scenario(close_gate, ("gate_strikes", "strikes"), ("contacts_fast", "candles_dropped")),
    "child pressed against a wall": Scenario(pinch, ("pinches", "pinch_seconds"), ("gate_strikes", "candles_dropped")),
    "candle carried past a child": Scenario(
        carry_past, ("flame_distance", "flame_seconds", "wax_distance", "wax_seconds")
    ),
    "child touched by the candle in the hand": Scenario(
        touch_with_candle, ("contact_seconds_arm", "wax_seconds"), ("contact_seconds_base", "pinches")
    ),
}
FEW = (  # each robot, sight, number of children and way to give way
    Setting("mobile_fr3", "all", 1, False),
    Setting("mobile_fr3", "camera", 3, True),
    Setting("mobile_ur5e", "walls", 2, True),
    Setting("mobile_ur5e", "rooms:1", 1, False),
)
stage_of = functools.lru_cache(maxsize=len(FEW))(Stage)


def counted(outcome, name):
    """What is counted, such that more of it is worse."""
    return FAR - outcome[name] if name in ("flame_distance", "wax_distance") else outcome[name]


@pytest.mark.parametrize("setting", FEW, ids=["-".join(map(str, one)) for one in FEW])
@pytest.mark.parametrize("name", SCENARIOS)
def test_each_counter_rises_where_it_must_and_nowhere_else(name, setting):
    scenario, stage = SCENARIOS[name], stage_of(setting)
    scenario.run(stage, True)
    loud = stage.outcome()
    scenario.run(stage, False)
    quiet = stage.outcome()
    assert {one: counted(quiet, one) for one in scenario.rises} == dict.fromkeys(scenario.rises, 0)
    assert [one for one in scenario.rises if not counted(loud, one) > 0] == []
    assert {one: counted(loud, one) for one in scenario.stays} == dict.fromkeys(scenario.stays, 0)
    for outcome in (loud, quiet):
        contacts = sum(outcome[f"contacts_{band}"] for band in ("creeping", "slow", "fast"))
        assert (contacts > 0) == (outcome["contact_seconds"] > 0)
        assert outcome["contact_energy"] <= outcome["contact_energy_total"] * (1 + 1e-9)


def test_every_safety_counter_has_a_scenario():
    tried = {name for scenario in SCENARIOS.values() for name in scenario.rises}
    assert tried == {"strikes", "candles_dropped", *names("contact")}


@pytest.mark.parametrize("robot", SIDE)
def test_energy_is_that_of_the_reduced_mass_at_the_contact_speed(robot):
    stage = stage_of(next(one for one in FEW if one.robot == robot and not one.compliant))
    stage.begin((stage.side + CHILD_RADIUS + 0.1, 0.0))
    stage.go(0.6, (0.4, 0.0, 0.0))
    physics, outcome = stage.physics, stage.outcome()
    model, data = physics.model.ptr, physics.data.ptr
    masses, jacobian = np.zeros((model.nv, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_fullM(model, data, masses)  # the mass of robot and child by the whole matrix, and a general solver
    mujoco.mj_jac(model, data, jacobian, None, [stage.side, 0.0, 0.15], model.body("robot/base").id)
    reduced = 1 / (1 / 12 + jacobian[0] @ np.linalg.solve(masses, jacobian[0]))
    assert 9 < reduced < 12  # of the child's 12 kg and a robot that is six to ten times as heavy
    assert outcome["contact_speed"] == pytest.approx(0.4, abs=0.03)
    assert outcome["contact_energy"] == pytest.approx(reduced * outcome["contact_speed"] ** 2 / 2, rel=0.05)

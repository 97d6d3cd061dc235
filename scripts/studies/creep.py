"""How far a candle creeps outwards in the hand while the base turns half round, and why.

The simulation's friction holds a candle by its velocity alone, and knows no place to come back to. Two things then let
it creep on a circle, each at a speed that is proportional to its acceleration w^2 r:

- the pads come to meet the candle's velocity with a time constant of d/2 times that of the contact, and the contact's
  own turning (the derivative of its Jacobian) is not in its equation;
- in a physics step the candle goes on along the tangent, which leaves the circle by w^2 r dt^2 / 2.

So over a turn by an angle it creeps by angle * w * r * (d c + dt) / 2, with the contact's time constant c (`solref`)
and greatest impedance d (`solimp`); somewhat less where the turn speeds up and slows down.
"""

from __future__ import annotations

import argparse
import copy
import dataclasses
import math

import mujoco
import numpy as np

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.tasks import load
from study import Parser, make_console, make_table

ROOM = FloorPlan.parse("#########\n#B......#\n#..C....#\n#....T..#\n#.......#\n#########", "room")
RATES, STEPS = (2.8, 1.4), (0.005, 0.0025, 0.00125)
CONTACTS = (0.01, 0.004, 0.002)
_SETTLE = 0.5  # seconds before and after the turn


@dataclasses.dataclass(frozen=True)
class Held:
    """A simulation in which the robot holds a candle in its tucked hand, at rest."""

    model: mujoco.MjModel
    data: mujoco.MjData
    acceleration: float

    def turn(self, rate: float, timestep: float, contact: float | None = None) -> tuple[float, float]:
        """Turns the base half round in a copy, and returns how far the candle has crept, and should have, in metres.

        Args:
            rate: Of the turn, rad/s.
            timestep: Of the physics, seconds.
            contact: Time constant of the contacts between pads and candle, seconds; None as it is.
        """
        model, data = copy.copy(self.model), mujoco.MjData(self.model)
        data.qpos[:], data.ctrl[:] = self.data.qpos, self.data.ctrl
        model.opt.timestep = timestep
        model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        names = [model.geom(i).name for i in range(model.ngeom)]
        touching = [i for i, name in enumerate(names) if name.endswith("_pad") or name == "candle_0/wax"]
        if contact is not None:
            model.geom_solref[touching, 0] = contact
        data.ctrl[[model.actuator(f"robot/base_{axis}").id for axis in ("x", "y", "yaw")]] = 0.0
        yaw, driven = model.joint("robot/base_yaw").qposadr[0], model.actuator("robot/base_yaw").id
        self._run(model, data, timestep, _SETTLE)
        before, start, turning = self._in_hand(model, data), data.qpos[yaw], 0.0
        while data.qpos[yaw] - start < math.pi - turning**2 / (2 * self.acceleration):
            turning = min(rate, turning + self.acceleration * timestep)
            data.ctrl[driven] = turning
            mujoco.mj_step(model, data)
        while turning > 0.0:
            turning = max(0.0, turning - self.acceleration * timestep)
            data.ctrl[driven] = turning
            mujoco.mj_step(model, data)
        self._run(model, data, timestep, _SETTLE)
        radius = math.dist(data.body("candle_0/candle").xpos[:2], data.body("robot/base").xpos[:2])
        lag = model.geom_solimp[touching[0], 1] * model.geom_solref[touching[0], 0] + timestep
        crept = float(np.linalg.norm(self._in_hand(model, data) - before))
        return crept, math.pi * rate * radius * lag / 2

    def _run(self, model: mujoco.MjModel, data: mujoco.MjData, timestep: float, seconds: float) -> None:
        for _ in range(round(seconds / timestep)):
            mujoco.mj_step(model, data)

    def _in_hand(self, model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
        """Where the candle is, in the hand's frame, (3,), metres."""
        hand, candle = data.body("robot/hand"), data.body("candle_0/candle")
        return hand.xmat.reshape(3, 3).T @ (candle.xpos - hand.xpos)


def hold() -> Held:
    """Has the caregiver's policy take a candle from a table, until the arm is tucked."""
    env = load("relocate_candle", ROOM, 0.0, random=1)
    policy, timestep = CaregiverPolicy(env), env.reset()
    env.task.children[0].put(ROOM.free_cells[-1])
    while not (env.physics.is_gripping() and env.physics.candle_poses()[0, 2] > 0.8 and policy.robot.reached < 0.01):
        timestep = env.step(policy(timestep))
    return Held(env.physics.model.ptr, env.physics.data.ptr, policy.robot.robot.limits.yaw.acceleration)


def add_options(parser: Parser) -> None:
    """Declare the options, of which there are none."""


def run(_options: argparse.Namespace) -> None:
    """Print the table."""
    held = hold()
    table = make_table(
        "A half turn with a candle in the hand",
        "turn, rad/s", "physics step, ms", "contact, ms", "crept, mm", "by the formula, mm",
    )  # fmt: skip
    rows = [(rate, step, None) for rate in RATES for step in STEPS]
    for rate, step, contact in [*rows, *((RATES[0], STEPS[0], contact) for contact in CONTACTS)]:
        crept, expected = held.turn(rate, step, contact)
        shown = "as it is" if contact is None else f"{1e3 * contact:g}"
        table.add_row(f"{rate:g}", f"{1e3 * step:g}", shown, f"{1e3 * crept:.1f}", f"{1e3 * expected:.1f}")
    make_console().print(table)

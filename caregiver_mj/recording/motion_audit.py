"""Audits of what happened, not of what was commanded: velocities, accelerations, jerks, torques and balance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from caregiver_mj.recording.audit import Check, worst
from caregiver_mj.recording.telemetry import EpisodeLog

if TYPE_CHECKING:
    from caregiver_mj.robot.embodiment import Embodiment
    from caregiver_mj.robot.limits import Limits

_LONG = 0.02  # seconds: a control timestep. Accelerations and jerks are those of a physics step, and means over this
_AFTER = 0.25  # seconds after a child's last touch in which what it did to the robot dies away
_HELD = 0.05  # seconds for which both pads have touched a candle that is held
_LOST = 2  # physics steps for which one that is held may be off a pad; it is lost, or laid down, if that takes longer
_LEAST = 1e-3  # rad/s: no joint's limit is less, be it next to the end of its range


def check_motion(log: EpisodeLog, robot: Embodiment) -> list[Check]:
    """Compares what was measured at every physics step with a robot's limits.

    They are those that are published, or else set, not the lower ones that are planned for. Accelerations, jerks and
    the centre of pressure are told as of a physics step and as means over 20 ms; before the first step all was at
    rest. They leave out when a child ran into the robot (`pushed`): it is moved by its walk, whatever is in its way,
    and no motor can help that.

    Those of a single physics step also leave out when a pad was off the candle in the hand for a step or two
    (`off_a_pad`); their means count there, too. That is the simulation's doing, not the robot's. Its contacts neglect
    that their directions turn: on a turn with the hand on its way out, at 1.1 m/s^2 across, the solver has the candle
    keep 0.06 mm to one side, which is as deep as 25 N press it into a pad. Beyond that a pad touches nothing, its
    finger springs at the wax, and base and arm take the knock.
    """
    limits, step, joints = robot.limits, log.physics_timestep, robot.names.arm
    arm, base, fingers = log.arm_velocity, log.base_velocity[:, :2], log.finger_velocity
    windows = {steps: f"{1000 * steps * step:.0f} ms" for steps in (1, round(_LONG / step))}
    free, knocked = ~pushed(log)[:, None], off_a_pad(log)[:, None]
    bound = np.maximum(limits.arm.velocity_at(log.arm_position, arm), _LEAST)
    checks = [worst("arm velocity", "rad/s", arm, bound, step, joints)]
    for order, what in enumerate(("acceleration", "jerk"), start=1):
        unit = f"s^{order + 1}"
        for steps, over in windows.items():
            counts = free & ~knocked if steps == 1 else free
            change = counts * _differences(arm, steps, order, step)
            checks.append(worst(f"arm {what}, {over}", f"rad/{unit}", change, getattr(limits.arm, what), step, joints))
            speed = counts * np.hypot(*_differences(base, steps, order, step).T)[:, None]
            checks.append(
                worst(f"base {what}, {over}", f"m/{unit}", speed, np.array([getattr(limits, f"base_{what}")]), step)
            )
            turn = counts * _differences(log.base_velocity[:, 2:], steps, order, step)
            checks.append(worst(f"turn {what}, {over}", f"rad/{unit}", turn, _only(limits.turn, what), step))
    speed = np.hypot(*base.T)[:, None]
    checks += [
        worst("arm torque", "N m", log.arm_torque, robot.torque, step, joints),
        worst("base speed", "m/s", speed, np.array([limits.base_speed]), step),
        worst("turn rate", "rad/s", log.base_velocity[:, 2:], _only(limits.turn, "velocity"), step),
        worst("finger speed", "m/s", fingers, np.full(2, limits.finger_speed), step, robot.names.fingers),
        *(_balance(log, robot, free, steps, over) for steps, over in windows.items()),
    ]
    return sorted(checks, key=lambda check: check.name)


def pushed(log: EpisodeLog) -> np.ndarray:
    """At which physics steps a child touched the robot, or had just done so, (m,)."""
    touched = np.flatnonzero(np.isfinite(log.contact_speed))
    found = np.zeros(len(log.contact_speed), bool)
    for step in touched:
        found[step : step + 1 + round(_AFTER / log.physics_timestep)] = True
    return found


def off_a_pad(log: EpisodeLog) -> np.ndarray:
    """At which physics steps a pad was off a candle that was held, and touched it again, or had just done so, (m,)."""
    both, after = log.pads >= 2, round(_LONG / log.physics_timestep)
    found = np.zeros(len(both), bool)
    for off in np.flatnonzero(both[:-1] & ~both[1:]) + 1:
        steps = int(np.argmax(both[off : off + _LOST + 1]))  # until it touches it again; 0 if it does not
        held = off - round(_HELD / log.physics_timestep)
        if steps and held >= 0 and both[held:off].all():
            found[off : off + steps + after] = True
    return found


def _only(limits: Limits, what: str) -> np.ndarray:
    return np.array([getattr(limits, what)])


def _differences(velocity: np.ndarray, steps: int, order: int, step: float) -> np.ndarray:
    """Mean rates of change of velocities (m, things) over some steps each, of that order."""
    for _ in range(order):
        before = np.concatenate([np.zeros((steps, velocity.shape[1])), velocity[:-steps]])
        velocity = (velocity - before) / (steps * step)
    return velocity


def _balance(log: EpisodeLog, robot: Embodiment, free: np.ndarray, steps: int, over: str) -> Check:
    """How far the centre of pressure, a mean over some steps, went from the base's middle towards each side.

    A side is a line between two wheels; the base tips over it if the centre is beyond for long.
    """
    places = np.array(robot.wheels.places)[[0, 1, 3, 2]]  # round the base: front left, front right, rear right, left
    names = ("ahead", "to the right", "backwards", "to the left")
    lines = np.roll(places, -1, axis=0) - places
    outwards = np.stack([-lines[:, 1], lines[:, 0]], axis=1) / np.linalg.norm(lines, axis=1)[:, None]
    reach = (outwards * places).sum(axis=1)
    way = free * (log.pressure_centre @ outwards.T)
    sums = np.concatenate([np.zeros((1, len(places))), np.cumsum(way, axis=0)])
    way = np.maximum(0.0, (sums[steps:] - sums[:-steps]) / steps)
    return worst(f"centre of pressure, {over}", "m", way, reach, log.physics_timestep, names)

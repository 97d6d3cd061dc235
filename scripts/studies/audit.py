"""Whether the robot kept its limits in some episodes: prints the worst of each.

It prints two tables: the commands, and the measurements at every physics step. The exit status is 1 if the robot
exceeded a limit. It audits the servos' commands and the simulation's measurements, not the intentions of the skills.
The package contains no code for it: a `Recorder` observes.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import functools
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
import pandas as pd
from rich.console import Console

from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.robot.embodiment import Embodiment, Names
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.tasks import load
from study import Parser, load_house, make_console, make_table, run_all

if TYPE_CHECKING:
    import dm_env

    from caregiver_mj.house.rendering import control

_FAR = 1.0  # metres from the child beyond which distances are not measured
_REACH = 1.2  # metres from the base's centre within which all of the robot is
_MOVES = 0.05  # m/s above which a part of the robot counts as moving; a contact at more than that is a strike
_NEAR = 0.5  # metres from the child within which the robot should be slow, ...
_SLOW = 0.25  # m/s: ... the reduced speed of ISO 10218-1
_LONG = 0.02  # seconds: a control timestep. Accelerations and jerks are those of a physics step, and means over this
_AFTER = 0.25  # seconds after a child's last touch in which what it did to the robot dies away
_HELD = 0.05  # seconds for which both pads have touched a candle that is held
_LOST = 2  # physics steps for which one that is held may be off a pad; it is lost, or laid down, if that takes longer
_GRIP = 0.5  # friction of polyurethane tyres on a wooden floor: 0.4 to 0.6, see the README of the models
_LEAST = 1e-3  # rad/s: no joint's limit is less, be it next to the end of its range


# -- The log -----------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class EpisodeLog:
    """What the robot did in an episode: n control timesteps of m physics steps together."""

    control_timestep: float  # seconds
    physics_timestep: float  # seconds
    commands: np.ndarray  # the actuators' commands, in the order of the robot's model, (n, actuators)
    base_velocity: np.ndarray  # velocity of the base in the world, m/s and rad/s, (m, 3)
    arm_position: np.ndarray  # joint positions, rad, (m, joints)
    arm_velocity: np.ndarray  # joint velocities, rad/s, (m, joints)
    arm_torque: np.ndarray  # torque that moved and held up each joint, N m, (m, joints), see `Dynamics`
    finger_velocity: np.ndarray  # of each finger, m/s, (m, 2)
    pads: np.ndarray  # how many of the fingers' pads touch the wax of a candle, or the neck of a mug, (m,)
    shut: np.ndarray  # whether a gate is at its stop, (m, gates)
    # Where on the floor the wheels' forces together act, in the base's frame, metres, (m, 2).
    pressure_centre: np.ndarray
    friction: np.ndarray  # what the wheels need on the floor: their force along it over that across it, (m,)
    # From each part of the robot that can touch something to the child, metres, (m, parts); infinite if far away.
    distance: np.ndarray
    speed: np.ndarray  # of the point of each part that is nearest to the child, m/s, (m, parts); 0 if far away
    approach: np.ndarray  # the component of that towards the child, m/s, (m, parts)
    # How fast a part that touches the child moves towards it, m/s, (m,); the fastest, and minus infinity where none
    # touches it.
    contact_speed: np.ndarray

    @classmethod
    def record(
        cls, env: control.Environment, policy: Callable[[dm_env.TimeStep], np.ndarray], steps: int
    ) -> EpisodeLog:
        """Runs an episode from its start, for some control timesteps at most, and logs it."""
        timestep = env.reset()
        with Recorder(env) as recorder:
            for _ in range(steps):
                if timestep.last():
                    break
                timestep = env.step(policy(timestep))
        return recorder.log()


@contextlib.contextmanager
def each_physics_step(physics: control.Physics, look: Callable[[], None]) -> Iterator[None]:
    """Calls a function after every physics step of an environment's physics, within a `with` block."""
    step = physics.step

    def watched(nstep: int = 1) -> None:
        touches = []
        for _ in range(nstep):
            step(1)
            touches += physics.touches
            look()
        physics.touches = touches

    physics.step = watched
    try:
        yield
    finally:
        del physics.step  # the class's own shows again


class Recorder(contextlib.AbstractContextManager["Recorder"]):
    """Looks on while an environment with a robot is stepped, within a `with` block of one episode."""

    def __init__(self, env: control.Environment):
        self._physics, self._control_timestep = env.physics, env.control_timestep()
        self._model, self._data = model, data = env.physics.model.ptr, env.physics.data.ptr
        self._dynamics = Dynamics(model, data, env.task.embodiment.names)
        geoms = [model.geom(i) for i in range(model.ngeom)]
        self._parts = [geom.id for geom in geoms if geom.name.startswith("robot/") and geom.contype[0]]
        self._pads = {geom.id for geom in geoms if geom.name.endswith("_pad")}
        self._wax = {geom.id for geom in geoms if geom.name.endswith(("/wax", "/neck"))}
        self._child, self._hull = model.geom("toddler/body").id, model.geom("robot/base_hull").id
        hinges = [model.joint(i).qposadr[0] for i in range(model.njnt) if model.joint(i).name.endswith("/hinge")]
        self._hinges = np.array(hinges, int)
        self._rows: dict[str, list[Any]] = {
            field.name: [] for field in dataclasses.fields(EpisodeLog) if field.type == "np.ndarray"
        }

    def __enter__(self) -> Recorder:
        self._watch = each_physics_step(self._physics, self._look)
        self._watch.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._watch.__exit__(*error)

    def log(self) -> EpisodeLog:
        """What has been recorded so far."""
        arrays = {name: np.array(rows) for name, rows in self._rows.items()}
        physics_timestep = float(self._model.opt.timestep)
        arrays["commands"] = arrays["commands"][:: round(self._control_timestep / physics_timestep)]
        return EpisodeLog(self._control_timestep, physics_timestep, **arrays)

    def _look(self) -> None:
        data = self._data
        touching = {frozenset(pair) for pair in data.contact.geom.tolist()}
        speeds = [touch.speed for touch in self._physics.touches if touch.kind == "robot"]
        across = data.geom_xpos[self._child, :2] - data.geom_xpos[self._hull, :2]
        near = np.hypot(*across) < _FAR + _REACH
        parts = [self._measure(part) if near else (np.inf, 0.0, 0.0) for part in self._parts]
        row = self._dynamics.measure() | dict(zip(("distance", "speed", "approach"), np.transpose(parts), strict=True))
        row["commands"] = data.ctrl.copy()
        row["pads"] = sum(any({pad, wax} in touching for wax in self._wax) for pad in self._pads)
        row["shut"] = data.qpos[self._hinges] <= 0.0
        row["contact_speed"] = max(speeds, default=-np.inf)
        for name, value in row.items():
            self._rows[name].append(value)

    def _measure(self, part: int) -> tuple[float, float, float]:
        """Distance of a geom to the child, and speed and approach of its nearest point."""
        model, data = self._model, self._data
        ends, velocity = np.empty(6), np.empty(6)  # of the shortest line between them; rotation, translation
        point = np.empty(3)
        distance = mujoco.mj_geomDistance(model, data, part, self._child, _FAR, ends)
        if distance >= _FAR:
            return np.inf, 0.0, 0.0
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_GEOM, part, velocity, 0)
        mujoco.mju_cross(point, velocity[:3], ends[:3] - data.geom_xpos[part])
        point += velocity[3:]
        # Where the two overlap, the line goes from the robot's far side to the child's: backwards.
        line = (ends[3:] - ends[:3]) * (1.0 if distance > 0 else -1.0)
        length = mujoco.mju_norm3(line)
        return distance, mujoco.mju_norm3(point), float(point @ line / length) if length > 1e-9 else 0.0


class Dynamics:
    """Measures the robot in a simulation; call `measure` right after a physics step."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, names: Names):
        self._model, self._data = model, data
        base, arm, fingers = ([model.joint(f"robot/{name}") for name in part]
                              for part in (names.base, names.arm, names.fingers))  # fmt: skip
        self._base = [joint.dofadr[0] for joint in base]
        self._arm, self._arm_positions = ([getattr(joint, adr)[0] for joint in arm] for adr in ("dofadr", "qposadr"))
        self._fingers = [joint.dofadr[0] for joint in fingers]
        self._body = int(base[-1].bodyid[0])
        self._inertial = np.empty(model.nv)

    def measure(self) -> dict[str, np.ndarray]:
        """Columns of an `EpisodeLog`, of the last physics step."""
        data = self._data
        return {
            "base_velocity": data.qvel[self._base],
            "arm_position": data.qpos[self._arm_positions],
            "arm_velocity": data.qvel[self._arm],
            "arm_torque": self._torque(),
            "finger_velocity": data.qvel[self._fingers],
            **self._on_the_floor(),
        }

    def _torque(self) -> np.ndarray:
        """What the motors did in the step: whatever moved the joints that was not gravity, gears or contacts.

        Compensation of the arm's weight is the motors' work too, however the model has it. What the simulation calls
        the actuators' force is from the step's beginning; they have damping, and over the step it changes.
        """
        data = self._data
        mujoco.mj_mulM(self._model, data, self._inertial, data.qacc)
        others = data.qfrc_constraint + data.qfrc_spring + data.qfrc_damper - data.qfrc_bias
        return (self._inertial - others)[self._arm]

    def _on_the_floor(self) -> dict[str, Any]:
        """Where the force from the ground would have to act to move all of the robot as it moved, and its slope.

        The base's three joints take up any force and torque; what they do instead of the wheels, and what contacts do
        to the robot, is in the wrench between base and world.
        """
        data, body = self._data, self._body
        mujoco.mj_rnePostConstraint(self._model, data)
        tx, ty, _, fx, fy, fz = data.cfrc_int[body]  # about the robot's centre of mass
        x, y, height = data.subtree_com[body]
        # About the centre of pressure, on the floor, there is no torque but about the vertical.
        place = np.array([x - (ty + height * fx) / fz, y + (tx - height * fy) / fz])
        turned = data.xmat[body].reshape(3, 3)[:2, :2]
        return {"pressure_centre": (place - data.xpos[body, :2]) @ turned, "friction": float(np.hypot(fx, fy) / fz)}


# -- What is judged by it ----------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Check:
    """The worst that came of one limit."""

    name: str  # what is limited
    unit: str  # its unit
    worst: float  # the value that came closest to its limit, or exceeded it most
    limit: float  # that limit
    time: float  # when that was, seconds since the start
    where: str = ""  # which joint or finger it was, if there are several

    @property
    def ratio(self) -> float:
        """The worst value over the limit: at most 1 if it was kept."""
        return self.worst / self.limit


def check_limits(log: EpisodeLog, robot: Embodiment) -> list[Check]:
    """Compares what was commanded in an episode, and the base's speed, with a robot's limits.

    They are those that are published, not the lower ones that it plans for. What else was measured: `check_motion`.

    Velocity, acceleration and jerk of the arm are finite differences of the commanded joint positions at the control
    timestep; before the first command it was at rest there.
    """
    step, limits, joints = log.control_timestep, robot.limits, robot.names.arm
    rest = np.concatenate([log.commands[:1]] * 3 + [log.commands])  # (n + 3, actuators)
    targets, fingers = rest[:, robot.actuators.arm], rest[2:, robot.actuators.gripper]
    arm = [np.diff(targets, order, axis=0)[3 - order :] / step**order for order in (1, 2, 3)]  # (n, joints) each
    speed = np.hypot(*log.base_velocity[:, :2].T)[:, None]
    return [
        worst("arm velocity, commanded", "rad/s", arm[0], limits.arm.velocity, step, joints),
        worst("arm acceleration, commanded", "rad/s^2", arm[1], limits.arm.acceleration, step, joints),
        worst("arm jerk, commanded", "rad/s^3", arm[2], limits.arm.jerk, step, joints),
        worst("base speed, measured", "m/s", speed, limits.base_speed, log.physics_timestep),
        worst(
            "finger speed, commanded",
            "m/s",
            np.diff(fingers, axis=0) / step,
            limits.finger_speed,
            step,
            ("left", "right"),
        ),
    ]


@dataclasses.dataclass(frozen=True)
class NearChild:
    """How the robot moved near the child in an episode."""

    # The least distance between the child and a part of the robot that moved, metres: 0 or less where it ran into it.
    separation: float
    approach_separation: float  # the least distance to a part that moved towards the child, metres
    fast_seconds: float  # how long a part was within 0.5 m of the child and faster than 0.25 m/s
    contact_speed: float  # of a part that touched the child towards it, at the most, m/s; 0 without contact


def near_child(log: EpisodeLog) -> NearChild:
    """Measures how the robot moved near the child."""
    fast = (log.distance < _NEAR) & (log.speed > _SLOW)
    return NearChild(
        separation=float(log.distance.min(where=log.speed > _MOVES, initial=np.inf)),
        approach_separation=float(log.distance.min(where=log.approach > _MOVES, initial=np.inf)),
        fast_seconds=float(fast.any(axis=1).sum() * log.physics_timestep),
        contact_speed=float(log.contact_speed.max(initial=0.0)),
    )


def worst(
    name: str, unit: str, values: np.ndarray, bounds: np.ndarray | float, timestep: float, names: Sequence[str] = ("",)
) -> Check:
    """Return the check of values (steps, things) with bounds, of all, (things,) or of every step (steps, things)."""
    size = np.abs(values)
    bounds = np.broadcast_to(bounds, size.shape)
    place = row, column = np.unravel_index(np.argmax(size / bounds), size.shape)
    return Check(name, unit, float(size[place]), float(bounds[place]), float(row * timestep), names[int(column)])


def check_motion(log: EpisodeLog, robot: Embodiment) -> list[Check]:
    """Compare the measurements at every physics step with a robot's limits.

    The limits are the published ones, or else ours, not the lower ones for planning. Accelerations, jerks and the
    centre of pressure are given for a physics step and as means over 20 ms; everything is at rest before the first
    step. They leave out the time in which a child ran into the robot (`pushed`), because its walk moves it whatever is
    in its way, and no motor can prevent that.

    Those of a single physics step also leave out when a pad was off the candle in the hand for a step or two
    (`off_a_pad`); their means count there, too. That is the simulation's doing, not the robot's. Its contacts neglect
    that their directions turn: on a turn with the hand on its way out, at 1.1 m/s^2 across, the solver has the candle
    keep 0.06 mm to one side, which is as deep as 25 N press it into a pad. Beyond that a pad touches nothing, its
    finger springs at the wax, and base and arm take the knock.

    Nor do they count when a gate has run into its stop (`shut`); their means do. Its tongue springs in, and the panel
    goes ahead with what the finger had yielded: it stops within a physics step, however slowly the hand goes.
    """
    limits, step, joints = robot.limits, log.physics_timestep, robot.names.arm
    arm, base, turns = log.arm_velocity, log.base_velocity[:, :2], log.base_velocity[:, 2:]
    windows = {steps: f"{1000 * steps * step:.0f} ms" for steps in (1, round(_LONG / step))}
    free, knocked = ~pushed(log)[:, None], (off_a_pad(log) | shut(log))[:, None]
    checks = []
    for (order, what), (steps, over) in itertools.product(enumerate(("acceleration", "jerk"), 1), windows.items()):
        change = (free & ~knocked if steps == 1 else free) * _differences(
            np.hstack([arm, base, turns]), steps, order, step
        )
        along = np.hypot(*change[:, -3:-1].T)[:, None]
        unit = f"s^{order + 1}"
        checks += [
            worst(f"arm {what}, {over}", f"rad/{unit}", change[:, :-3], getattr(limits.arm, what), step, joints),
            worst(f"base {what}, {over}", f"m/{unit}", along, getattr(limits, f"base_{what}"), step),
            worst(f"turn {what}, {over}", f"rad/{unit}", change[:, -1:], getattr(limits.turn, what), step),
        ]
    bound = np.maximum(limits.arm.velocity_at(log.arm_position, arm), _LEAST)
    checks += [
        worst("arm velocity", "rad/s", arm, bound, step, joints),
        worst("arm torque", "N m", log.arm_torque, robot.torque, step, joints),
        worst("base speed", "m/s", np.hypot(*base.T)[:, None], limits.base_speed, step),
        worst("turn rate", "rad/s", turns, limits.turn.velocity, step),
        worst("finger speed", "m/s", log.finger_velocity, limits.finger_speed, step, robot.names.fingers),
        *(_balance(log, robot, free, steps, over) for steps, over in windows.items()),
        *(_friction(log, free, steps, over) for steps, over in windows.items()),
    ]
    return sorted(checks, key=lambda check: check.name)


def pushed(log: EpisodeLog) -> np.ndarray:
    """At which physics steps a child touched the robot, or had just done so, (m,)."""
    return _at_and_after(np.isfinite(log.contact_speed), _AFTER, log)


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


def shut(log: EpisodeLog) -> np.ndarray:
    """At which physics steps a gate had just come to its stop, (m,)."""
    return _at_and_after(np.diff(log.shut.astype(int), axis=0, prepend=1).max(axis=1, initial=0) > 0, _LONG, log)


def _at_and_after(happens: np.ndarray, seconds: float, log: EpisodeLog) -> np.ndarray:
    """Mark the physics steps in which something happens, and those of some seconds after each, (m,)."""
    return np.convolve(happens, np.ones(1 + round(seconds / log.physics_timestep)))[: len(happens)] > 0


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


def _friction(log: EpisodeLog, free: np.ndarray, steps: int, over: str) -> Check:
    """What friction the wheels needed, a mean over some steps, beside what is reckoned with."""
    needed = np.convolve(free[:, 0] * log.friction, np.ones(steps) / steps, "valid")[:, None]
    return worst(f"friction needed, {over}", "", needed, _GRIP, log.physics_timestep)


# -- The study ---------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Audit:
    """What came out for one episode, or for several."""

    seconds: float  # how long it was
    commanded: list[Check]  # limits of what was commanded
    measured: list[Check]  # limits of what was measured
    near: NearChild  # how the robot moved near the child
    pushed: float  # seconds in which a child ran into it, or had just done so, whose accelerations do not count
    off: float = 0.0  # seconds in which a pad was off the candle in the hand for a moment, see `check_motion`

    @classmethod
    def of(cls, log: EpisodeLog, embodiment: str | None, name: str) -> Audit:
        """Audit an episode, which has a name in the tables."""
        robot = find_embodiment(embodiment)
        commanded, measured = (
            [dataclasses.replace(found, where=", ".join(filter(None, (found.where, name)))) for found in checks]
            for checks in (check_limits(log, robot), check_motion(log, robot))
        )
        left_out = (float(found(log).sum() * log.physics_timestep) for found in (pushed, off_a_pad))
        return cls(len(log.commands) * log.control_timestep, commanded, measured, near_child(log), *left_out)

    @classmethod
    def of_dict(cls, values: Mapping[str, Any]) -> Audit:
        """The audit that `dataclasses.asdict` has made a dictionary of."""
        made = {which: [Check(**check) for check in values[which]] for which in ("commanded", "measured")}
        return cls(**{**values, **made, "near": NearChild(**values["near"])})

    @property
    def worst_ratio(self) -> float:
        """The greatest ratio to a limit, commanded or measured."""
        return max(check.ratio for check in (*self.commanded, *self.measured))

    @classmethod
    def worst_of(cls, audits: Sequence[Audit]) -> Audit:
        """The worst of every limit of several episodes, and their times together."""

        def checks_of(which: str) -> list[Check]:
            each = zip(*(getattr(audit, which) for audit in audits), strict=True)
            return [max(checks, key=lambda check: check.ratio) for checks in each]

        near = pd.DataFrame([dataclasses.asdict(audit.near) for audit in audits])
        how = {"separation": "min", "approach_separation": "min", "fast_seconds": "sum", "contact_speed": "max"}
        seconds, pushed, off = (sum(getattr(audit, name) for audit in audits) for name in ("seconds", "pushed", "off"))
        return cls(seconds, checks_of("commanded"), checks_of("measured"), NearChild(**near.agg(how)), pushed, off)


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("house", ["paper"], "names or files of floor plans")
    parser.add("epsilon", 0.5, "share of the novice's moves that are random")
    parser.add("seed", 0, "seed of the first episode in each house")
    parser.add("episodes", 1, "how many in each house")
    parser.add("seconds", 340.0, "simulated seconds, at most")
    parser.add("embodiment", None, "the robot (default: the task's own)", metavar="NAME")
    parser.add_jobs()


def run(options: argparse.Namespace) -> None:
    """Audit episodes; print the worst of them."""
    jobs = [(house, options.seed + i) for house in options.house for i in range(options.episodes)]
    processes = min(options.jobs, len(jobs))
    found = Audit.worst_of(run_all(functools.partial(audit, options), jobs, processes, "auditing"))
    report(make_console(), found)


def audit(options: argparse.Namespace, job: tuple[str, int]) -> Audit:
    """Audit the episode of a house and a seed."""
    house, seed = job
    task_kwargs = {"embodiment": options.embodiment} if options.embodiment else None
    env = load("supervise", load_house(house), options.epsilon, random=seed, task_kwargs=task_kwargs)
    log = EpisodeLog.record(env, CaregiverPolicy(env), round(options.seconds / env.control_timestep()))
    return Audit.of(log, options.embodiment, f"{house} {seed}")


def report(console: Console, found: Audit) -> None:
    """Prints what came out."""
    for what, checks in (("commanded", found.commanded), ("measured", found.measured)):
        table = make_table(
            f"Limits in {found.seconds:.0f} s: {what}", "", "worst", "limit", "unit", "ratio", "where", "at s"
        )
        for check in checks:
            row = (check.name, f"{check.worst:.4g}", f"{check.limit:.4g}", check.unit, f"{check.ratio:.3f}")
            table.add_row(*row, check.where, f"{check.time:.2f}", style="" if check.ratio <= 1 else "bold red")
        console.print(table)
    near = found.near
    console.print(
        f"Near the child: a moving part came to {near.separation:.3f} m, one that moved towards it to "
        f"{near.approach_separation:.3f} m.\n"
        f"Within 0.5 m a part was faster than 0.25 m/s for {near.fast_seconds:.1f} s; contacts at "
        f"{near.contact_speed:.3f} m/s at most.\n"
        f"For {found.pushed:.1f} s it was being pushed by the child, or had just been: left out of what was measured "
        "of accelerations, jerks and balance.\n"
        f"For {found.off:.2f} s a pad was off the candle in the hand for a moment, or had just been: left out of "
        "accelerations and jerks over 5 ms; those over 20 ms count."
    )
    print(f"{found.seconds:.0f} s: ratios to limits, commanded and measured, at most {found.worst_ratio:.3f}")

"""What all tasks share: the house's physics with named readouts, and the episode of a toddler in it."""

from __future__ import annotations

import collections
import dataclasses
import math

import mujoco
import numpy as np
from dm_control import mujoco as dm_mujoco
from dm_control.mujoco import wrapper
from dm_control.rl import control
from dm_control.suite import base
from dm_env import specs

from caregiver_mj.children import novice
from caregiver_mj.children.novice import Novice, NoviceTape
from caregiver_mj.children.walk import ToddlerWalk, novice_timestep
from caregiver_mj.errors import CaregiverError
from caregiver_mj.grid.world import Outcome, caregiver_start
from caregiver_mj.house.rendering import OffscreenRendering
from caregiver_mj.house.scene import build_house
from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import ACTIONS, Cell, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot import kinematics
from caregiver_mj.robot.motion import OPEN

CONTROL_TIMESTEP = 0.02  # seconds; a prototype's grasps held at 50 Hz as well as at 100 Hz

ARM_JOINTS = tuple(f"robot/{name}" for name in kinematics.ARM_JOINTS)
TODDLER_JOINTS = ("toddler/x", "toddler/y", "toddler/yaw")
BASE_JOINTS = ("robot/base_x", "robot/base_y", "robot/base_yaw")
WHEELS = tuple(f"robot/wheel_{where}" for where in ("front_left", "front_right", "rear_left", "rear_right"))
_WHEEL_RADIUS, _WHEEL_TRACK = 0.075, 0.33  # metres: radius; half length plus half width between the wheels

STRIKE_SPEED = 0.05  # m/s towards the child at a contact, above which it counts as a strike
_STRIKE_PAUSE = 0.5  # seconds within which contacts are one strike

_LOOSE = 0.024  # metres of each finger off the middle above which it does not touch a candle
_CANDLE_OFFSET = 0.02  # metres off the table's centre at the start, at most, in x and in y
_STANDING_COSINE = math.cos(math.radians(30))  # of a candle's tilt, beyond which it counts as fallen


@dataclasses.dataclass(frozen=True)
class Touch:
    """A contact of the toddler.

    Attributes:
        kind: What it touches: "wall", "table", "bin", "stairwell", "candle" or "robot".
        index: Number of that thing in the floor plan, -1 for walls and the robot.
        direction: Unit vector from the toddler towards it, on the floor.
        speed: How fast the touching part of the robot moves towards the toddler, m/s (0 for all else).
    """

    kind: str
    index: int
    direction: tuple[float, float]
    speed: float


class Physics(OffscreenRendering, dm_mujoco.Physics):
    """The house's simulation, with named readouts and the toddler's contacts at every physics step.

    Attributes:
        touches: All contacts of the toddler during the last `step`.
    """

    @classmethod
    def from_plan(cls, plan: FloorPlan, robot: bool = True, table_positions: np.ndarray | None = None) -> Physics:
        """Builds the house of a floor plan; the arguments are those of `build_house`."""
        spec = build_house(plan, robot, table_positions)
        # Tells in one number, at every physics step, whether there is any contact worth reading.
        spec.add_sensor(
            name="toddler_touch",
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_GEOM,
            objname="toddler/body",
            intprm=[1, 0, 1],  # report how many contacts are found
        )
        return cls.from_model(wrapper.MjModel(spec.compile()))

    def _reload_from_data(self, data) -> None:
        super()._reload_from_data(data)
        model, raw = self.model.ptr, self.data.ptr
        self._raw = (model, raw)
        self._qpos, self._ctrl = raw.qpos, raw.ctrl
        self.has_robot = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, BASE_JOINTS[0]) >= 0
        self._toddler = _views(model, raw, TODDLER_JOINTS)
        self._toddler_geom = model.geom("toddler/body").id
        self._touch_found = raw.sensordata[model.sensor("toddler_touch").adr[0] :]
        self._things = [_thing_of(model.geom(i).name) for i in range(model.ngeom)]
        self.candle_count = sum(model.joint(i).name.startswith("candle_") for i in range(model.njnt))
        candles = [model.joint(f"candle_{i}/joint").qposadr[0] for i in range(self.candle_count)]
        self._candle_rows = np.array(candles, int)[:, None] + np.arange(7)
        if self.has_robot:
            self._base = _views(model, raw, BASE_JOINTS)
            self._arm = _views(model, raw, ARM_JOINTS)
            self._fingers = _views(model, raw, ("robot/finger_left", "robot/finger_right"))
            self._wheels = _views(model, raw, WHEELS)
        self.touches: list[Touch] = []

    # -- Readouts --------------------------------------------------------------------------------

    def base_position(self) -> np.ndarray:
        """Pose x, y (m) and yaw (rad) of the base, (3,)."""
        return self._base[0].copy()

    def base_velocity(self) -> np.ndarray:
        """Its velocity in the world's axes, (3,), m/s and rad/s."""
        return self._base[1].copy()

    def arm_position(self) -> np.ndarray:
        """Joint positions (7,), rad."""
        return self._arm[0].copy()

    def arm_velocity(self) -> np.ndarray:
        """Joint velocities (7,), rad/s."""
        return self._arm[1].copy()

    def finger_position(self) -> np.ndarray:
        """How far each finger stands off the middle, (2,), m."""
        return self._fingers[0].copy()

    def is_gripping(self) -> bool:
        """Whether the fingers are as close together as round a candle, or closer."""
        return bool(self.finger_position().sum() < 2 * _LOOSE)

    def toddler_position(self) -> np.ndarray:
        """Pose x, y (m) and yaw (rad) of the toddler, (3,)."""
        return self._toddler[0].copy()

    def toddler_velocity(self) -> np.ndarray:
        """Its velocity, (3,), m/s and rad/s."""
        return self._toddler[1].copy()

    def candle_poses(self) -> np.ndarray:
        """Position of each candle's foot (m) and its orientation (quaternion), (candles, 7)."""
        return self._qpos[self._candle_rows]

    def candle_upright(self) -> np.ndarray:
        """Cosine of each candle's tilt, (candles,)."""
        _, x, y, _ = self.candle_poses()[:, 3:].T
        return 1.0 - 2.0 * (x * x + y * y)

    # -- Writing ---------------------------------------------------------------------------------

    def set_action(self, action: np.ndarray) -> None:
        """Sets what the robot's actuators shall do, (11,); both fingers get the last value."""
        self._ctrl[:11], self._ctrl[11] = action, action[10]

    def set_toddler(self, walk: ToddlerWalk) -> None:
        """Moves the toddler, which is kinematic, to where its walk has got to."""
        position, velocity = self._toddler
        position[0], position[1], position[2] = *walk.position, walk.yaw
        velocity[0], velocity[1], velocity[2] = *walk.velocity, walk.yaw_rate

    def set_robot(self, base: np.ndarray, arm: np.ndarray) -> None:
        """Puts the robot somewhere, its hand open, for the start of an episode: base pose (3,) and arm joints (7,)."""
        self._base[0][:], self._arm[0][:], self._fingers[0][:] = base, arm, OPEN

    def set_candle(self, index: int, position: np.ndarray, yaw: float) -> None:
        """Stands a candle somewhere, for the start of an episode."""
        self._qpos[self._candle_rows[index]] = [*position, math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)]

    def roll_wheels(self) -> None:
        """Turns the wheels as the base moves: mecanum kinematics. They bear no load."""
        x, y, turn = self._base[1].tolist()
        yaw = float(self._base[0][2])
        c, s = math.cos(yaw), math.sin(yaw)
        ahead, aside, turn = (c * x + s * y) / _WHEEL_RADIUS, (c * y - s * x) / _WHEEL_RADIUS, turn * _WHEEL_TRACK
        turn /= _WHEEL_RADIUS
        left, right = ahead - turn, ahead + turn
        self._wheels[1][:] = left - aside, right + aside, left + aside, right - aside

    # -- Stepping --------------------------------------------------------------------------------

    def step(self, nstep: int = 1) -> None:
        """Advances the simulation, and keeps the toddler's contacts of every physics step in `touches`."""
        model, data = self._raw
        found = self._touch_found
        self.touches = []
        warnings = self._warnings.tolist()
        for _ in range(nstep):
            mujoco.mj_step(model, data)
            if found[0]:
                self._read_touches()
        # dm_control's check at every step would take 7 % of the closed loop's time, so it is only asked to report.
        if self._warnings.tolist() != warnings:
            with self.check_invalid_state():
                self._warnings_before[:] = warnings

    def _read_touches(self) -> None:
        model, data = self._raw
        contact = data.contact
        for i, (one, two) in enumerate(contact.geom.tolist()):
            if self._toddler_geom not in (one, two):
                continue
            towards = -1.0 if two == self._toddler_geom else 1.0  # the normal points from the first geom to the second
            other = one if two == self._toddler_geom else two
            kind, index = self._things[other]
            normal = towards * contact.frame[i, :3]
            length = math.hypot(normal[0], normal[1])
            # From above or below, it is in nobody's way.
            direction = (float(normal[0] / length), float(normal[1] / length)) if length > 1e-6 else (0.0, 0.0)
            speed = 0.0
            if kind == "robot":
                velocity = np.empty(6)
                mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_GEOM, other, velocity, 0)
                arm = contact.pos[i] - data.geom_xpos[other]
                speed = -float((velocity[3:] + np.cross(velocity[:3], arm)) @ normal)
            self.touches.append(Touch(kind, index, direction, speed))


def _views(model: mujoco.MjModel, data: mujoco.MjData, joints: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities of scalar joints that follow one another, as views of the simulation's state."""
    first = model.joint(joints[0])
    q, v = int(first.qposadr[0]), int(first.dofadr[0])
    return data.qpos[q : q + len(joints)], data.qvel[v : v + len(joints)]


def _thing_of(geom: str) -> tuple[str, int]:
    """What a geom stands for, by its name in the scene (see `caregiver_mj.house`)."""
    owner, _, part = geom.partition("/")
    kind, _, number = owner.rpartition("_")
    if kind == "stairwell" and part != "trigger":
        return "wall", -1  # the panels beside the stairs
    return (kind, int(number)) if kind in ("table", "bin", "stairwell", "candle") else (kind or owner, -1)


class CareTask(base.Task):
    """An episode in a house: a toddler walks about, a robot acts. Tasks add a goal and a reward.

    Attributes:
        plan: The floor plan.
        novice_timestep: Seconds of a novice timestep.
        timestep: Novice timesteps completed in this episode.
        visits: How many of them the toddler ended in each free cell, (free cells,).
        damage_at: Damage that it took in each, likewise.
        goal_given: Whether the observation names what to do, or the caregiver has to find out.
    """

    goal_given = False

    def __init__(
        self,
        plan: FloorPlan,
        epsilon: float,
        random: np.random.RandomState | int | None = None,
        robot: bool = True,
        control_timestep: float = CONTROL_TIMESTEP,
        candle_offset: float = _CANDLE_OFFSET,
        table_offset: float = 0.0,
        adversarial: bool = False,
    ):
        """Prepares the episodes.

        Args:
            plan: The house.
            epsilon: Share of the novice's moves that are random.
            random: Source of all randomness, or a seed for one.
            robot: Whether the robot is in the house.
            control_timestep: Seconds between actions.
            candle_offset: How far off a table's centre a candle starts, at most, in x and in y, metres.
            table_offset: How far off its place in the plan a table stands, at most, likewise; drawn once.
            adversarial: Whether the toddler heads for the robot at every move, instead of what a novice does.
        """
        super().__init__(random=random)
        self.plan = plan
        self.has_robot = robot
        self.control_timestep = control_timestep
        self._novice = Novice(plan, epsilon)
        self.novice_timestep = novice_timestep(control_timestep, plan.cell_size)
        self._steps_a_move = round(self.novice_timestep / control_timestep)
        self._walk = ToddlerWalk(self.novice_timestep)
        _, self._target, self._target_index = plan.graph.moves
        self._centres = [tuple(plan.position(cell).tolist()) for cell in plan.free_cells]
        self._table_rectangles = layout.table_rectangles(plan)
        if table_offset:
            self._table_rectangles[:, :2] += self.random.uniform(-table_offset, table_offset, (len(plan.tables), 2))
        self._candle_offset = candle_offset
        self._adversarial = adversarial
        self.action_shape = (11 if robot else 0,)
        self._control_steps = 0

    @property
    def table_positions(self) -> np.ndarray:
        """Where the tables' centres are, (tables, 2), metres."""
        return self._table_rectangles[:, :2]

    def reseed(self, random: np.random.RandomState | int) -> None:
        """Makes the next episode that of a seed, whatever ran before."""
        self._random = random if isinstance(random, np.random.RandomState) else np.random.RandomState(random)

    # -- dm_control's interface ------------------------------------------------------------------

    def initialize_episode(self, physics: Physics) -> None:
        tape = NoviceTape.draw(self.random)
        self._draws = tape.steps
        self._cell = int(self._novice.start_cell(tape.start[:1])[0])
        self._bin = int(self._novice.next_bin(tape.start[2:])[0])
        self._walk.reset(self._centres[self._cell], yaw=self.random.uniform(-np.pi, np.pi))
        physics.set_toddler(self._walk)
        for i, table in enumerate(self.plan.candle_tables):
            offset = self.random.uniform(-self._candle_offset, self._candle_offset, size=2)
            place = self.table_positions[table] + offset
            physics.set_candle(i, np.array([*place, layout.TABLE_HEIGHT]), self.random.uniform(-np.pi, np.pi))
        if self.has_robot:
            cell = int(caregiver_start(self.plan, np.array([self._cell]), tape.start[1:2])[0])
            pose = np.array([*self.plan.position(self.plan.caregiver_cells[cell]), self.random.uniform(-np.pi, np.pi)])
            physics.set_robot(pose, kinematics.tucked_joints())
        self.timestep = 0
        self._control_steps = 0
        self._touched_directions: list[tuple[float, float]] = []
        self._visited = {self._cell}
        self.visits, self.damage_at = np.zeros((2, len(self.plan.free_cells)))
        self._damage = dict.fromkeys(("stairwell", "candle", "table"), 0.0)
        self._timestep_damage: tuple[float, str] = (0.0, "")
        self._figures = collections.Counter()
        self._threshold_timestep: int | None = None
        self._last_strike = -np.inf
        self._fallen: set[int] = set()

    def action_spec(self, physics: Physics) -> specs.BoundedArray:
        """Base velocities (m/s, rad/s), arm joint targets (rad), gripper target (m): 11 values, 0 without robot."""
        model = physics.model
        low, high = model.actuator_ctrlrange.T
        count = max(model.nu - 1, 0)  # the two fingers share one action
        names = [model.id2name(i, "actuator").removeprefix("robot/") for i in range(model.nu)]
        names[-2:] = ["gripper"] if count else []
        return specs.BoundedArray((count,), float, low[:count], high[:count], name="\t".join(names))

    def before_step(self, action: np.ndarray, physics: Physics) -> None:
        action = np.asarray(action, float)
        if action.shape != self.action_shape:
            raise CaregiverError(f"an action has the shape {self.action_shape}, not {action.shape}")
        if not all(map(math.isfinite, action.tolist())):
            index = int(np.flatnonzero(~np.isfinite(action))[0])
            name = self.action_spec(physics).name.split("\t")[index]
            raise CaregiverError(f"action[{index}] ({name}) is {action[index]}, not a finite number")
        if self.has_robot:
            physics.set_action(action)
            physics.roll_wheels()
        if self._control_steps % self._steps_a_move == 0:
            self._begin_move(physics)
        self._walk.step(self.control_timestep, self._touched_directions)
        physics.set_toddler(self._walk)

    def after_step(self, physics: Physics) -> None:
        self._touched_directions = [t.direction for t in physics.touches if t.kind != "candle"]
        for touch in physics.touches:
            self._take_in(touch, physics)
        self._control_steps += 1
        if self._control_steps % self._steps_a_move == 0:
            self._end_move(physics)

    def get_observation(self, physics: Physics) -> collections.OrderedDict:
        """What there is to see, enough to run the caregiver on; see the README for every key."""
        observation = collections.OrderedDict()
        observation["clock"] = np.array(self._control_steps / self._steps_a_move)
        observation["toddler_position"] = physics.toddler_position()
        observation["toddler_velocity"] = physics.toddler_velocity()
        if self.plan.candle_tables:
            poses = physics.candle_poses()
            observation["candle_position"] = poses[:, :3]
            observation["candle_orientation"] = poses[:, 3:]
        if self.has_robot:
            observation["base_position"] = physics.base_position()
            observation["base_velocity"] = physics.base_velocity()
            observation["arm_position"] = physics.arm_position()
            observation["arm_velocity"] = physics.arm_velocity()
            observation["finger_position"] = physics.finger_position()
        return observation

    def get_termination(self, physics: Physics) -> float | None:
        return None

    # -- Results ---------------------------------------------------------------------------------

    @property
    def damage(self) -> float:
        """Damage that the toddler has taken in this episode."""
        return sum(self._damage.values()) + self._timestep_damage[0]

    def outcome(self) -> dict[str, float]:
        """The figures of the episode so far, named as in `caregiver_mj.grid.world.Outcome`; and drops and strikes."""
        figures = {field.name: float(self._figures[field.name]) for field in dataclasses.fields(Outcome)}
        figures.update({f"damage_{kind}": damage for kind, damage in self._damage.items()})
        figures["damage"] = sum(self._damage.values())
        figures["timesteps_to_threshold"] = float(self._threshold_timestep or novice.EPISODE_TIMESTEPS)
        figures["cells_visited"] = float(len(self._visited))
        for name in ("candles_dropped", "strikes"):
            figures[name] = float(self._figures[name])
        return figures

    # -- The toddler -----------------------------------------------------------------------------

    def _begin_move(self, physics: Physics) -> None:
        """The novice chooses a move; the toddler sets out for it."""
        if self.timestep < len(self._draws):
            draws = self._draws[self.timestep][None]
        else:  # the episode runs on after its 200 timesteps
            draws = self.random.random_sample((1, 3))
        if self._adversarial:
            action = self._step_towards_robot(physics)
        else:
            action = int(self._novice.act(np.array([self._cell]), np.array([self._bin]), draws)[0])
        self._bin_draw = draws[:, 2]
        self._move_target = Target(int(self._target[self._cell, action]))
        row, column = self.plan.free_cells[self._cell]
        down, right = ACTIONS[action]
        goal = tuple(self.plan.position((row + down, column + right)).tolist())
        self._walk.begin(self._centres[self._cell], goal, bump=self._move_target != Target.FREE)
        self._reached_toy = self._met_robot = False

    def _step_towards_robot(self, physics: Physics) -> int:
        """The first move of a shortest way to the cell in which the robot stands, and into it."""
        cells = self.plan.caregiver_cells
        robot = physics.base_position()[:2]
        goal = min(range(len(cells)), key=lambda i: math.dist(self.plan.position(cells[i]), robot))
        distance = self.plan.graph.distances_from([goal])[0].astype(float)
        distance[len(self.plan.free_cells) :] = np.inf  # it knows stairs, ...
        distance[goal] = 0.0  # ... but goes there too if the robot does
        row, column = self.plan.free_cells[self._cell]
        ahead = [self.plan.cell_index.get((row + down, column + right)) for down, right in ACTIONS]
        return min(range(len(ACTIONS)), key=lambda a: np.inf if ahead[a] is None else distance[ahead[a]])

    def _take_in(self, touch: Touch, physics: Physics) -> None:
        """Books a contact: damage by kind, at most the worst one a timestep, toys and strikes."""
        if touch.kind == "stairwell":
            self._hurt(novice.STAIRWELL_DAMAGE, "stairwell")
        elif touch.kind == "candle":
            self._hurt(novice.CANDLE_DAMAGE, "candle")
        elif touch.kind == "table":
            bears = self.bears_candle(physics, touch.index)
            self._hurt(*((novice.CANDLE_DAMAGE, "candle") if bears else (novice.TABLE_DAMAGE, "table")))
        elif touch.kind == "bin":
            self._reached_toy |= touch.index == self._bin
        elif touch.kind == "robot":
            vx, vy = self._walk.velocity
            self._met_robot |= vx * touch.direction[0] + vy * touch.direction[1] > 0 or self._walk.blocked
            if touch.speed > STRIKE_SPEED and physics.time() - self._last_strike > _STRIKE_PAUSE:
                self._figures["strikes"] += 1
                self._last_strike = physics.time()

    def _hurt(self, damage: float, kind: str) -> None:
        if damage > self._timestep_damage[0]:
            self._timestep_damage = (damage, kind)

    def _end_move(self, physics: Physics) -> None:
        """Books the novice timestep that is over."""
        self.timestep += 1
        damage, kind = self._timestep_damage
        if kind:
            self._damage[kind] += damage
            self.damage_at[self._cell] += damage
            self._timestep_damage = (0.0, "")
        stood = self._cell
        self._cell = self.plan.cell_index[self._nearest_free_cell(self._walk.position)]
        self.visits[self._cell] += 1
        if self._threshold_timestep is None:
            self._visited.add(self._cell)
            if self.damage >= novice.DAMAGE_THRESHOLD:
                self._threshold_timestep = self.timestep
        stayed = self._cell == stood and self._move_target in (Target.FREE, Target.STAIRWELL)
        self._figures["moves_blocked"] += stayed and self._met_robot and kind != "stairwell"
        if self._reached_toy:
            self._figures["toys_reached"] += 1
            self._bin = int(self._novice.next_bin(self._bin_draw)[0])
        self._count_drops(physics)

    def _nearest_free_cell(self, position: tuple[float, float]) -> Cell:
        cell = self.plan.cell_at(np.array(position))
        if self.plan[cell] == ".":
            return cell
        return min(self.plan.free_cells, key=lambda c: math.dist(self.plan.position(c), position))

    def _count_drops(self, physics: Physics) -> None:
        """Counts candles that have fallen over, or down, since the last look."""
        fallen = set(np.flatnonzero(~self._standing(physics)).tolist())
        self._figures["candles_dropped"] += len(fallen - self._fallen)
        self._fallen = fallen

    def is_standing(self, physics: Physics, candle: int) -> bool:
        """Whether a candle is upright, and no lower than a table."""
        return bool(self._standing(physics)[candle])

    def _standing(self, physics: Physics) -> np.ndarray:
        """The same of every candle, (candles,)."""
        high = physics.candle_poses()[:, 2] > layout.TABLE_HEIGHT - 0.05
        return high & (physics.candle_upright() > _STANDING_COSINE)

    def bears_candle(self, physics: Physics, table: int) -> bool:
        """Whether a candle stands (or lies) on a table."""
        if not self.plan.candle_tables:
            return False
        x, y, half_x, half_y = self._table_rectangles[table]
        poses = physics.candle_poses()
        over = (np.abs(poses[:, 0] - x) < half_x) & (np.abs(poses[:, 1] - y) < half_y)
        return bool((over & (np.abs(poses[:, 2] - layout.TABLE_HEIGHT) < 0.03)).any())


def make_environment(task: CareTask, time_limit: float, environment_kwargs: dict | None = None) -> control.Environment:
    """Builds the house of a task and wraps both as an environment."""
    physics = Physics.from_plan(task.plan, task.has_robot, task.table_positions)
    return control.Environment(
        physics, task, time_limit=time_limit, control_timestep=task.control_timestep, **(environment_kwargs or {})
    )

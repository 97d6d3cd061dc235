"""Contacts of the children, read from the simulation and named after the floor plan."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from caregiver_mj.house.robot_body import RobotBody
from caregiver_mj.house.scene import child_prefix
from caregiver_mj.plans.hazards import KINDS, Where, kinds_at
from caregiver_mj.recording.ledger import Touch

_OPENINGS = tuple(kind.name for kind in kinds_at(Where.OPENING))
# Things that the robot may hold, or push against a child.
_MOVABLE = ("panel", *(kind.name for where in (Where.ON_TABLE, Where.FLOOR) for kind in kinds_at(where)))
_NUMBERED = ("bin", *(kind.name for kind in KINDS))  # kinds of which a house may have several


class TouchReader:
    """Reads the children's contacts of the present physics step; `is_any()` tells whether there are any."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, children: int):
        self._model, self._data = model, data
        self.robot: RobotBody | None = None  # set if there is one
        self._children = {model.geom(f"{child_prefix(k)}body").id: k for k in range(children)}
        self.bodies = tuple(self._children)  # geoms of the children
        self._things = [_thing_of(model.geom(i).name) for i in range(model.ngeom)]
        self._parts = _robot_parts(model)
        self._of_body = model.geom_bodyid.tolist()
        self._jacobian, self._row, self._solved = (np.empty((rows, model.nv)) for rows in (3, 1, 1))
        first = model.sensor(_sensor(0)).adr[0]
        found = data.sensordata[first : first + children]  # number of contacts of each child
        self.is_any = found.item if children == 1 else found.any  # `item` is faster

    @staticmethod
    def add_sensors(spec: mujoco.MjSpec, children: int) -> None:
        """Add the sensors that a reader needs."""
        for k in range(children):
            spec.add_sensor(
                name=_sensor(k),
                type=mujoco.mjtSensor.mjSENS_CONTACT,
                objtype=mujoco.mjtObj.mjOBJ_GEOM,
                objname=f"{child_prefix(k)}body",
                intprm=[1, 0, 1],  # report the number of contacts
            )

    def read(self) -> list[Touch]:
        """Return the contacts of all children."""
        touches, children = [], self._children
        for i, (one, two) in enumerate(self._data.contact.geom.tolist()):
            if two in children:  # a contact's normal points from its first geom to its second
                touches.append(self._touch(i, children[two], one, -1.0))
            elif one in children:
                touches.append(self._touch(i, children[one], two, 1.0))
        return touches

    def _touch(self, number: int, child: int, other: int, towards: float) -> Touch:
        """Return a child's contact with another geom; its normal times `towards` points to that geom."""
        contact, data = self._data.contact, self._data
        kind, index = self._things[other]
        normal = towards * contact.frame[number, :3]
        length = math.hypot(normal[0], normal[1])
        # A vertical contact has no direction on the floor.
        direction = (float(normal[0] / length), float(normal[1] / length)) if length > 1e-6 else (0.0, 0.0)
        time, part = float(data.time), self._part_behind(other)
        if not part and kind != "panel":
            return Touch(child, kind, index, direction, 0.0, time=time)
        velocity, force = np.empty(6), np.empty(6)  # rotation, translation; force, torque in the contact's axes
        mujoco.mj_objectVelocity(self._model, data, mujoco.mjtObj.mjOBJ_GEOM, other, velocity, 0)
        surface = velocity[3:] + _cross(velocity[:3], contact.pos[number] - data.geom_xpos[other])
        if self.robot is None or kind == "panel":
            return Touch(child, kind, index, direction, -_dot(surface, normal), time=time, part=part)
        mujoco.mj_contactForce(self._model, data, number, force)
        base, (x, y, turn) = self.robot.base_body, self.robot.base_drives
        mujoco.mj_objectVelocity(self._model, data, mujoco.mjtObj.mjOBJ_BODY, base, velocity, 0)
        arm = contact.pos[number] - data.xpos[base]
        driven = surface - velocity[3:] - _cross(velocity[:3], arm) + (x - turn * arm[1], y + turn * arm[0], 0.0)
        is_robot = kind == "robot"
        return Touch(
            child,
            kind,
            index,
            direction,
            -_dot(surface, normal) if is_robot else 0.0,
            surface_speed=_on_child(surface, normal),
            driven_speed=_on_child(driven, normal),
            force=math.hypot(*force[:3]),
            height=float(contact.pos[number, 2]),
            time=time,
            part=part,
            mass=self.reduced_mass(child, other, contact.pos[number], normal) if is_robot else 0.0,
        )

    def _part_behind(self, geom: int) -> str:
        """Return the part of the robot that a geom belongs to, or that touches the geom's thing."""
        if self._parts[geom] or self._things[geom][0] not in _MOVABLE:
            return self._parts[geom]
        of_body, body = self._of_body, self._of_body[geom]
        for one, two in self._data.contact.geom.tolist():
            part = self._parts[one] or self._parts[two]
            if part and body in (of_body[one], of_body[two]):
                return part
        return ""

    def reduced_mass(self, child: int, geom: int, point: np.ndarray, normal: np.ndarray) -> float:
        """Return the reduced mass 1 / (1 / m_H + 1 / m_R) of a child and the robot, kg.

        The kinetic energy of this mass at their relative speed is what a contact can transfer (ISO/TS 15066:2016, annex
        A.3.4). m_H is the child's whole body, as the masses of its parts are unknown. For m_R the annex estimates half
        of the moving masses and the payload, for an arm on a fixed base. Here it is the robot's effective mass along
        the contact, 1 / (n^T J M^-1 J^T n) (Khatib, Int. J. Robotics Research 14, 1995), with MuJoCo's mass matrix M
        including the rotors' inertias: 20 to 120 kg at the base, 3 to 9 kg at the palm. It ignores joint limits: a
        finger pushed along its slide counts with only its own mass, as does a thing in the hand. The contact is at a
        point (3,), m, with a unit vector (3,) between the two.
        """
        model, data, row, solved = self._model, self._data, self._row, self._solved
        mujoco.mj_jac(model, data, self._jacobian, None, point, self._of_body[geom])
        mujoco.mju_mulMatTVec(row[0], self._jacobian, normal)  # by MuJoCo, see `_dot`
        mujoco.mj_solveM(model, data, solved, row)
        body = self._of_body[self.bodies[child]]
        return 1.0 / (1.0 / float(model.body_mass[body]) + float(mujoco.mju_dot(row[0], solved[0])))


def _cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the cross product of two vectors (3,), 25 times as fast as `numpy.cross`."""
    product = np.empty(3)
    mujoco.mju_cross(product, one, other)
    return product


def _dot(one: np.ndarray, other: np.ndarray) -> float:
    """Return the scalar product of two vectors (3,), by MuJoCo because BLAS rounds differently on other processors."""
    return float(mujoco.mju_dot3(one, other))


def _on_child(surface: np.ndarray, normal: np.ndarray) -> float:
    """Return the speed of a surface with a velocity (3,) towards and along a child, whose normal points to it."""
    speed = -_dot(surface, normal)
    along = math.sqrt(max(0.0, _dot(surface, surface) - speed * speed))
    return math.hypot(along, max(0.0, speed))


def _robot_parts(model: mujoco.MjModel) -> list[str]:
    """Return the part of the robot that each geom belongs to: "base", "arm" or ""."""
    names = (model.geom(i).name for i in range(model.ngeom))
    welded = model.body_weldid[model.geom_bodyid].tolist()  # a tray or an arm's foot is part of the base
    bodies = (model.body(body).name for body in welded)
    return [
        "" if not name.startswith("robot/") else "base" if body == "robot/base" else "arm"
        for name, body in zip(names, bodies, strict=True)
    ]


def _sensor(child: int) -> str:
    return f"{child_prefix(child).removesuffix('/')}_touch"


def _thing_of(geom: str) -> tuple[str, int]:
    """Return kind and number of a geom's thing, from its name in the scene (see `caregiver_mj.house.scene`)."""
    owner, _, part = geom.partition("/")
    kind, _, number = owner.rpartition("_")
    if kind in _OPENINGS and part == "panel":
        return part, int(number)
    if kind in _OPENINGS and part != "trigger":
        return "wall", -1  # the panels beside the stairs, and fences
    return (kind, int(number)) if kind in _NUMBERED else (kind or owner, -1)

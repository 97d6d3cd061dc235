"""Export the scene of a house to files for plain MuJoCo."""

from __future__ import annotations

import pathlib
from xml.etree import ElementTree

import mujoco
import numpy as np
import PIL.Image

from caregiver_mj.children.random_stream import start_cells
from caregiver_mj.errors import CaregiverError
from caregiver_mj.house.physics import Physics, compile_house
from caregiver_mj.house.rendering import wrapper
from caregiver_mj.house.scene import build_house, child_joints
from caregiver_mj.house.touch import TouchReader
from caregiver_mj.plans.floor_plan import FloorPlan, check_starts
from caregiver_mj.robot.embodiment import Embodiment

_START = "start"  # keyframe: child and robot in different cells, gates open
_HEADER = f" A house of caregiver_mj. Begin with its keyframe '{_START}'. "


def export_house(plan: FloorPlan, file: str | pathlib.Path, robot: Embodiment | None = None) -> list[pathlib.Path]:
    """Write the scene of a house with a child and perhaps a robot, for use without this package; return the files.

    The new file is `.xml`, with images of its floors beside it, or `.mjb`, the compiled model in one file for the same
    version of MuJoCo.

    Raises:
        CaregiverError: The suffix is another, a file exists or cannot be written, the house cannot be built, or the
            robot's model refers to files, which `.xml` does not support.
    """
    file = pathlib.Path(file)
    if file.suffix not in (".xml", ".mjb"):
        raise CaregiverError(f"a scene's file must end in .xml or .mjb, got '{file}'")
    if robot is not None:
        check_starts(plan)
    spec = build_house(plan, robot or False)
    TouchReader.add_sensors(spec, 1)
    model = compile_house(spec)
    state = _start(plan, model, robot).data
    spec.add_key(name=_START, qpos=state.qpos, ctrl=state.ctrl)
    spec.option.jacobian = model.opt.jacobian
    pictures = _pictures(spec, file, robot) if file.suffix == ".xml" else {}
    if there := [path for path in (file, *pictures) if path.exists()]:
        raise CaregiverError(f"a scene's files must be new, got '{there[0]}', which exists")
    try:
        for path, picture in pictures.items():
            picture.save(path)
        if file.suffix == ".xml":
            file.write_text(_xml(spec, file), encoding="utf-8")
        else:
            file.touch()  # raises OSError, unlike MuJoCo
            mujoco.mj_saveModel(compile_house(spec), str(file))
    except OSError as error:
        raise CaregiverError(f"'{error.filename or file}' cannot be written: {error.strerror}") from None
    return [file, *pictures]


def _start(plan: FloorPlan, model: mujoco.MjModel, robot: Embodiment | None) -> Physics:
    """Return the house with the child in the first free cell, the robot in the last, and open gates."""
    physics = Physics(wrapper.MjData(wrapper.MjModel(model)), robot)
    landings = len(plan.landings)
    cells = start_cells(len(plan.starts) - landings, landings, np.array([[[0.0, np.nextafter(1, 0), 0.0]]]))
    child, caregiver = (plan.position(plan.caregiver_cells[plan.starts[cell.flat[0]]]) for cell in cells)
    for joint, place in zip(child_joints(0), child, strict=False):
        physics.data.joint(joint).qpos = place
    if robot is not None:
        physics.set_robot(np.array([*caregiver, 0.0]))
    physics.set_gates()
    return physics


def _pictures(spec: mujoco.MjSpec, file: pathlib.Path, robot: Embodiment | None) -> dict[pathlib.Path, PIL.Image.Image]:
    """Replace the images in a scene by references to files, and return the images by file."""
    for part in (*spec.meshes, *spec.hfields, *spec.textures):
        if part.file:
            name = robot.name if robot else "none"
            raise CaregiverError(f"robot '{name}' has its own file, '{part.file}': export the scene as .mjb")
    pictures = {}
    for texture in spec.textures:
        if texture.builtin == mujoco.mjtBuiltin.mjBUILTIN_NONE:
            shape = texture.height, texture.width, texture.nchannel
            path = file.with_name(f"{file.stem}_{texture.name}.png")
            pictures[path] = PIL.Image.fromarray(np.frombuffer(texture.data, np.uint8).reshape(shape))
            texture.data, texture.file = b"", path.name
    return pictures


def _xml(spec: mujoco.MjSpec, file: pathlib.Path) -> str:
    """Return the scene as MJCF; the files that it refers to must exist."""
    spec.modelfiledir = str(file.parent)
    root = ElementTree.fromstring(spec.to_xml())
    root.insert(0, ElementTree.Comment(_HEADER))
    # Attaching adds empty classes "main", and duplicate classes for things with the same prefix.
    classes = root.find("default")
    first: dict[str, ElementTree.Element] = {}
    for defaults in [] if classes is None else list(classes):
        same = first.setdefault(defaults.get("class", ""), defaults)
        if classes is not None and same is not defaults:
            same.extend(defaults)
            classes.remove(defaults)
    return ElementTree.tostring(root, encoding="unicode")

"""What pictures of a house can be asked for."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from dm_control.rl import control

from caregiver_mj.errors import CaregiverError, check_integer


def picture(physics: control.Physics, width: int, height: int, camera: str) -> dict[str, Any]:
    """What `Physics.render` is to draw.

    Raises:
        CaregiverError: There is no such camera, or no picture of that size.
    """
    largest = physics.model.vis.global_
    for what, size, most in (("width", width, largest.offwidth), ("height", height, largest.offheight)):
        check_integer(f"the {what} of a picture, in pixels,", size, 1, most)
    (name,) = camera_names(physics, [camera]).values()
    return {"width": int(width), "height": int(height), "camera_id": name}


def camera_names(physics: control.Physics, cameras: Iterable[str]) -> dict[str, str]:
    """Full names of cameras, by the last part of each.

    Raises:
        CaregiverError: There is no such camera.
    """
    there = [physics.model.id2name(i, "camera") for i in range(physics.model.ncam)]
    known = {name.split("/")[-1]: name for name in reversed(there)}
    for name in cameras:
        if name not in known and name not in there:
            raise CaregiverError(f"no camera '{name}': there are {', '.join(sorted(known))}")
    return {name: known.get(name, name) for name in cameras}

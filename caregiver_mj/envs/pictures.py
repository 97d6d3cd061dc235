"""What pictures of a house can be asked for."""

from __future__ import annotations

from typing import Any

from caregiver_mj.errors import check_integer
from caregiver_mj.house.physics import Physics


def picture(physics: Physics, width: int, height: int, camera: str) -> dict[str, Any]:
    """What `Physics.render` is to draw.

    Raises:
        CaregiverError: There is no such camera, or no picture of that size.
    """
    largest = physics.model.vis.global_
    for what, size, most in (("width", width, largest.offwidth), ("height", height, largest.offheight)):
        check_integer(f"the {what} of a picture, in pixels,", size, 1, most)
    physics.check_cameras([camera])
    return {"width": int(width), "height": int(height), "camera_id": camera}

"""The studio: cameras on an episode, and the page that their pictures are laid out on."""

from __future__ import annotations

import numpy as np

from caregiver_mj.viz import hud
from caregiver_mj.viz.cameras import Camera
from caregiver_mj.viz.colours import GROUND
from caregiver_mj.viz.episode import Episode
from caregiver_mj.viz.still_camera import StillCamera
from caregiver_mj.viz.tiles import TileLayer

_INSETS = ("follow", "wrist")  # cameras shown beside the overview
_WIDE = 1.5  # width over height from which a picture has room for insets beside the house


class Studio:
    """Films an episode."""

    def __init__(self, episode: Episode, width: int, height: int, camera: str, trail_length: int):
        """Sets the cameras up.

        Args:
            episode: What to film.
            width: Width of the pictures, pixels.
            height: Their height.
            camera: The camera of the large view.
            trail_length: How many of the latest looks the trails of the children show.

        Raises:
            CaregiverError: There is no such camera.
            RenderingError: There is no OpenGL to render with.
        """
        self._episode, self._trail_length = episode, trail_length
        physics = episode.env.physics
        physics.check_cameras([camera])
        physics.model.vis.quality.numquads = 1  # lit by the sun alone, boxes look the same and are drawn faster
        physics.fit_pictures(width, height)
        self._page = np.empty((height, width, 3), np.uint8)
        self._page[:] = GROUND
        self._main = self._page[: hud.strip_top(width, height)]  # nothing hides behind the strip
        size = width, self._main.shape[0]
        still = physics.model.ptr.camera(camera).bodyid == 0  # the world's
        if still:
            self._camera: Camera = StillCamera(physics, camera, *size)
        else:
            self._camera = Camera(physics, camera, *size, shadows=True)
        self._tiles = TileLayer(physics, camera, *size, still) if episode.foresees else None
        self._insets = []
        captions = {"follow": "toddler" if len(episode.family) == 1 else "child 1", "wrist": "gripper"}
        if width > _WIDE * height:
            for name in _INSETS:
                if name in physics.camera_names() and name != camera:
                    inset = Camera(physics, name, *hud.inset_size(width, height))
                    self._insets.append((captions[name], inset))

    def frame(self) -> np.ndarray:
        """Renders the present moment, (height, width, 3)."""
        self._main[:] = self._camera.render()
        if self._tiles:
            self._tiles.lay(self._main, self._episode.tiles())
        insets = [(caption, camera.render()) for caption, camera in self._insets]
        return hud.draw(self._page, self._episode.hud_state(self._trail_length), insets)

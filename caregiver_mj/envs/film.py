"""Films of Gymnasium environments with the package's ffmpeg; Gymnasium's recorder needs moviepy."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Callable, Generator
from typing import Any

import gymnasium
import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.recording.video import video_writer


class RecordFilm(gymnasium.Wrapper, gymnasium.utils.RecordConstructorArgs):
    """Films episodes of an environment with `render_mode="rgb_array"`, a frame a step.

    The films are `episode-0.mp4` and so on, each complete when its episode ends, the next begins, or the environment is
    closed.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        folder: str | os.PathLike[str],
        which: Callable[[int], bool] = lambda _: True,
        fps: float | None = None,
    ):
        """Prepare the films.

        Args:
            env: The environment.
            folder: Folder of the films, made if missing.
            which: Returns whether to film the episode with a number, from 0.
            fps: Frames per second; None for those of the environment's metadata.

        Raises:
            CaregiverError: The environment renders no images, or the folder cannot be made.
        """
        gymnasium.utils.RecordConstructorArgs.__init__(self, folder=folder, which=which, fps=fps)
        super().__init__(env)
        if env.render_mode != "rgb_array":
            raise CaregiverError(f"render_mode must be rgb_array for a film, got {env.render_mode!r}")
        self._folder, self._which = pathlib.Path(folder), which
        self._fps = float(fps or env.metadata.get("render_fps") or 30)
        self._episode = -1
        self._film: Generator[None, np.ndarray, None] | None = None
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise CaregiverError(f"the folder of the films must be one that can be made: {error}") from None

    def reset(self, **options: Any) -> tuple[Any, dict[str, Any]]:
        self._end()
        found = self.env.reset(**options)
        self._episode += 1
        if self._which(self._episode):
            frame = self._frame()
            height, width, _ = frame.shape
            path = self._folder / f"episode-{self._episode}.mp4"
            self._film = video_writer(path, width, height, self._fps)
            self._film.send(frame)
        return found

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(action)
        if self._film:
            self._film.send(self._frame())
        if terminated or truncated:
            self._end()
        return observation, reward, terminated, truncated, info

    def close(self) -> None:
        self._end()
        super().close()

    def _frame(self) -> np.ndarray:
        return np.ascontiguousarray(self.env.render())

    def _end(self) -> None:
        if self._film:
            self._film.close()
            self._film = None

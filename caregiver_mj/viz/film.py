"""Films of episodes in the house, at the speed of the simulated world: the cameras, the page and the file."""

from __future__ import annotations

import contextlib
import math
import numbers
import os
import pathlib
import tempfile
from collections.abc import Callable, Iterator

import numpy as np
from PIL import Image

from caregiver_mj.caregivers.registry import check_acts_alone
from caregiver_mj.children.family import Family
from caregiver_mj.errors import CaregiverError, check_kind, check_number
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.policy.own import OwnPolicy
from caregiver_mj.recording.video import video_writer
from caregiver_mj.robot.embodiment import DEFAULT
from caregiver_mj.viz import OVERLAYS, hud, progress_bar
from caregiver_mj.viz.cameras import Camera, StillCamera, TileLayer
from caregiver_mj.viz.colours import GROUND
from caregiver_mj.viz.episode import Episode, Watched

DEFAULT_SIZE = 1280, 720  # pixels
DEFAULT_FPS = 30.0
_SMALLEST, _LARGEST = (320, 240), (3840, 2160)  # pixels
LONGEST = 86_400  # seconds of a film
_TRAIL_SECONDS = 20.0
_WIDE = 1.5  # width over height from which a picture has room for insets beside the house
# Sides of round things, their rings, and pixels of the shadow map's side; how high pictures of a whole house may be for
# the coarse ones.
_FINE, _COARSE, _COARSE_HEIGHT = (22, 8, 2048), (16, 6, 1024), 480
_OPTIONS = (
    *("-movflags", "+faststart"),
    # Without this, players take the colours for those of high definition while they are not.
    *("-vf", "scale=out_color_matrix=bt709:out_range=tv"),
    *("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"),
)


class Studio:
    """Films an episode."""

    def __init__(self, episode: Episode, width: int, height: int, camera: str, trail_length: int):
        """Set the cameras up, for pictures of a size in pixels, with so many of the latest looks as children's trails.

        Raises:
            CaregiverError: There is no such camera.
            RenderingError: There is no OpenGL to render with.
        """
        self._episode, self._trail_length = episode, trail_length
        physics = episode.env.physics
        physics.check_cameras([camera])
        quality = physics.model.vis.quality
        quality.numquads = 1  # lit by the sun alone, boxes look the same and are drawn faster
        still = physics.model.ptr.camera(camera).bodyid == 0  # the world's
        looks = isinstance(episode.policy, OwnPolicy) or (episode.policy and episode.policy.caregiver.needs_pictures)
        if not looks:  # nobody acts upon pictures
            # As coarse as nobody sees it: without a graphics card most of the time goes into vertices and shadows.
            fineness = _COARSE if still and height <= _COARSE_HEIGHT else _FINE
            quality.numslices, quality.numstacks, quality.shadowsize = fineness
        physics.fit_pictures(width, height)
        self._page = np.empty((height, width, 3), np.uint8)
        self._page[:] = GROUND
        self._main = self._page[: hud.strip_top(width, height)]  # nothing hides behind the strip
        size = width, self._main.shape[0]
        self._camera = (StillCamera if still else Camera)(physics, camera, *size, shadows=True)
        self._tiles = TileLayer(physics, camera, *size, still) if episode.foresees else None
        self._insets = []
        captions = {"follow": "toddler" if len(episode.family) == 1 else "child 1", "wrist": "gripper"}
        if width > _WIDE * height:
            for name in captions:  # cameras shown beside the overview
                if name in physics.camera_names() and name != camera:
                    inset = Camera(physics, name, *hud.inset_size(width, height))
                    self._insets.append((captions[name], inset))

    def frame(self) -> np.ndarray:
        """Render the present moment, (height, width, 3)."""
        self._main[:] = self._camera.render()
        if self._tiles:
            self._tiles.lay(self._main, self._episode.tiles())
        insets = [(caption, camera.render()) for caption, camera in self._insets]
        return hud.draw(self._page, self._episode.hud_state(self._trail_length), insets)


def render_episode(
    path: str | os.PathLike[str],
    *,
    task: str = "supervise",
    house: str | os.PathLike[str] | FloorPlan = "paper",
    epsilon: Family | float | str = 0.5,
    seed: int = 0,
    episode: int | None = 0,
    seconds: float = 30.0,
    caregiver: str = "expected-danger",
    embodiment: str = DEFAULT,
    sight: str = "all",
    width: int = DEFAULT_SIZE[0],
    height: int = DEFAULT_SIZE[1],
    fps: float = DEFAULT_FPS,
    camera: str = "overview",
    overlay: str | None = None,
    still: str | os.PathLike[str] | None = None,
    quiet: bool = False,
    answers: str = "",
    studio: Callable[[Episode, int, int, str, int], Studio] = Studio,
) -> None:
    """Film an episode, with what the caregiver knows and does on display.

    It is the episode that an evaluation with the same seed runs: the same children, and the same chance in the
    caregiver.

    Args:
        path: The film, `FILE.mp4`.
        task: One of `caregiver_mj.ALL_TASKS`; those of an evaluation are "supervise".
        house: A floor plan, the name of one that comes with the package, or the path of a file.
        epsilon: The novice's share of random moves; for several children that of each, as in "1,0.25".
        seed: Seed of the run.
        episode: Number of the episode in the run. None if the seed is that of a single episode, as in the column
            `seed` of a run; the caregiver gets the same one.
        seconds: Length of the film; less if the episode is over before.
        caregiver: Name of the caregiver, or of a policy; without a robot for "none".
        embodiment: Name of the robot.
        sight: What the caregiver has to see with: `all`, `walls`, `camera` or `rooms:N`.
        width: Width of the picture in pixels, even.
        height: Height of the picture in pixels, even.
        fps: Frames a second.
        camera: The camera of the large view.
        overlay: What is laid over the floor, one of `OVERLAYS`: "danger" for where the caregiver thinks that the
            children may be soon, and what may hurt them. None for nothing.
        still: Where to put a picture of a telling moment, `FILE.png`: a child nearest to a candle in the robot's
            hand, or else the middle of the film.
        quiet: Whether to do without the progress bar.
        answers: What the caregiver has answered in this episode, to be given again in its place, if anything.
        studio: Makes what takes the pictures, of the episode, width, height, camera and length of the trails.

    Raises:
        CaregiverError: Something of the above is not possible.
        RenderingError: There is no OpenGL to render with.
    """
    _check_picture(width, height, fps, seconds)
    if not answers:
        check_acts_alone(caregiver)
    if overlay not in (None, *OVERLAYS):
        raise CaregiverError(f"no overlay '{overlay}': there is {', '.join(OVERLAYS)}")
    path, still = _writable(path, ".mp4"), None if still is None else _writable(still, ".png")
    foresees = overlay == "danger"
    watched = Watched(
        house,
        Family.of(epsilon),
        caregiver,
        seed,
        episode,
        embodiment=embodiment,
        sight=sight,
        task=task,
        answers=answers,
    )
    filmed = watched.begin(foresees)
    best: tuple[float, np.ndarray | None] = (math.inf, None)
    count = max(1, round(seconds * fps))
    middle = round(min(seconds, filmed.env.task.time_limit) * fps) // 2
    with contextlib.closing(filmed.env), progress_bar(quiet) as bar, film_writer(path, width, height, fps) as write:
        taken = bar.add_task("frames", total=count)
        shots = studio(filmed, width, height, camera, round(_TRAIL_SECONDS * fps))
        for number in range(count):
            if not filmed.run_until(number / fps):
                break
            frame = shots.frame()
            write(frame)
            score = min(filmed.child_to_carried_candle(), 1e6 + abs(number - middle))
            if score < best[0]:
                best = (score, frame)
            bar.advance(taken)
    if still is not None:
        assert best[1] is not None  # a film has one frame at least
        Image.fromarray(best[1]).save(still)


def _check_picture(width: int, height: int, fps: float, seconds: float) -> None:
    for what, size, smallest, largest in zip(("width", "height"), (width, height), _SMALLEST, _LARGEST, strict=True):
        if not isinstance(size, numbers.Integral) or size % 2 or not smallest <= size <= largest:
            raise CaregiverError(f"{what} must be an even number of pixels from {smallest} to {largest}, got {size!r}")
    check_number("fps", fps, 1, 120)
    if not (isinstance(seconds, numbers.Real) and math.isfinite(seconds) and seconds > 0):
        raise CaregiverError(f"seconds must be a positive number, got {seconds}")
    if seconds > LONGEST:
        raise CaregiverError(f"seconds must be at most {LONGEST:,}, a day, got {seconds:g}")


@contextlib.contextmanager
def film_writer(path: pathlib.Path, width: int, height: int, fps: float) -> Iterator[Callable[[np.ndarray], None]]:
    """Give a function to hand frames (height, width, 3) to. The file appears when the film is complete, and only then.

    Raises:
        CaregiverError: It could not be written.
    """
    unfinished = path.with_name(f".{path.name}.part.mp4")
    writer = None

    def write(frame: np.ndarray) -> None:
        nonlocal writer
        if writer is None:  # not before: one that never gets a frame complains when it is closed
            writer = video_writer(unfinished, width, height, fps, *_OPTIONS)
        writer.send(np.ascontiguousarray(frame))

    try:
        yield write
        if writer is None:
            raise CaregiverError(f"a film must have at least 1 picture, got none for '{path}'")
        writer.close()
        unfinished.replace(path)
    except OSError as error:
        raise CaregiverError(f"'{path}' cannot be written: {error}") from None
    finally:
        if writer is not None:
            writer.close()
        unfinished.unlink(missing_ok=True)


def _writable(path: str | os.PathLike[str], suffix: str) -> pathlib.Path:
    """The path, once it is sure that a file of that kind can be written there; a CaregiverError if it cannot."""
    check_kind("a file", path, str, os.PathLike)
    path = pathlib.Path(path)
    if path.suffix.lower() != suffix:
        raise CaregiverError(f"the file must be called FILE{suffix}, got '{path}'")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path.parent):
            pass
        folder = path.is_dir()  # which also says so if the name is too long
    except OSError as error:
        raise CaregiverError(f"'{path}' cannot be written: {error.strerror}") from None
    if folder:
        raise CaregiverError(f"'{path}' cannot be written: it is a folder")
    return path

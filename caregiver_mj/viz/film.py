"""Films of episodes in the house, in real time: cameras, page and file."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import numbers
import os
import pathlib
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from typing import Any

import imageio.v2
import imageio_ffmpeg
import numpy as np
from PIL import Image

from caregiver_mj.caregivers.registry import check_acts_alone
from caregiver_mj.errors import CaregiverError, check_kind, check_number
from caregiver_mj.experiments.runner import run
from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.policy.own import OwnPolicy
from caregiver_mj.viz import AUTO, OVERLAYS, director, hud, progress_bar
from caregiver_mj.viz.cameras import Camera, Pose, StillCamera, TileLayer
from caregiver_mj.viz.colours import GROUND
from caregiver_mj.viz.episode import Episode
from caregiver_mj.viz.moment import HudState, place_of

_SMALLEST, _LARGEST = (320, 240), (3840, 2160)  # pixels
LONGEST = 86_400  # s; greatest length of a film
FORMATS = ".mp4", ".gif", ".webp"  # suffixes of films
_LOSSY = dict.fromkeys(FORMATS[1:], ("-crf", "8"))  # finer quality for films to convert
_TRAIL_SECONDS = 20.0  # s; length of the children's trails
_LEAST_INSET = 60  # pixels; least height of a legible inset
_WIDE = 1.5  # least ratio of width to height with room for insets beside the house
_OVERVIEW, _FOLLOW = "overview", "follow"
_SOMEWHERE = Pose((0.0, 0.0, 0.0), 1.0, 1.0)  # pose of a close shot before its first frame
# Insets beside a large view: few, because they hide some of it, unless there is a row below the house, or a column
# beside it that is wider than `_ASIDE`, as a share of the width.
_HAND = "hand"  # shot from one side: a thing in the hand hides all else from the wrist's camera
_BESIDE = {_OVERVIEW: (), _FOLLOW: (_HAND,), "wrist": (AUTO,), "eye": (AUTO,)}
_ASIDE = 1 / 3
_CAPTIONS = {AUTO: "close up", _HAND: "hand"}
_COLUMN = 0.23  # share of the width that a large close shot leaves to insets and plan
_TAG_ABOVE = 0.35  # m; height of a hazard's name above it
# Slices and stacks of round things, and side of the shadow map, pixels. Pixels; greatest height of a picture from a
# fixed camera with the coarse ones.
_FINE, _COARSE, _COARSE_HEIGHT = (22, 8, 2048), (16, 6, 1024), 480
_OPTIONS = (
    *("-preset", "veryfast", "-crf", "20", "-movflags", "+faststart"),
    # Players would otherwise assume another colour space.
    *("-vf", "scale=out_color_matrix=bt709:out_range=tv"),
    *("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"),
)


@dataclasses.dataclass(frozen=True)
class Picture:
    """Size, frame rate and camera of a film."""

    width: int = 1280  #: pixels, even
    height: int = 720  #: pixels, even
    fps: float = 30.0  #: frames per second
    #: camera of the large view: one of the model's, or "auto" for the whole house with a close-up beside it
    camera: str = AUTO

    def check(self) -> None:
        """Raise CaregiverError unless size and frame rate are valid."""
        for what, smallest, largest in zip(("width", "height"), _SMALLEST, _LARGEST, strict=True):
            size = getattr(self, what)
            if not isinstance(size, int) or size % 2 or not smallest <= size <= largest:
                raise CaregiverError(
                    f"{what} must be an even number of pixels from {smallest} to {largest}, got {size!r}"
                )
        check_number("fps", self.fps, 1, 120)


class Studio:
    """Films an episode."""

    def __init__(self, episode: Episode, picture: Picture, trail_length: int):
        """Set up the cameras, in a house with the picture's camera; trails have so many looks at the children.

        Raises:
            RenderingError: No OpenGL backend works.
        """
        self._episode, self._trail_length = episode, trail_length
        width, height, camera = picture.width, picture.height, picture.camera
        physics, plan = episode.env.physics, episode.env.task.plan
        is_wide = width > _WIDE * height
        if camera == AUTO and not is_wide:
            camera = _OVERVIEW
        is_close, is_still = camera == _FOLLOW, camera == AUTO or physics.model.ptr.camera(camera).bodyid == 0
        quality = physics.model.vis.quality
        quality.numquads = 1  # boxes lit by the sun alone look the same and render faster
        looks = isinstance(episode.policy, OwnPolicy) or (episode.policy and episode.policy.caregiver.needs_pictures)
        if not looks:  # no policy depends on images
            # Invisibly coarse: without a graphics card most of the time goes into vertices and shadows.
            fineness = _COARSE if is_still and height <= _COARSE_HEIGHT else _FINE
            quality.numslices, quality.numstacks, quality.shadowsize = fineness
        physics.fit_pictures(width, height)

        # The house is above the strip, and leaves a column or a row of these pixels to insets and plan.
        lower = hud.strip_top(width, height)
        where: str | Pose = camera
        self._column = self._row = 0
        if is_wide and camera in (AUTO, _OVERVIEW):  # nearer to the house than the model's camera
            where, self._column, self._row = director.overview(plan, width, lower)
        elif is_close:  # the model's camera shows the child alone, and walls hide it
            where, self._column = _SOMEWHERE, round(_COLUMN * width) if is_wide else 0
        self._page = np.full((height, width, 3), GROUND, np.uint8)
        self._main = self._page[: lower - self._row]
        size = width, len(self._main)
        self._camera = (StillCamera if is_still else Camera)(physics, where, *size, shadows=True)
        self._tiles = TileLayer(physics, where, *size, is_still) if episode.foresees else None

        inset_size = hud.layout(plan, width, height, episode.foresees, self._column, self._row).inset
        beside = AUTO if self._row or self._column > _ASIDE * width else camera
        names = _BESIDE.get(beside, (AUTO, _HAND)) if is_wide and inset_size[1] >= _LEAST_INSET else ()
        names = tuple(name for name in names if name != _HAND or episode.env.task.has_robot)
        self._insets = {name: Camera(physics, _SOMEWHERE, *inset_size) for name in names}
        shots = (self._camera, self._tiles) if is_close else (self._insets.get(AUTO),)
        self._close = [shot for shot in shots if shot]
        across, down = size if is_close else inset_size
        screens, close_column = director.screens(physics), _COLUMN if is_close and self._column else 0.0
        self._follow = director.CloseShot(across / down, picture.fps, screens, close_column)
        self._hand = director.HandShot(inset_size[0] / inset_size[1], picture.fps, screens)

    def frame(self) -> np.ndarray:
        """Return the frame of the present moment, (height, width, 3)."""
        state = self._episode.hud_state(self._trail_length)
        pose = self._follow.follow(state) if self._close else None
        for shot in self._close:
            shot.pose = pose
        self._main[:] = self._camera.render()
        if self._tiles:
            self._tiles.lay(self._main, self._episode.tiles())
        self._point_out(self._main, self._camera, state)
        insets = []
        for name in self._shown(state):
            picture = self._insets[name].render()
            self._point_out(picture, self._insets[name], state)
            insets.append((_CAPTIONS[name], picture))
        return hud.draw(self._page, state, insets, self._column, self._row)

    def _shown(self, state: HudState) -> list[str]:
        """Return the insets to show: the hand while it works, else the close-up."""
        if _HAND not in self._insets:
            return [*self._insets]
        pose = self._hand.follow(state, self._episode.env.physics)
        self._insets[_HAND].pose = pose
        return [name for name in self._insets if (name == _HAND) == (pose is not None)]

    def _point_out(self, picture: np.ndarray, camera: Camera, state: HudState) -> None:
        """Write the name of the hazard under intervention above it, in a picture of a free camera."""
        if state.target != NOTHING and camera.pose:
            x, y, z = (*place_of(state.plan, state.target, state.candles), 0.0)[:3]
            label = state.plan.hazards[state.target].label
            hud.draw_tag(picture, camera.pixel((x, y, z + _TAG_ABOVE)), label, len(self._page))


def render_episode(
    path: str | os.PathLike[str],
    spec: EpisodeSpec,
    *,
    seconds: float = 30.0,
    start: float | None = 0.0,
    picture: Picture = Picture(),
    overlay: str | None = None,
    still: str | os.PathLike[str] | None = None,
    quiet: bool = False,
    answers: str = "",
    studio: Callable[[Episode, Picture, int], Studio] = Studio,
) -> None:
    """Film an episode, with a display of the caregiver's knowledge and actions.

    Args:
        path: The film, `FILE.mp4`, `FILE.gif` or `FILE.webp`.
        spec: The episode; always in the house, even if its world is the grid.
        seconds: Greatest length of the film.
        start: Seconds of the episode before the film; None to film the stretch with most damage prevented.
        picture: Size, frame rate and camera.
        overlay: "danger" for the predicted places of the children and the hazards to them, on the floor; or None.
        still: Image to write of a telling moment, `FILE.png`: a child nearest to a candle in the robot's hand, or else
            the middle of the film.
        quiet: Whether to omit the progress bar.
        answers: The caregiver's earlier answers in this episode, to be replayed in its place; "" for none.
        studio: Makes the `Studio`, with its arguments.

    Raises:
        CaregiverError: An argument is invalid, or a file cannot be written.
        RenderingError: No OpenGL backend works.
    """
    picture.check()
    if not (isinstance(seconds, numbers.Real) and 0 < seconds <= LONGEST):
        raise CaregiverError(f"seconds must be a positive number of at most {LONGEST:,}, a day, got {seconds!r}")
    if not answers:
        check_acts_alone(spec.caregiver)
    if overlay not in (None, *OVERLAYS):
        raise CaregiverError(f"no overlay '{overlay}': there is {', '.join(OVERLAYS)}")
    path, still = _writable(path, *FORMATS), None if still is None else _writable(still, ".png")
    cameras = () if picture.camera == AUTO else (picture.camera,)
    filmed = Episode(dataclasses.replace(spec, world="house"), overlay == "danger", answers, cameras)
    if filmed.foresees and filmed.forecast is None:
        raise CaregiverError("caregiver must predict where children may be, as 'foresight' does, got one that does not")
    start = rescue_start(spec, answers, seconds) if start is None else start
    best: tuple[float, np.ndarray | None] = (math.inf, None)
    fps = picture.fps
    count = max(1, round(seconds * fps))
    middle = round(min(seconds, filmed.env.task.time_limit - start) * fps) // 2
    with contextlib.closing(filmed.env), progress_bar(quiet) as bar, film_writer(path, fps) as write:
        taken = bar.add_task("frames", total=count)
        shots = studio(filmed, picture, round(_TRAIL_SECONDS * fps))
        for number in range(count):
            if not filmed.run_until(start + number / fps):
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


def rescue_start(spec: EpisodeSpec, answers: str, seconds: float) -> float:
    """Return the start, s, of the film of an episode in which the caregiver prevents most damage.

    This runs the episode with and without the caregiver, and compares the damage in every stretch of the film's length,
    s. Of equal stretches it takes the middle one, in which the events are in the middle of the film.
    """
    damage: list[list[float]] = []  # damage so far, at the end of every timestep
    for who, text in (("none", ""), (spec.caregiver, answers)):
        so_far = [0.0]

        def watch(rollout: Any, so_far: list[float] = so_far) -> None:
            if rollout.ledger.timestep >= len(so_far):
                so_far.append(float(rollout.ledger.damage[0]))

        (found,) = run([dataclasses.replace(spec, caregiver=who)], [watch], answers=text).measured
        damage.append(so_far)
    prevented = np.array(damage[0]) - damage[1]
    timestep = found["sim_seconds"] / (len(prevented) - 1)
    length = min(math.ceil(seconds / timestep), len(prevented) - 1)
    gain = prevented[length:] - prevented[:-length]
    best = np.flatnonzero(gain == gain.max())
    return float(best[len(best) // 2] * timestep)


@contextlib.contextmanager
def film_writer(path: pathlib.Path, fps: float) -> Iterator[Callable[[np.ndarray], None]]:
    """Yield a function that takes frames, (height, width, 3). The file appears only when the film is complete.

    Raises:
        CaregiverError: The file cannot be written, or there was no frame.
    """
    unfinished = path.with_name(f".{path.name}.part.mp4")
    params = [*_OPTIONS, *_LOSSY.get(path.suffix.lower(), ())]
    try:
        unfinished.unlink(missing_ok=True)  # perhaps a link
        writer: Any = imageio.v2.get_writer(
            unfinished,
            "FFMPEG",
            codec="libx264",
            fps=fps,
            quality=None,
            macro_block_size=2,
            ffmpeg_log_level="error",
            output_params=params,
        )
        with writer:
            yield writer.append_data
        if not unfinished.exists():
            raise CaregiverError(f"a film must have at least 1 picture, got none for '{path}'")
        _convert(unfinished, path)
        unfinished.replace(path)
    except OSError as error:
        raise CaregiverError(f"'{path}' cannot be written: {error}") from None
    finally:
        unfinished.unlink(missing_ok=True)


def _convert(film: pathlib.Path, path: pathlib.Path) -> None:
    """Convert a finished film, in place, to the format of the path's suffix."""
    suffix = path.suffix.lower()
    if suffix == FORMATS[0]:
        return
    palette, made = film.with_suffix(".png"), film.with_suffix(suffix)
    steps: list[list[str]] = [["-c:v", "libwebp_anim", "-loop", "0", "-q:v", "80", str(made)]]
    if suffix == ".gif":  # two passes, for the palette of the whole film
        steps = [
            ["-vf", "palettegen=stats_mode=full", "-frames:v", "1", "-update", "1", str(palette)],
            ["-i", str(palette), "-lavfi", "paletteuse=dither=none:diff_mode=rectangle", str(made)],
        ]
    try:
        for options in steps:
            command = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error", "-i", str(film), *options]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                raise CaregiverError(f"'{path}' cannot be written: {' '.join(done.stderr.split())}")
        made.replace(film)
    finally:
        for file in (palette, made):
            file.unlink(missing_ok=True)


def _writable(path: str | os.PathLike[str], *suffixes: str) -> pathlib.Path:
    """Return the path; raise CaregiverError unless a file with one of the suffixes can be written there."""
    check_kind("a file", path, str, os.PathLike)
    path = pathlib.Path(path)
    if path.suffix.lower() not in suffixes:
        names = ", ".join(f"FILE{suffix}" for suffix in suffixes)
        raise CaregiverError(f"the file must be called {names.replace(', ', ' or ')}, got '{path}'")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path.parent):
            pass
        folder = path.is_dir()  # fails, too, if the name is too long
    except OSError as error:
        raise CaregiverError(f"'{path}' cannot be written: {error.strerror}") from None
    if folder:
        raise CaregiverError(f"'{path}' cannot be written: it is a folder")
    return path

"""Films of episodes in the house: H.264 in MP4, at the speed of the simulated world."""

from __future__ import annotations

import caregiver_mj.house.rendering

# isort: split
import contextlib
import math
import os
import pathlib
import tempfile
from collections.abc import Iterator

import imageio_ffmpeg
import mujoco
import numpy as np
import rich.console
import rich.progress
from dm_control.mujoco import engine
from PIL import Image

import caregiver_mj
from caregiver_mj.caregivers.caregiver import Assessment
from caregiver_mj.children.novice import CANDLE_DAMAGE, EPISODE_TIMESTEPS, STAIRWELL_DAMAGE
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz import hud

Part = tuple[int, int, int, int]  # of a picture, in pixels: left, top, right, bottom

DEFAULT_SIZE = 1280, 720  # pixels
DEFAULT_FPS = 30.0
_SMALLEST, _LARGEST = (320, 240), (3840, 2160)  # pixels
_INSETS = {"follow": "toddler", "wrist": "gripper"}  # cameras shown beside the overview, and their captions
_WIDE = 1.5  # width over height from which a picture has room for insets beside the house
_TRAIL_SECONDS = 20.0
_MOVED = 1e-4  # metres, or radians, by which something must have moved to be drawn anew
_PART_OVERHEAD = 10_000  # pixels that could be drawn in the time that one more part of a picture takes
_HIDDEN = 3  # the first group of geoms that MuJoCo does not draw
_NEAREST = 0.01  # metres before a camera
_LIFTED = 0.05  # metres above its place at the start from which a candle is in the robot's hand

# x264's quality (lower is better), and how much it works for a small file.
_QUALITY, _PRESET = "20", "veryfast"


def render_episode(
    path: str | os.PathLike[str],
    *,
    task: str = "supervise",
    house: str | os.PathLike[str] | FloorPlan = "paper",
    epsilon: float = 0.5,
    seed: int = 0,
    seconds: float = 30.0,
    caregiver: str = "paper",
    width: int = DEFAULT_SIZE[0],
    height: int = DEFAULT_SIZE[1],
    fps: float = DEFAULT_FPS,
    camera: str = "overview",
    still: str | os.PathLike[str] | None = None,
    quiet: bool = False,
) -> None:
    """Films an episode, with what the caregiver knows and does on display.

    Args:
        path: The film, `FILE.mp4`.
        task: One of `caregiver_mj.ALL_TASKS`.
        house: A floor plan, the name of one that comes with the package, or the path of a file.
        epsilon: The novice's share of random moves.
        seed: Seed of the episode and of the caregiver.
        seconds: Length of the film; less if the episode is over before.
        caregiver: Name of the caregiver; without a robot for "none".
        width: Width of the picture in pixels, even.
        height: Height of the picture in pixels, even.
        fps: Frames a second.
        camera: The camera of the large view.
        still: Where to put a picture of a telling moment, `FILE.png`: the toddler nearest to a candle in the
            robot's hand, or else the middle of the film.
        quiet: Whether to do without the progress bar.

    Raises:
        CaregiverError: Something of the above is not possible.
        RenderingError: There is no OpenGL to render with.
    """
    path, still = _writable(path, ".mp4"), None if still is None else _writable(still, ".png")
    _check_picture(width, height, fps, seconds)
    episode = _Episode(task, house, epsilon, seed, caregiver)
    best: tuple[float, np.ndarray | None] = (math.inf, None)
    count = max(1, round(seconds * fps))
    with (
        contextlib.closing(episode.env),
        _progress(count, quiet) as advance,
        _film(path, width, height, fps) as film,
    ):
        studio = _Studio(episode, width, height, camera, trail_length=round(_TRAIL_SECONDS * fps))
        for number in range(count):
            if not episode.run_until(number / fps):
                break
            frame = studio.frame()
            film.send(np.ascontiguousarray(frame))
            score = min(episode.child_to_carried_candle(), 1e6 + abs(number - count // 2))
            if score < best[0]:
                best = (score, frame)
            advance()
    if still is not None:
        Image.fromarray(best[1]).save(still)


class _Episode:
    """The closed loop, and the state to display."""

    def __init__(self, task: str, house: str | os.PathLike[str] | FloorPlan, epsilon: float, seed: int, caregiver: str):
        robot = caregiver != "none"
        random = np.random.RandomState(seed)
        self.env = caregiver_mj.load(task, house=house, epsilon=epsilon, random=random, task_kwargs={"robot": robot})
        self._policy = caregiver_mj.CaregiverPolicy(self.env, caregiver=caregiver, seed=seed) if robot else None
        self._epsilon = epsilon
        plan = self.env.task.plan
        counts = len(plan.stairwells), len(plan.candle_tables)
        self._damage = np.repeat([STAIRWELL_DAMAGE, CANDLE_DAMAGE], counts)  # d_o of every candidate
        self._timestep = self.env.reset()
        self._action = self._decide()
        self._steps = 0
        self._candle_rest = self._candles()[:, 2]
        self._trail: list[np.ndarray] = []

    def run_until(self, seconds: float) -> bool:
        """Runs the simulation up to a time; whether the episode lasts so long."""
        period = self.env.control_timestep()
        while (self._steps + 0.5) * period < seconds:
            if self._timestep.last():
                return False
            self._timestep = self.env.step(self._action)
            self._action = self._decide()
            self._steps += 1
        self._trail.append(self._timestep.observation["toddler_position"][:2].copy())
        return True

    def _decide(self) -> np.ndarray:
        if self._policy is None:
            return np.zeros(self.env.action_spec().shape)
        return self._policy(self._timestep)

    def _candles(self) -> np.ndarray:
        return self._timestep.observation.get("candle_position", np.empty((0, 3)))

    def child_to_carried_candle(self) -> float:
        """Distance (m) of the toddler from the nearest candle that is in the robot's hand; infinite if none is."""
        candles = self._candles()
        carried = candles[candles[:, 2] > self._candle_rest + _LIFTED]
        offset = carried[:, :2] - self._timestep.observation["toddler_position"][:2]
        return float(np.linalg.norm(offset, axis=1).min(initial=math.inf))

    def hud_state(self, trail_length: int) -> hud.HudState:
        """What the display shows of this moment."""
        observation, policy, task = self._timestep.observation, self._policy, self.env.task
        assessment: Assessment | None = policy.assessment if policy else None
        outcome = task.outcome()
        return hud.HudState(
            plan=task.plan,
            timestep=min(int(observation["clock"] + 1e-6), EPISODE_TIMESTEPS),
            epsilon=self._epsilon,
            toddler=observation["toddler_position"][:2],
            candles=self._candles(),
            trail=np.array(self._trail[-trail_length:]),
            damage=outcome["damage"],
            damages={
                "stairs": outcome["damage_stairwell"],
                "candles": outcome["damage_candle"],
                "tables": outcome["damage_table"],
            },
            robot=observation.get("base_position"),
            safe=None if assessment is None else float(assessment.safe[0]),
            danger=None if assessment is None else assessment.danger[0],
            hazard=None if assessment is None else assessment.reach[0] * self._damage,
            target=-1 if policy is None else policy.target,
            intervention=policy.activity if policy else "",
        )


class _Studio:
    """Cameras on an episode, and the page that their pictures are laid out on."""

    def __init__(self, episode: _Episode, width: int, height: int, camera: str, trail_length: int):
        self._episode, self._trail_length = episode, trail_length
        physics = episode.env.physics
        names = {name.split("/")[-1]: name for name in _camera_names(physics)}
        if camera not in names:
            raise CaregiverError(f"no camera '{camera}': there are {', '.join(sorted(names))}")
        # These take effect when OpenGL is brought up, which is at the first camera.
        physics.model.vis.global_.offwidth = width
        physics.model.vis.global_.offheight = height
        physics.model.vis.quality.numquads = 1  # lit by the sun alone, boxes look the same and are drawn faster
        self._page = np.empty((height, width, 3), np.uint8)
        self._page[:] = hud.GROUND
        self._main = self._page[: hud.strip_top(width, height)]  # nothing hides behind the strip
        main_height = self._main.shape[0]
        if physics.model.ptr.camera(names[camera]).bodyid == 0:  # the world's
            self._camera = _StillCamera(physics, names[camera], width, main_height)
        else:
            self._camera = _Camera(physics, names[camera], width, main_height, shadows=True)
        self._insets = []
        if width > _WIDE * height:
            for name, caption in _INSETS.items():
                if name in names and name != camera:
                    inset = _Camera(physics, names[name], *hud.inset_size(width, height))
                    self._insets.append((caption, inset))

    def frame(self) -> np.ndarray:
        """Renders the present moment, (height, width, 3)."""
        self._main[:] = self._camera.render()
        insets = [(caption, camera.render()) for caption, camera in self._insets]
        return hud.draw(self._page, self._episode.hud_state(self._trail_length), insets)


class _Camera:
    """A camera that leaves out of the scene what it does not see.

    OpenGL would do so too, but one triangle after the other.
    """

    def __init__(self, physics, name: str, width: int, height: int, shadows: bool = False):
        self._physics = physics
        self._width, self._height = width, height
        self._camera = engine.Camera(physics, height=height, width=width, camera_id=name)
        self._camera.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shadows
        self._model, self._data = physics.model.ptr, physics.data.ptr
        self._id = physics.model.name2id(name, "camera")
        self._scale = height / 2 / math.tan(math.radians(self._model.cam_fovy[self._id]) / 2)  # pixels a metre, 1 m off
        self._geoms = np.flatnonzero(self._model.geom_group < _HIDDEN)
        radius = self._model.geom_rbound[self._geoms]
        self._radius = np.where(radius > 0, radius, np.inf)  # a plane has none
        suns = self._model.light_castshadow.astype(bool) & shadows
        self._sunlight = self._data.light_xdir[suns]  # (suns, 3); nothing else in the house throws shadows

    def render(self) -> np.ndarray:
        """Draws the picture (height, width, 3)."""
        with self._only(self._seen_in(0, 0, self._width, self._height)):
            return self._camera.render()

    def _seen_in(self, left: int, top: int, right: int, bottom: int) -> np.ndarray:
        """Mask of the geoms that lie, or throw a shadow, in a part of the picture."""
        boxes = self._boxes(self._data.geom_xpos[self._geoms], self._radius)
        return (boxes[:, :2] < (right, bottom)).all(axis=1) & (boxes[:, 2:] > (left, top)).all(axis=1)

    def _boxes(self, centres: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Where in the picture balls and their shadows on the floor are.

        Args:
            centres: Their centres, (n, 3), metres.
            radius: Their radii, (n,), metres.

        Returns:
            Bounds in pixels: left, top, right, bottom, (n, 4); infinite ones for what is beside the camera.
        """
        on_floor = [centres - centres[:, 2:] / light[2] * light for light in self._sunlight]
        axes = self._data.cam_xmat[self._id].reshape(3, 3) * (1, -1, -1)  # to the right, down, and ahead
        places = (np.stack([centres, *on_floor]) - self._data.cam_xpos[self._id]) @ axes  # (1 + suns, n, 3)
        across, depth, radius = places[..., :2], places[..., 2:], radius[:, None]
        beside = depth - radius < _NEAREST
        near, far = np.where(beside, 1.0, depth - radius), np.where(beside, 1.0, depth + radius)
        low = np.minimum((across - radius) / near, (across - radius) / far) * self._scale - 2
        high = np.maximum((across + radius) / near, (across + radius) / far) * self._scale + 2
        low, high = np.where(beside, -np.inf, low).min(axis=0), np.where(beside, np.inf, high).max(axis=0)
        centre = np.array([self._width, self._height]) / 2
        return np.concatenate([centre + low, centre + high], axis=1)

    @contextlib.contextmanager
    def _only(self, seen: np.ndarray) -> Iterator[None]:
        """Within, scenes are made of the geoms of a mask alone."""
        unseen, groups = self._geoms[~seen], self._model.geom_group
        before = groups[unseen]
        groups[unseen] = _HIDDEN
        try:
            yield
        finally:
            groups[unseen] = before


class _StillCamera(_Camera):
    """A camera that does not move: after the first picture it draws only the part in which something else has.

    Without a graphics card the time goes into pixels, and most of them show the same house as before.
    """

    def __init__(self, physics, name: str, width: int, height: int):
        super().__init__(physics, name, width, height, shadows=True)
        self._picture: np.ndarray | None = None
        self._poses = self._read_poses()

    def render(self) -> np.ndarray:
        """Draws the picture (height, width, 3), which stays the camera's."""
        poses = self._read_poses()
        moved = (np.abs(poses - self._poses) > _MOVED).any(axis=1)
        if self._picture is None:
            self._picture = self._camera.render().copy()
        else:
            for part in self._changed_parts(poses, moved):
                self._redraw(*part)
        self._poses[moved] = poses[moved]
        return self._picture

    def _changed_parts(self, poses: np.ndarray, moved: np.ndarray) -> list[Part]:
        """Parts of the picture that hold all that has moved, before and after."""
        owner = self._model.body_rootid[self._model.geom_bodyid[self._geoms]]
        parts: list[Part] = []
        for body in np.unique(owner[moved]):
            geoms = moved & (owner == body)
            centres = np.concatenate([poses[geoms, :3], self._poses[geoms, :3]])
            boxes = self._boxes(centres, np.tile(self._radius[geoms], 2))
            size = self._width, self._height
            left, top = np.clip(np.floor(boxes[:, :2].min(axis=0)), 0, size).astype(int).tolist()
            right, bottom = np.clip(np.ceil(boxes[:, 2:].max(axis=0)), 0, size).astype(int).tolist()
            part = left, top, right, bottom
            for other in list(parts):
                if _area(_union(part, other)) < _area(part) + _area(other) + _PART_OVERHEAD:
                    parts.remove(other)
                    part = _union(part, other)
            parts.append(part)
        return [part for part in parts if _area(part)]

    def _read_poses(self) -> np.ndarray:
        """Position and rotation of everything that is drawn, (geoms, 12)."""
        return np.concatenate([self._data.geom_xpos[self._geoms], self._data.geom_xmat[self._geoms]], axis=1)

    def _redraw(self, left: int, top: int, right: int, bottom: int) -> None:
        """Draws a part of the picture anew, through the part of the frustum that belongs to it."""
        with self._only(self._seen_in(left, top, right, bottom)):
            self._camera.update()
        for eye in self._camera.scene.camera:
            pixel = (eye.frustum_top - eye.frustum_bottom) / self._height
            eye.frustum_center += (left + right - self._width) / 2 * pixel
            eye.frustum_top, eye.frustum_bottom = (eye.frustum_top - edge * pixel for edge in (top, bottom))
        part = np.empty((bottom - top, right - left, 3), np.uint8)
        area = mujoco.MjrRect(0, 0, right - left, bottom - top)
        contexts = self._physics.contexts
        with contexts.gl.make_current() as gl:
            gl.call(mujoco.mjr_render, area, self._camera.scene.ptr, contexts.mujoco.ptr)
            gl.call(mujoco.mjr_readPixels, part, None, area, contexts.mujoco.ptr)
        self._picture[top:bottom, left:right] = part[::-1]


def _area(part: Part) -> int:
    return max(part[2] - part[0], 0) * max(part[3] - part[1], 0)


def _union(one: Part, other: Part) -> Part:
    return min(one[0], other[0]), min(one[1], other[1]), max(one[2], other[2]), max(one[3], other[3])


def _camera_names(physics) -> list[str]:
    return [physics.model.id2name(i, "camera") for i in range(physics.model.ncam)]


def _check_picture(width: int, height: int, fps: float, seconds: float) -> None:
    for what, size, smallest, largest in zip(("width", "height"), (width, height), _SMALLEST, _LARGEST, strict=True):
        if size % 2 or not smallest <= size <= largest:
            raise CaregiverError(f"{what} must be an even number of pixels from {smallest} to {largest}, not {size}")
    if not 1.0 <= fps <= 120.0:
        raise CaregiverError(f"fps must lie in 1 to 120, not {fps}")
    if not (math.isfinite(seconds) and seconds > 0):
        raise CaregiverError(f"seconds must be a positive length, not {seconds}")


def _writable(path: str | os.PathLike[str], suffix: str) -> pathlib.Path:
    """The path, once it is sure that a file of that kind can be written there."""
    path = pathlib.Path(path)
    if path.suffix.lower() != suffix:
        raise CaregiverError(f"'{path}' must be called FILE{suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise CaregiverError(f"'{path}' cannot be written: {error.strerror}") from None
    if path.is_dir():
        raise CaregiverError(f"'{path}' cannot be written: it is a folder")
    return path


@contextlib.contextmanager
def _film(path: pathlib.Path, width: int, height: int, fps: float) -> Iterator:
    """A generator to send frames to. The file appears when the film is complete, and only then."""
    unfinished = path.with_name(f".{path.name}.part.mp4")
    writer = imageio_ffmpeg.write_frames(
        str(unfinished),
        (width, height),
        fps=fps,
        codec="libx264",
        quality=None,
        macro_block_size=2,
        ffmpeg_log_level="error",
        output_params=[
            *("-preset", _PRESET, "-crf", _QUALITY, "-movflags", "+faststart"),
            # Without this, players take the colours for those of high definition while they are not.
            *("-vf", "scale=out_color_matrix=bt709:out_range=tv"),
            *("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"),
        ],
    )
    writer.send(None)
    try:
        yield writer
        writer.close()
        unfinished.replace(path)
    except OSError as error:
        raise CaregiverError(f"'{path}' cannot be written: {error}") from None
    finally:
        writer.close()
        unfinished.unlink(missing_ok=True)


@contextlib.contextmanager
def _progress(frames: int, quiet: bool) -> Iterator:
    """A progress bar on standard error; gives the function that advances it."""
    columns = (
        rich.progress.TextColumn("{task.description}"),
        rich.progress.BarColumn(),
        rich.progress.MofNCompleteColumn(),
        rich.progress.TimeElapsedColumn(),
        rich.progress.TimeRemainingColumn(),
    )
    with rich.progress.Progress(*columns, console=rich.console.Console(stderr=True), disable=quiet) as bar:
        task = bar.add_task("frames", total=frames)
        yield lambda: bar.advance(task)

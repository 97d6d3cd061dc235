"""A session in a browser: viser serves the page, and mjviser converts the model to meshes."""

from __future__ import annotations

import contextlib
import copy
import http
import io
import ipaddress
import queue
import socket
import time
from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import urlsplit

import mujoco
import numpy as np

from caregiver_mj.errors import CaregiverError, MissingExtraError
from caregiver_mj.viz.episode import Episode
from caregiver_mj.viz.moment import Tile
from caregiver_mj.viz.viewers import Session

try:
    import trimesh
    import viser
    import websockets.asyncio.server
    from mjviser import ViserMujocoScene
except ImportError as error:
    raise MissingExtraError(
        f"the viewer in a browser needs viser and mjviser ({error}): pip install 'caregiver_mj[web]'"
    ) from None

from caregiver_mj.viz.viewers.web_panel import Panel

_SEEN = 3  # first hidden group of geoms
_NOWHERE = 5  # hidden group of sites
_REFLECTED = 0.45  # intensity of ambient light
# Possible opacities of tiles, with a mesh for each: browsers remake a mesh whose opacity changes.
_OPACITIES = np.linspace(0.1, 0.8, 8)
_GONE = 1e-6  # m; size of an unused tile


class Server(viser.ViserServer):
    """A server without a public address."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Do nothing: any page could request it, and it would make this server public."""
        return None


class WebViewer:
    """Serves a session to browsers at `url`. Everything except the network runs in the thread that calls `run`."""

    def __init__(self, session: Session, host: str, port: int, rate: float, plain: bool = False):
        """Serve a session at an address, with a rate of updates per second; `plain` without shadows, which are slow.

        Raises:
            CaregiverError: The address is not available.
        """
        self.session, self._period, self._plain = session, 1.0 / rate, plain
        self._wishes: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        with contextlib.redirect_stdout(io.StringIO()), _guarded(host):  # without its message
            self.server = Server(host=host, port=port, label="caregiver-mj", verbose=False)
        self.url = f"http://{f'[{host}]' if ':' in host else host}:{self.server.get_port()}"
        self.server.gui.configure_theme(show_logo=False, show_share_button=False)
        self.server.gui.main_panel.dock_right()
        self._panel = Panel(self.server, session, self._wishes.put)
        self._panel.fill_in()
        self._scene = WebScene(self.server, session.episode, plain)

    def run(self) -> None:
        """Run the session until it is interrupted."""
        due = time.monotonic()
        while True:
            due = max(due + self._period, time.monotonic())
            self._take_wishes(due)
            self.session.advance()
            self.show()

    def show(self) -> None:
        """Show the present moment."""
        episode = self.session.episode
        if self._scene.kind != _kind(episode):
            self._scene = WebScene(self.server, episode, self._plain)
            self.session.skip_time()
        self._panel.show()
        self._scene.show(episode, self._panel.foreseen.value)

    def close(self) -> None:
        """Stop the server."""
        with contextlib.redirect_stdout(io.StringIO()):
            self.server.stop()

    def _take_wishes(self, until: float) -> None:
        """Carry out requests of browsers, up to a time."""
        while True:
            try:
                wish = self._wishes.get(timeout=max(until - time.monotonic(), 0.0))
            except queue.Empty:
                return
            wish()


def check_address(host: str, port: int) -> None:
    """Raise CaregiverError unless an address is available; viser would try other ports without end."""
    try:
        kind, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(kind, socket.SOCK_STREAM) as listener:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(address)
            listener.listen()
    except (OSError, OverflowError, UnicodeError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise CaregiverError(f"cannot listen at {host}, port {port}: {why}; --port 0 takes any that is free") from None


def refusal(headers: Any, host: str) -> str:
    """Return the reason to refuse a request to a server at an address, or "".

    Pages of other sites must not read the scene, neither from their own origin nor by a name of theirs that resolves to
    this machine (DNS rebinding). Programs other than browsers send no origin.
    """
    names, origins = headers.get_all("Host"), headers.get_all("Origin")
    try:
        name = urlsplit(f"//{names[0]}").hostname or ""
    except (IndexError, ValueError):
        name = ""
    if len(names) != 1 or not _is_ours(name, host):
        return "Host must be a name of this machine"
    if any(origin not in (f"http://{names[0]}", f"https://{names[0]}") for origin in origins):
        return "Origin must be this page"
    return ""


def _is_ours(name: str, host: str) -> bool:
    """Return whether a name belongs to a server at an address; an IP address always does."""
    if name in ("localhost", "127.0.0.1", "::1", host.lower()):
        return True
    if host not in ("", "0.0.0.0", "::"):
        return False
    with contextlib.suppress(ValueError):
        return bool(ipaddress.ip_address(name))
    return name == socket.gethostname().lower()


@contextlib.contextmanager
def _guarded(host: str) -> Iterator[None]:
    """Make servers started in this context refuse requests of other sites, for which viser has no option."""
    serve, guarded = websockets.asyncio.server.serve, False

    def guarded_serve(*args: Any, process_request: Any, **options: Any) -> Any:
        nonlocal guarded
        guarded = True

        def guard(connection: Any, request: Any) -> Any:
            given = process_request(connection, request)  # called in any case: it also silences the log
            why = refusal(request.headers, host)
            return connection.respond(http.HTTPStatus.FORBIDDEN, f"{why}\n") if why else given

        return serve(*args, process_request=guard, **options)

    websockets.asyncio.server.serve = guarded_serve  # type: ignore[misc, assignment]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]
    if not guarded:
        raise CaregiverError(f"viser must be a version whose requests can be checked, got {viser.__version__}")


class WebScene:
    """The house of an episode, in all connected browsers."""

    def __init__(self, server: viser.ViserServer, episode: Episode, plain: bool = False):
        """Replace the scene by the house of an episode, a plain one without shadows."""
        self.kind = _kind(episode)
        server.scene.reset()
        server.scene.set_up_direction("+z")
        server.scene.world_axes.visible = False
        model = _shown_model(episode.env.physics.model.ptr)
        self._house = ViserMujocoScene(server, model, num_envs=1)
        self._house.camera_tracking_enabled = False
        # With ambient light: meshes without a material are metal, which is black in the dark.
        server.scene.configure_environment_map(environment_intensity=_REFLECTED)
        server.scene.configure_default_lights(cast_shadow=not plain)
        self._server = server
        self._shown: list[Tile] = []
        plan = episode.env.task.plan
        self._room = len(plan.free_cells) + len(plan.hazards)
        self._floor = [self._add_tiles(opacity) for opacity in _OPACITIES.tolist()]
        # Browsers start at the overview camera.
        place, ahead, distance = episode.overview()
        eye = server.initial_camera
        eye.position, eye.look_at = place, place + distance * ahead
        eye.fov = float(np.radians(model.camera("overview").fovy[0]))

    def show(self, episode: Episode, foreseen: bool) -> None:
        """Show the present moment, on request with the caregiver's predictions."""
        tiles = episode.tiles() if foreseen else []
        with self._server.atomic():
            if tiles != self._shown:
                self._lay(tiles)
            self._house.update_from_mjdata(episode.env.physics.data.ptr)

    def _add_tiles(self, opacity: float) -> viser.BatchedMeshHandle:
        """Add as many tiles of an opacity as there can be, invisible."""
        nothing = np.zeros((self._room, 3), np.float32)
        cube = trimesh.creation.box(extents=(2.0, 2.0, 2.0))
        return self._server.scene.add_batched_meshes_simple(
            f"/foreseen/{opacity:.2f}", cube.vertices, cube.faces,
            batched_wxyzs=np.tile(np.array([1, 0, 0, 0], np.float32), (self._room, 1)), batched_positions=nothing,
            batched_scales=nothing + np.float32(_GONE), batched_colors=nothing.astype(np.uint8), opacity=opacity,
            lod="off", cast_shadow=False, receive_shadow=False, flat_shading=True,
        )  # fmt: skip

    def _lay(self, tiles: list[Tile]) -> None:
        self._shown = tiles
        nearest = [int(np.abs(_OPACITIES - tile.opacity).argmin()) for tile in tiles]
        for level, handle in enumerate(self._floor):
            here = [tile for tile, its in zip(tiles, nearest, strict=True) if its == level]
            places, scales = np.zeros((self._room, 3), np.float32), np.full((self._room, 3), _GONE, np.float32)
            colours = np.zeros((self._room, 3), np.uint8)
            if here:
                places[: len(here)] = [(*tile.centre, tile.height / 2) for tile in here]
                scales[: len(here)] = [(tile.half, tile.half, tile.height / 2) for tile in here]
                colours[: len(here)] = [tile.colour for tile in here]
            handle.batched_positions, handle.batched_scales, handle.batched_colors = places, scales, colours


def _kind(episode: Episode) -> tuple[Any, ...]:
    """Return all that a scene depends on: plan, number of children, and robot."""
    task = episode.env.task
    return task.plan.text, len(task.family), task.has_robot, task.embodiment.name


def _shown_model(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a copy of a model with its hidden parts invisible; the viewer writes to it."""
    shown = copy.copy(model)
    plane = shown.geom_type == mujoco.mjtGeom.mjGEOM_PLANE  # would be shown as an endless grid
    shown.geom_type[plane] = mujoco.mjtGeom.mjGEOM_BOX
    shown.geom_rgba[plane | (shown.geom_group >= _SEEN), 3] = 0
    shown.site_group[:] = _NOWHERE
    return shown

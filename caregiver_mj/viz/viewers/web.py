"""A session in a browser: viser serves the page, mjviser turns the model into meshes."""

from __future__ import annotations

import contextlib
import io
import queue
import socket
import time
from collections.abc import Callable

from caregiver_mj.errors import CaregiverError, MissingExtraError
from caregiver_mj.viz.viewers.session import Session

try:
    import mjviser  # noqa: F401
    import viser
except ImportError as error:
    raise MissingExtraError(
        f"the viewer in a browser needs viser and mjviser ({error}): pip install 'caregiver_mj[web]'"
    ) from None

from caregiver_mj.viz.viewers.web_panel import Panel
from caregiver_mj.viz.viewers.web_scene import WebScene

HOST, PORT = "127.0.0.1", 8080
RATE = 20.0  # updates a second


class Server(viser.ViserServer):
    """A server that stays where it is."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Does nothing: any page could ask for it, and it would make this one public."""
        return None


class WebViewer:
    """Serves a session to browsers. All but the network is done in the thread that calls `run`.

    Attributes:
        session: What is shown.
        server: What browsers are connected to.
        url: Where.
    """

    def __init__(self, session: Session, host: str = HOST, port: int = PORT, rate: float = RATE, plain: bool = False):
        """Begins to serve.

        Args:
            session: What to show.
            host: Address to listen at; that of this machine alone by default.
            port: Port to listen at; any that is free if 0.
            rate: Updates a second.
            plain: Whether to do without shadows; they cost much where there is no graphics card.

        Raises:
            CaregiverError: One cannot listen there.
        """
        check_address(host, port)
        self.session, self._period, self._plain = session, 1.0 / rate, plain
        self._wishes: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        with contextlib.redirect_stdout(io.StringIO()):  # it would say where it listens, in its own words
            self.server = Server(host=host, port=port, label="caregiver-mj", verbose=False)
        self.url = f"http://{f'[{host}]' if ':' in host else host}:{self.server.get_port()}"
        self.server.gui.configure_theme(show_logo=False, show_share_button=False)
        self.server.gui.main_panel.dock_right()
        self._panel = Panel(self.server, session, self._wishes.put)
        self._panel.fill_in()
        self._scene = WebScene(self.server, session.episode, plain)

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Runs the session until somebody interrupts it, or until something is true."""
        due = time.monotonic()
        while not until():
            due = max(due + self._period, time.monotonic())
            self._take_wishes(due)
            self.session.advance()
            self.show()

    def show(self) -> None:
        """Shows the present moment."""
        episode = self.session.episode
        if not self._scene.fits(episode):
            self._scene = WebScene(self.server, episode, self._plain)
            self.session.skip_time()
        self._panel.show()
        self._scene.show(episode, self._panel.foreseen)

    def close(self) -> None:
        """Ends the server."""
        with contextlib.redirect_stdout(io.StringIO()):
            self.server.stop()

    def __enter__(self) -> WebViewer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _take_wishes(self, until: float) -> None:
        """Does what browsers ask for, up to a time."""
        while True:
            try:
                wish = self._wishes.get(timeout=max(until - time.monotonic(), 0.0))
            except queue.Empty:
                return
            wish()


def check_address(host: str, port: int) -> None:
    """Raises CaregiverError unless one can listen there: the server itself would try other ports, without an end."""
    try:
        kind, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(kind, socket.SOCK_STREAM) as listener:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(address)
            listener.listen()
    except (OSError, OverflowError, UnicodeError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise CaregiverError(f"cannot listen at {host}, port {port}: {why}; --port 0 takes any that is free") from None

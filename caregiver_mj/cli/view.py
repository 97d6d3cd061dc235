"""`caregiver-mj view`: shows an episode in the physical house while it runs."""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from caregiver_mj.caregivers.registry import find_caregiver
from caregiver_mj.cli.parsing import (
    HelpFormatter,
    add_children,
    add_embodiment,
    add_house,
    add_seed,
    caregivers,
    read_family,
)
from caregiver_mj.errors import CaregiverError, RenderingError
from caregiver_mj.plans.hazards import DamageWeights

if TYPE_CHECKING:
    from caregiver_mj.viz.viewers.session import Session
    from caregiver_mj.viz.viewers.web import WebViewer
    from caregiver_mj.viz.viewers.window import Window


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    command = commands.add_parser(
        "view",
        help="watch an episode in the physical house while it runs",
        description="Show an episode of the run that `evaluate` does with the same seed, children and caregiver: in "
        "a window of MuJoCo's, or in a browser. Ctrl-C ends it.",
        formatter_class=HelpFormatter,
    )
    add_house(command)
    command.add_argument(
        "--epsilon",
        default="0.5",
        metavar="E[,E...]",
        help="share of random moves; of several children one each, such as 1,.25",
    )
    add_children(command)
    command.add_argument("--caregiver", default="foresight", metavar="NAME", help=caregivers())
    add_embodiment(command)
    add_seed(command, "seed of the run that the episode belongs to")
    command.add_argument("--episode", type=int, default=0, metavar="N", help="number of the episode in that run")
    command.add_argument("--speed", type=float, default=1.0, help="simulated seconds a second")
    command.add_argument("--paused", action="store_true", help="begin paused")
    command.add_argument("--web", action="store_true", help="show it in a browser (needs the extra `web`)")
    command.add_argument("--host", default="127.0.0.1", metavar="ADDRESS", help="address to serve it at")
    command.add_argument("--port", type=int, default=8080, help="port to serve it at, 0 for any that is free")
    command.add_argument("--rate", type=float, default=20.0, metavar="N", help="updates of the page a second")
    command.add_argument(
        "--plain", action="store_true", help="no shadows in the browser: quicker without a graphics card"
    )
    command.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> None:
    family = read_family(arguments.epsilon, arguments)
    find_caregiver(arguments.caregiver)
    damage = DamageWeights.of(arguments.damage)
    if not 0.1 <= arguments.rate <= 120:
        raise CaregiverError(f"rate must be in 0.1 to 120, got {arguments.rate}")
    if not 0 <= arguments.port <= 65535:
        raise CaregiverError(f"port must be in 0 to 65535, got {arguments.port}")
    show = _serve if arguments.web else _open_window
    if not arguments.web:
        _check_display()

    from caregiver_mj.viz.viewers.session import (
        Session,  # here, for these take seconds to import
        Watched,
    )

    watched = Watched(
        arguments.house, family, arguments.caregiver, arguments.seed, arguments.episode, damage, arguments.embodiment
    )
    show(lambda: Session(watched, speed=arguments.speed, playing=not arguments.paused), arguments)


def _serve(start: Callable[[], Session], arguments: argparse.Namespace) -> None:
    from caregiver_mj.viz.viewers.web import WebViewer, check_address

    check_address(arguments.host, arguments.port)  # before the house is made, which takes longer
    viewer = WebViewer(start(), arguments.host, arguments.port, arguments.rate, plain=arguments.plain)
    print(f"{viewer.url}   (Ctrl-C ends it)", flush=True)
    _watch(viewer)


def _open_window(start: Callable[[], Session], _arguments: argparse.Namespace) -> None:
    from caregiver_mj.viz.viewers.window import Window

    _watch(Window(start()))


def _watch(viewer: WebViewer | Window) -> None:
    """Run a viewer until somebody closes or interrupts it: that is how one ends it, and no failure."""
    try:
        viewer.run()
    except KeyboardInterrupt:
        print("closed", file=sys.stderr)
    finally:
        with _deaf():
            viewer.close()


@contextlib.contextmanager
def _deaf() -> Iterator[None]:
    """Within, SIGTERM does nothing: some say it twice, and all is ending anyway."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _check_display() -> None:
    """Raise RenderingError where there can be no window."""
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise RenderingError("no display for a window: use `caregiver-mj view --web` and a browser")

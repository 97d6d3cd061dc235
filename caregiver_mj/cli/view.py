"""`caregiver-mj render` and `view`: film an episode in the physical house, and show it while it runs."""

from __future__ import annotations

import argparse
import contextlib
import functools
import os
import signal
import sys
import threading
from collections.abc import Iterator
from typing import TYPE_CHECKING

from caregiver_mj.caregivers.registry import find_caregiver
from caregiver_mj.cli import parsing
from caregiver_mj.errors import CaregiverError, RenderingError
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.viz import OVERLAYS

if TYPE_CHECKING:
    from caregiver_mj.viz.viewers.web import WebViewer
    from caregiver_mj.viz.viewers.window import Window


def add_render(command: argparse.ArgumentParser) -> None:
    """Add the options of `render`."""
    command.set_defaults(run=_render)
    command.description = "Film an episode of the run that `evaluate` does with the same seed, children and caregiver."
    command.add_argument("--task", default="supervise", help="name of the task")
    parsing.add_who(command, "expected-danger")
    parsing.add_episode(command)
    command.add_argument("--seconds", type=float, default=30.0, help="length of the film at most")
    command.add_argument(
        "--overlay",
        choices=OVERLAYS,
        help="drawn on the floor: where the caregiver predicts the child soon, and what may hurt it",
    )
    command.add_argument("--out", required=True, metavar="FILE.mp4", help="film to write")
    command.add_argument("--still", metavar="FILE.png", help="picture to write of a telling moment")


def add_view(command: argparse.ArgumentParser) -> None:
    """Add the options of `view`."""
    command.set_defaults(run=_view)
    command.description = (
        "Show an episode of the run that `evaluate` does with the same seed, children and caregiver: in a window of "
        "MuJoCo's, or in a browser. Ctrl-C ends it."
    )
    parsing.add_who(command, "foresight")
    parsing.add_episode(command)
    command.add_argument("--speed", type=float, default=1.0, help="simulated seconds a second")
    command.add_argument("--paused", action="store_true", help="begin paused")
    command.add_argument("--web", action="store_true", help="show it in a browser (needs the extra `web`)")
    command.add_argument("--host", default="127.0.0.1", metavar="ADDRESS", help="address to serve it at")
    command.add_argument("--port", type=int, default=8080, help="port to serve it at, 0 for any that is free")
    command.add_argument("--rate", type=float, default=20.0, metavar="N", help="updates of the page a second")
    command.add_argument(
        "--plain", action="store_true", help="no shadows in the browser: quicker without a graphics card"
    )


def _render(arguments: argparse.Namespace) -> None:
    plan, family = parsing.read_house(arguments), parsing.read_family(arguments.epsilon, arguments)
    find_caregiver(arguments.caregiver)
    if arguments.seed < 0 or arguments.episode < 0:
        raise CaregiverError(f"seed and episode must be at least 0, got {arguments.seed} and {arguments.episode}")

    from caregiver_mj.viz import film  # here, for it takes seconds to import

    film.render_episode(
        arguments.out,
        task=arguments.task,
        house=plan,
        epsilon=family,
        seed=arguments.seed,
        episode=arguments.episode,
        seconds=arguments.seconds,
        caregiver=arguments.caregiver,
        embodiment=arguments.embodiment,
        sight=arguments.sight,
        overlay=arguments.overlay,
        still=arguments.still,
    )
    print(arguments.out)


def _view(arguments: argparse.Namespace) -> None:
    family = parsing.read_family(arguments.epsilon, arguments)
    find_caregiver(arguments.caregiver)
    damage = DamageWeights.of(arguments.damage)
    if not 0.1 <= arguments.rate <= 120:
        raise CaregiverError(f"rate must be in 0.1 to 120, got {arguments.rate}")
    if not 0 <= arguments.port <= 65535:
        raise CaregiverError(f"port must be in 0 to 65535, got {arguments.port}")
    # In a window only where there can be one.
    on_linux = sys.platform.startswith("linux")
    if on_linux and not (arguments.web or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise RenderingError("no display for a window: use `caregiver-mj view --web` and a browser")

    from caregiver_mj.viz.episode import Watched  # here, for these take seconds to import
    from caregiver_mj.viz.viewers.session import Session

    watched = Watched(
        arguments.house,
        family,
        arguments.caregiver,
        arguments.seed,
        arguments.episode,
        damage,
        arguments.embodiment,
        arguments.sight,
    )
    start = functools.partial(Session, watched, speed=arguments.speed, playing=not arguments.paused)
    viewer: WebViewer | Window
    if arguments.web:
        from caregiver_mj.viz.viewers.web import WebViewer, check_address

        check_address(arguments.host, arguments.port)  # before the house is made, which takes longer
        viewer = WebViewer(start(), arguments.host, arguments.port, arguments.rate, plain=arguments.plain)
        print(f"{viewer.url}   (Ctrl-C ends it)", flush=True)
    else:
        from caregiver_mj.viz.viewers.window import Window

        viewer = Window(start())
    try:  # until somebody closes or interrupts it: that is how one ends it, and no failure
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

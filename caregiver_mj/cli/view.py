"""`caregiver-mj render` and `view`: film an episode in the physical house, or show it while it runs."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import os
import pathlib
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from caregiver_mj.caregivers.registry import PLAYERS, find_caregiver
from caregiver_mj.cli import parsing
from caregiver_mj.cli.runs import output, print_table
from caregiver_mj.errors import CaregiverError, RenderingError
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.run_folder import RunFolder
from caregiver_mj.experiments.runner import run_block
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.outside import plain
from caregiver_mj.tasks import TASKS
from caregiver_mj.viz import AUTO, CAMERAS, OVERLAYS

if TYPE_CHECKING:
    from caregiver_mj.experiments.spec import EpisodeSpec
    from caregiver_mj.viz.episode import Episode
    from caregiver_mj.viz.viewers.web import WebViewer
    from caregiver_mj.viz.viewers.window import Window

_PLAYERS = " or ".join(PLAYERS)
_SEED = "seed of the run that the episode belongs to"


def add_render(command: argparse.ArgumentParser) -> None:
    """Add the options of `render`."""
    command.set_defaults(run=_render)
    command.description = (
        "Film an episode of the run that `evaluate` does with the same seed, children and caregiver; or replay one of "
        "a finished run, without its caregiver."
    )
    command.add_argument("--task", default="supervise", help=f"the task: {', '.join(TASKS)}")
    parsing.add(command, *parsing.WHERE, "--caregiver", "--embodiment")
    parsing.add(command, "--seed", help=_SEED)
    best = f"number of the episode in that run, or {parsing.BEST}: where --caregiver prevented most damage in --answers"
    parsing.add(command, "--episode", type=parsing.number_or_best, help=best)
    parsing.add(command, "--sight", *parsing.QUERIES)
    parsing.add(command, "--answers", help="run in the house, to film what --caregiver did in it")
    parsing.add(command, "--trust")
    command.add_argument("--seconds", type=float, default=30.0, help="greatest length of the film")
    drawn = "drawn on the floor: the predicted places of the child, and the hazards to it"
    command.add_argument("--overlay", choices=OVERLAYS, help=drawn)
    large = f"the large view: {AUTO} (default), the house and a close shot of what happens, or {', '.join(CAMERAS)}"
    command.add_argument("--camera", default=AUTO, metavar="NAME", help=large)
    command.add_argument("--out", required=True, metavar="FILE", help="film to write: .mp4, .gif or .webp")
    command.add_argument("--still", metavar="FILE.png", help="image of a decisive moment to write")


def add_view(command: argparse.ArgumentParser) -> None:
    """Add the options of `view`."""
    command.set_defaults(run=_view)
    command.description = (
        "Show an episode of the run that `evaluate` does with the same seed, children and caregiver: in a window of "
        "MuJoCo's, or in a browser. Ctrl-C ends it."
    )
    who = f"{_PLAYERS}, controlled by keys, or {parsing.ONE_CAREGIVER}"
    parsing.add(command, *parsing.WHERE)
    parsing.add(command, "--caregiver", help=who)
    parsing.add(command, "--embodiment")
    parsing.add(command, "--seed", help=_SEED)
    parsing.add(command, "--episode", "--sight", *parsing.QUERIES)
    command.add_argument("--out", metavar="DIR", help=f"folder of a run, to keep the episodes of a {_PLAYERS}")
    command.add_argument("--speed", type=float, default=1.0, help="simulated seconds per second")
    command.add_argument("--paused", action="store_true", help="begin paused")
    command.add_argument("--web", action="store_true", help="show it in a browser (needs the extra `web`)")
    command.add_argument("--host", default="127.0.0.1", metavar="ADDRESS", help="address to serve it at")
    command.add_argument("--port", type=int, default=8080, help="port to serve it at, 0 for any free one")
    command.add_argument("--rate", type=float, default=20.0, metavar="N", help="updates of the page per second")
    shadows = "no shadows in the browser: faster without a graphics card"
    command.add_argument("--plain", action="store_true", help=shadows)


def _render(arguments: argparse.Namespace) -> None:
    is_best = arguments.episode == parsing.BEST
    if is_best and arguments.answers is None:
        raise CaregiverError(f"--answers must be a finished run in the house for --episode {parsing.BEST}, got none")
    spec, answers = parsing.read_episode(arguments)
    number = spec.episode or 0
    if answers and not 0 <= number < len(answers):
        raise CaregiverError(f"episode must be from 0 to {len(answers) - 1}, as --answers has them, got {number}")

    from caregiver_mj.viz import film  # takes seconds to import

    film.render_episode(
        arguments.out,
        spec,
        seconds=arguments.seconds,
        start=None if is_best else 0.0,
        picture=film.Picture(camera=arguments.camera),
        overlay=arguments.overlay,
        still=arguments.still,
        answers=answers[number] if answers else "",
    )
    print(arguments.out)


def _view(arguments: argparse.Namespace) -> None:
    spec = parsing.read_spec(arguments)
    find_caregiver(spec.caregiver, queries=spec.queries)
    who = spec.caregiver
    if who in PLAYERS and arguments.sight != "all":
        raise CaregiverError(f"sight must be all with a {who}, who sees the whole house, got {arguments.sight}")
    if arguments.out is not None and (who not in PLAYERS or arguments.episode):
        raise CaregiverError(f"--out requires --caregiver {_PLAYERS}, without --episode: it keeps the next one")
    if not 0.1 <= arguments.rate <= 120:
        raise CaregiverError(f"rate must be in 0.1 to 120, got {arguments.rate}")
    if not 0 <= arguments.port <= 65535:
        raise CaregiverError(f"port must be in 0 to 65535, got {arguments.port}")
    # A window needs a display.
    on_linux = sys.platform.startswith("linux")
    if on_linux and not (arguments.web or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise RenderingError("no display for a window: use `caregiver-mj view --web` and a browser")

    from caregiver_mj.viz.viewers import Session  # takes seconds to import

    keep = None
    if arguments.out is not None:
        spec, keep = _next_of_run(arguments.out, spec)

    def start() -> Session:
        where = "for a browser" if arguments.web else "for a window"
        message = f"preparing house {spec.house}, children {spec.family}, caregiver {who}, {where} ..."
        print(plain(message), file=sys.stderr, flush=True)  # a planner may take half a minute
        return Session(spec, speed=arguments.speed, playing=not arguments.paused, ended=keep)

    viewer: WebViewer | Window
    if arguments.web:
        from caregiver_mj.viz.viewers.web import WebViewer, check_address

        check_address(arguments.host, arguments.port)  # before building the house, which is slow
        viewer = WebViewer(start(), arguments.host, arguments.port, arguments.rate, plain=arguments.plain)
        print(f"{viewer.url}   (Ctrl-C ends it)", flush=True)
    else:
        from caregiver_mj.viz.viewers.window import Window

        viewer = Window(start())
    try:  # closing and Ctrl-C are the regular ends
        viewer.run()
    except KeyboardInterrupt:
        print("closed", file=sys.stderr)
    finally:
        with _deaf():
            viewer.close()


def _next_of_run(out: str, played: EpisodeSpec) -> tuple[EpisodeSpec, Callable[[EpisodeSpec, Episode], None]]:
    """Return the next episode of a run in a folder, and a function that stores it there when it is over.

    The run has the settings of the played episode, with `none` and the player as caregivers.
    """
    who, number = played.caregiver, len([*pathlib.Path(out, "episodes").glob(f"{played.caregiver}_*.json")])

    def run(episodes: int) -> Settings:
        return Settings.around(played, ("none", who), episodes)

    RunFolder(out, run(max(1, number)).record(), resume=True)  # raises now rather than at the end

    def keep(over: EpisodeSpec, episode: Episode) -> None:
        nonlocal number
        if over != dataclasses.replace(played, episode=number):
            print(f"not kept: the next one of '{out}' is episode {number}", file=sys.stderr)
            return
        print(f"keeping episode {number} ...", file=sys.stderr)
        settings = run(number := number + 1)
        *_, block = settings.blocks()
        result = run_block(settings, block, episode.answers())  # as `verify` does
        folder = RunFolder(out, settings.record(), resume=True)
        folder.write(str(block), result)
        print_table(evaluate(settings, folder).summary, output(aside=True))

    return dataclasses.replace(played, episode=number), keep


@contextlib.contextmanager
def _deaf() -> Iterator[None]:
    """Ignore SIGTERM in this context, because the program is ending."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)

"""The command `caregiver-mj`.

Exit status: 0 for success, 2 for bad input (with one line that names the problem), 1 for any other failure.
"""

from __future__ import annotations

import argparse
import contextlib
import errno
import importlib.metadata
import io
import os
import signal
import sys
import textwrap
import threading
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

from caregiver_mj.errors import CaregiverError, FloorPlanError, RenderingError
from caregiver_mj.outside import plain, visible
from caregiver_mj.registry import modules_of_the_folder

if TYPE_CHECKING:
    from _typeshed import SupportsWrite

PROGRAM = "caregiver-mj"
_READERS = ("report", "compare", "pool", "submit", "verify", "leaderboard")  # commands that read finished runs
_LONGEST_FAILURE = 20_000  # characters of a message, such as a worker's traceback
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)  # errors of writing to standard output

# Module and description of each command. The module's function `add_<command>` adds the options. Only the module of
# the given command is imported, because that takes up to a second.
_COMMANDS = {
    "evaluate": ("evaluate", "run caregivers with children and print the table"),
    "paper": ("evaluate", "print the paper's Tables I and II beside ours, in half a minute"),
    "render": ("view", "film an episode in the physical house"),
    "view": ("view", "watch an episode in the physical house while it runs"),
    "report": ("runs", "write a page about finished runs: tables, figures, maps, film"),
    "compare": ("runs", "compare two finished runs of one world, episode by episode: the second less the first"),
    "pool": ("runs", "combine finished runs that differ in their seed only"),
    "submit": ("runs", "pack a finished run, with its caregivers' answers, into a file that others can verify"),
    "verify": ("runs", "reproduce every row of such a file by replaying its caregivers' answers"),
    "leaderboard": ("runs", "verify all files of a folder, and print a table for each track in Markdown"),
    "record": ("record", "write episodes as a data set for learning"),
    "house": ("house", "show, check or make a floor plan, or export its scene"),
    "list": ("listing", "print available names: caregivers, children, houses, robots, tasks, sets of houses"),
    "completion": ("listing", "print a completion script for the shell"),
}


class HelpFormatter(argparse.HelpFormatter):
    """Appends each option's default, as typed on the command line."""

    def _get_help_string(self, action: argparse.Action) -> str | None:
        default = action.default
        typed = " ".join(map(str, default)) if isinstance(default, list | tuple) else str(default)
        if not action.option_strings or default is None or default is False or typed in ("", argparse.SUPPRESS):
            return action.help
        return f"{action.help} (default: {typed})"


class Parser(argparse.ArgumentParser):
    """A parser that raises CaregiverError with one line."""

    def __init__(self, **options: Any):
        # Without abbreviations, because --see would be --seed.
        defaults: dict[str, Any] = {"formatter_class": HelpFormatter, "allow_abbrev": False}
        super().__init__(**defaults | options)

    def error(self, message: str) -> NoReturn:
        command = self.prog.removeprefix(PROGRAM).strip()
        raise CaregiverError(f"{command}: {message}" if command else message)

    def exit(self, status: int = 0, message: str | None = None) -> NoReturn:
        """Exit after writing the help or the version."""
        if sys.stdout is not None:  # None if closed
            sys.stdout.flush()
        super().exit(status, message)

    def _print_message(self, message: str, file: SupportsWrite[str] | None = None) -> None:
        """Write a message, without argparse's suppression of errors."""
        if (stream := file or sys.stderr) is not None:
            stream.write(message)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command, with the arguments of the process by default, and return the exit status."""
    argv = list(sys.argv[1:] if argv is None else argv)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # for terminals without ±
    try:
        with _terminated_in_order():
            arguments = make_parser(argv).parse_args(argv)
            arguments.argv = argv
            if arguments.no_cache:
                os.environ["CAREGIVER_MJ_CACHE"] = ""  # for worker processes, too
            # Libraries could import modules from a folder with a stranger's run.
            reads = arguments.command in _READERS or getattr(arguments, "answers", None) is not None
            reads = reads and not getattr(arguments, "trust", False)
            with contextlib.nullcontext() if reads else modules_of_the_folder():
                arguments.run(arguments)
            if sys.stdout is not None:  # None if closed
                sys.stdout.flush()
    except CaregiverError as error:
        return fail(error, _status(error))
    except BrokenPipeError:  # the reader of the output ended, as `head` does
        _silence()
        return 1
    except OSError as error:
        if error.errno not in _FULL:
            raise
        _silence()
        return fail(f"the output cannot be written: {error.strerror}", 1)
    except KeyboardInterrupt as error:
        return fail(str(error) or "interrupted", 1)
    return 0


@contextlib.contextmanager
def _terminated_in_order() -> Iterator[None]:
    """Let SIGTERM end the command like Ctrl-C in this context, with clean-up and a message."""
    ours = threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    if ours:
        signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    finally:
        # After Ctrl-C during `exec`, as in a named tuple's creation, CPython ignores our exit status
        # (`_Py_UnhandledKeyboardInterrupt`). Running another text resets that flag.
        eval("0")
        if ours:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _terminate(_number: int, _frame: object) -> NoReturn:
    raise KeyboardInterrupt("terminated")


def _silence() -> None:
    """Redirect a failing standard output to the null device, because Python flushes it at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def make_parser(argv: Sequence[str] | None = None) -> Parser:
    """Return the parser of the command line, with the options of commands in `argv`, or of all by default."""
    parser = Parser(prog=PROGRAM, description="A robot caregiver, toddlers, and a house with stairs and candles.")
    version = importlib.metadata.version("caregiver_mj")
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {version}", help="print the version")
    text = "work out value tables anew instead of reading them from the user's cache folder"
    parser.add_argument("--no-cache", action="store_true", help=text)
    commands = parser.add_subparsers(title="commands", dest="command", metavar="COMMAND", required=True)
    for name, (module, text) in _COMMANDS.items():
        command = commands.add_parser(name, help=text, description=text)
        if argv is None or name in argv:
            getattr(importlib.import_module(f"caregiver_mj.cli.{module}"), f"add_{name}")(command)
    return parser


def _status(error: CaregiverError) -> int:
    """Return the exit status: 2 for bad input, 1 for other failures."""
    from caregiver_mj.experiments.run_folder import StorageError
    from caregiver_mj.experiments.workers import WorkerError

    return 1 if isinstance(error, RenderingError | StorageError | WorkerError) else 2


def fail(error: object, status: int = 2) -> int:
    """Print an error, with the line of a floor plan if it has one, to standard error; return the status."""
    # Bad input gives one line, even if a file name holds line breaks.
    message = plain(error) if status == 2 else visible(str(error)[:_LONGEST_FAILURE])
    print(f"{PROGRAM}: {message}", file=sys.stderr)
    if isinstance(error, FloorPlanError) and error.excerpts[0]:
        print(textwrap.indent(error.excerpts[0], "  "), file=sys.stderr)
    return status

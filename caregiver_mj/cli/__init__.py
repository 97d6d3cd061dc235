"""The command `caregiver-mj`.

Exit status: 0 done, 2 bad input (one line that says what and where), 1 anything else.
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
_READERS = ("report", "compare", "pool", "submit", "verify", "leaderboard")  # commands that only read what others ran
_LONGEST_FAILURE = 20_000  # characters of a message, such as a worker's traceback
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)  # when there is no writing to standard output

# Each command's module, whose `add_` function of that name adds its options, and what it does. Modules take up to a
# second to import: that of the command which is given alone is.
_COMMANDS = {
    "evaluate": ("evaluate", "run caregivers with children and print the table"),
    "paper": ("paper", "print the paper's Tables I and II beside ours, in half a minute"),
    "render": ("view", "film an episode in the physical house"),
    "view": ("view", "watch an episode in the physical house while it runs"),
    "report": ("runs", "write a page about finished runs: tables, figures, maps, film"),
    "compare": ("runs", "compare two finished runs of one world, episode by episode: the second less the first"),
    "pool": ("runs", "put finished runs together that differ in their seed alone"),
    "submit": ("runs", "pack a finished run, and what its caregivers answered, into one file that others can verify"),
    "verify": ("runs", "get every row of such a file back from its caregivers' answers, with no caregiver present"),
    "leaderboard": ("runs", "verify all files of a folder, and print a table for each track in Markdown"),
    "record": ("record", "write episodes as a data set to learn from"),
    "house": ("house", "look at a floor plan, make one, or export its scene"),
    "list": ("listing", "print what there is by name: caregivers, children, houses, robots, tasks, sets of houses"),
    "completion": ("completion", "print a completion script for the shell"),
}


class HelpFormatter(argparse.HelpFormatter):
    """Says each option's default as one would type it, where there is one to say."""

    def _get_help_string(self, action: argparse.Action) -> str | None:
        default = action.default
        typed = " ".join(map(str, default)) if isinstance(default, list | tuple) else str(default)
        if not action.option_strings or default is None or default is False or typed in ("", argparse.SUPPRESS):
            return action.help
        return f"{action.help} (default: {typed})"


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, like all others, also those of writing its help."""

    def __init__(self, **options: Any):
        super().__init__(**{"formatter_class": HelpFormatter} | options)

    def error(self, message: str) -> NoReturn:
        command = self.prog.removeprefix(PROGRAM).strip()
        raise CaregiverError(f"{command}: {message}" if command else message)

    def exit(self, status: int = 0, message: str | None = None) -> NoReturn:
        """End once the help, or the version, has been written."""
        if sys.stdout is not None:  # as it is if it was closed
            sys.stdout.flush()
        super().exit(status, message)

    def _print_message(self, message: str, file: SupportsWrite[str] | None = None) -> None:
        """Write it, as the one of argparse does, which has nothing to say where that fails."""
        if (stream := file or sys.stderr) is not None:
            stream.write(message)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command, with the arguments of the process by default, and return the exit status."""
    argv = list(sys.argv[1:] if argv is None else argv)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal that knows no ± shall show the rest
    try:
        with _terminated_in_order():
            arguments = make_parser(argv).parse_args(argv)
            arguments.argv = argv
            # A folder with a stranger's run may have modules that libraries would import if they found them.
            reads = arguments.command in _READERS and not getattr(arguments, "trust", False)
            with contextlib.nullcontext() if reads else modules_of_the_folder():
                arguments.run(arguments)
            if sys.stdout is not None:  # as it is if it was closed
                sys.stdout.flush()
    except CaregiverError as error:
        return fail(error, _status(error))
    except BrokenPipeError:  # the reader of our output has gone, as `head` does
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
    """Have SIGTERM end the command as Ctrl-C does, in order and with a word, where it would end it without."""
    ours = threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    if ours:
        signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    finally:
        # If Ctrl-C came while Python ran source text, as for a named tuple, it would end as interrupted whatever our
        # status (CPython's `_Py_UnhandledKeyboardInterrupt`); running another text makes it forget that.
        eval("0")
        if ours:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _terminate(_number: int, _frame: object) -> NoReturn:
    raise KeyboardInterrupt("terminated")


def _silence() -> None:
    """Make of standard output, which fails, one that does not, for Python writes what is left of it at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def make_parser(argv: Sequence[str] | None = None) -> Parser:
    """Return the parser of the whole command line; of commands that the arguments do not name, the names alone."""
    parser = Parser(prog=PROGRAM, description="A robot caregiver, toddlers, and a house with stairs and candles.")
    version = importlib.metadata.version("caregiver_mj")
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {version}", help="print the version")
    commands = parser.add_subparsers(title="commands", dest="command", metavar="COMMAND", required=True)
    for name, (module, text) in _COMMANDS.items():
        command = commands.add_parser(name, help=text, description=text)
        if argv is None or name in argv:
            getattr(importlib.import_module(f"caregiver_mj.cli.{module}"), f"add_{name}")(command)
    return parser


def _status(error: CaregiverError) -> int:
    """The exit status: 2 where the input is bad, 1 where something else went wrong."""
    from caregiver_mj.experiments.run_folder import StorageError
    from caregiver_mj.experiments.workers import WorkerError

    return 1 if isinstance(error, RenderingError | StorageError | WorkerError) else 2


def fail(error: object, status: int = 2) -> int:
    """Say on standard error what is wrong, with the line of the floor plan where it is there; return the status."""
    # Bad input gives one line, even if a file name holds line breaks.
    message = plain(error) if status == 2 else visible(str(error)[:_LONGEST_FAILURE])
    print(f"{PROGRAM}: {message}", file=sys.stderr)
    if isinstance(error, FloorPlanError) and error.excerpts[0]:
        print(textwrap.indent(error.excerpts[0], "  "), file=sys.stderr)
    return status

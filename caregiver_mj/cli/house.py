"""`caregiver-mj house`: show, check and make floor plans, and export their scenes."""

from __future__ import annotations

import argparse

import rich.console
import rich.text

from caregiver_mj.cli import fail, parsing
from caregiver_mj.errors import CaregiverError, FloorPlanError
from caregiver_mj.plans.cell_graph import BIN, FREE, LEGEND, WALL
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.generator import generate, generate_shape
from caregiver_mj.plans.hazards import KINDS
from caregiver_mj.plans.rooms import SHAPES
from caregiver_mj.robot.embodiments import EMBODIMENTS, find_embodiment

# Style of each kind of cell in `house show`.
_STYLES = {WALL: "white on grey30", FREE: "grey50", BIN: "bold white on green4"} | {
    kind.symbol: f"bold black on rgb({','.join(map(str, kind.colour))})" for kind in KINDS
}

_COUNTS = {  # options of `house make`
    "rooms": "number of rooms, a corridor included",
    "stairwells": "number of stairwells",
    "candles": "number of tables with a candle",
    "tables": "number of bare tables",
    "bins": "number of toy bins",
    "gates": "number of further stairwells, with an open gate",
    "mugs": "number of further tables, with a mug",
    "batteries": "number of small objects on the floor",
}
_MOST_PROBLEMS = 20  # problems of a file that `house check` prints


def add_house(house: argparse.ArgumentParser) -> None:
    """Add the commands of `house`, and their options."""
    plans = house.add_subparsers(metavar="show|check|make|export", required=True)
    for name, run, text in (
        ("show", _show, "print a floor plan in colour, with its objects counted"),
        ("check", _check, "say whether a floor plan is valid"),
    ):
        command = plans.add_parser(name, help=text, description=text)
        command.set_defaults(run=run)
        command.add_argument("house", metavar="NAME|FILE", help=parsing.houses())
    text = "make a house and print its floor plan; other options are drawn from the seed"
    command = plans.add_parser("make", help=text, description=text)
    command.set_defaults(run=_make)
    parsing.add(command, "--seed")
    command.add_argument("--shape", metavar="NAME", help=f"house of a special shape: {', '.join(SHAPES)}")
    command.add_argument("--home", action="store_true", help="draw gates, mugs and batteries, too")
    command.add_argument("--size", metavar="WxH", help="columns and rows, outer walls included")
    for name, what in _COUNTS.items():
        command.add_argument(f"--{name}", type=int, metavar=name[0].upper(), help=what)
    command.add_argument("--out", metavar="FILE", help="new file to write it to")
    text = "write the scene of a house, with a child, as a file that MuJoCo loads without this package"
    command = plans.add_parser("export", help=text, description=f"{text[0].upper()}{text[1:]}.")
    command.set_defaults(run=_export)
    command.add_argument("house", metavar="NAME|FILE", help=parsing.houses())
    command.add_argument(
        "--out",
        required=True,
        metavar="FILE",
        help="new file: .xml, with images of the floors beside it, or .mjb, for this version of MuJoCo only",
    )
    command.add_argument("--robot", metavar="NAME", help=f"robot in it: {', '.join(EMBODIMENTS)}, or module:object")


def _show(arguments: argparse.Namespace) -> None:
    plan = FloorPlan.load(arguments.house)
    text = rich.text.Text()
    for row in plan.rows:
        for kind in row:
            text.append(f"{kind} ", _STYLES[kind])  # two characters are about as wide as high
        text.append("\n")
    for kind, count in _counts(plan).items():
        text.append(f"\n{kind} ", _STYLES[kind])
        text.append(f" {count}")
    height, width = plan.shape
    size = f"{width * plan.cell_size:g} m x {height * plan.cell_size:g} m, {plan.cell_size:g} m a cell"
    console = rich.console.Console()
    console.print(f"{plan.name}: {width} x {height} cells, {size}\n", highlight=False, markup=False)
    console.print(text, soft_wrap=True)


def _check(arguments: argparse.Namespace) -> None:
    try:
        plan = FloorPlan.load(arguments.house)
    except FloorPlanError as error:
        found = [
            FloorPlanError(problem, excerpts=[excerpt])
            for problem, excerpt in zip(error.problems, error.excerpts, strict=True)
        ]
        if more := len(found[_MOST_PROBLEMS:]):
            found[_MOST_PROBLEMS:] = [FloorPlanError(f"and {more:,} more")]
        for one in found[:-1]:
            fail(one)
        raise found[-1] from None
    print(f"OK: {plan.name}, {describe(plan)}")
    parsing.warn_of_no_room(plan)


def describe(plan: FloorPlan) -> str:
    """Return the size and contents of a house as text."""
    height, width = plan.shape
    counts = ", ".join(count for kind, count in _counts(plan).items() if kind != WALL and plan.cells_of(kind))
    return f"{width} x {height} cells, {counts}"


def _counts(plan: FloorPlan) -> dict[str, str]:
    numbers = {kind: len(plan.cells_of(kind)) for kind in LEGEND}
    return {kind: f"{number} {LEGEND[kind][number != 1]}" for kind, number in numbers.items()}


def _make(arguments: argparse.Namespace) -> None:
    if arguments.shape is not None:
        for name in ("home", "size", *_COUNTS):
            if getattr(arguments, name) not in (None, False):
                raise CaregiverError(f"house make: --shape must be without --{name}: a shape has its own")
    size = None if arguments.size is None else parsing.read_size(arguments.size, "house make: --size", "14x12")
    counts = {name: getattr(arguments, name) for name in _COUNTS}
    if arguments.shape is None:
        plan = generate(arguments.seed, size, **counts, home=arguments.home)
    else:
        plan = generate_shape(arguments.shape, arguments.seed)
    if arguments.out is None:
        print(plan.text)
        return
    try:
        with open(arguments.out, "x", encoding="utf-8") as file:
            file.write(f"{plan.text}\n")
    except FileExistsError:
        raise CaregiverError(f"house make: --out must be a new file, got '{arguments.out}', which exists") from None
    except OSError as error:
        raise CaregiverError(f"house make: '{arguments.out}' cannot be written: {error.strerror}") from None
    print(arguments.out)


def _export(arguments: argparse.Namespace) -> None:
    plan = FloorPlan.load(arguments.house)
    robot = None if arguments.robot is None else find_embodiment(arguments.robot)
    if robot is not None:
        parsing.warn_of_no_room(plan)

    from caregiver_mj.house.export import export_house  # takes seconds to import

    for file in export_house(plan, arguments.out, robot):
        print(file)

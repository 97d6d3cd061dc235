"""Draws docs/rooms.svg: which room of the package imports from which, as the code stands."""

from __future__ import annotations

import pathlib
import sys
import tempfile
import tomllib

import grimp
import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

ROOT = pathlib.Path(__file__).parents[1]
PICTURE = ROOT / "docs" / "rooms.svg"
_PACKAGE = "caregiver_mj"
_WIDTH, _HEIGHT = 2.3, 0.62  # of a room's box, in units of the drawing
_ACROSS, _DOWN = 3.0, 1.0  # between the middles of rooms


def layers() -> list[list[str]]:
    """The rooms from the top down, those beside each other together; held by import-linter."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (contract, *_) = project["tool"]["importlinter"]["contracts"]
    return [[room.strip() for room in layer.split("|")] for layer in contract["layers"]]


def assemble(folder: pathlib.Path) -> None:
    """Puts the package together in a folder as it is installed, with tasks and models inside."""
    package = folder / _PACKAGE
    package.mkdir()
    for path in (*(ROOT / _PACKAGE).iterdir(), ROOT / "tasks", ROOT / "models"):
        (package / path.name).symlink_to(path)


def graph() -> grimp.ImportGraph:
    """Who imports whom; imports for type checkers alone do not count."""
    with tempfile.TemporaryDirectory() as folder:
        assemble(pathlib.Path(folder))
        sys.path.insert(0, folder)
        known = {name: sys.modules.pop(name) for name in list(sys.modules) if name.split(".")[0] == _PACKAGE}
        try:
            return grimp.build_graph(
                _PACKAGE, include_external_packages=True, exclude_type_checking_imports=True, cache_dir=None
            )
        finally:
            sys.path.remove(folder)
            sys.modules.update(known)


def arrows(imports: grimp.ImportGraph) -> set[tuple[str, str]]:
    """Which room imports from which, directly; and of those, the ones that no longer way shows already."""
    rooms = {room for layer in layers() for room in layer}
    direct = {room: set() for room in rooms}
    for module in imports.modules:
        if (room := _room(module)) in rooms:
            found = {_room(other) for other in imports.find_modules_directly_imported_by(module)}
            direct[room] |= (found & rooms) - {room}

    def reached(room: str, by: set[str]) -> bool:
        return any(room in direct[other] or reached(room, direct[other]) for other in by)

    return {(a, b) for a, others in direct.items() for b in others if not reached(b, others - {b})}


def _room(module: str) -> str:
    package, _, rest = module.partition(".")
    return rest.split(".")[0] if package == _PACKAGE else ""


def describe(found: set[tuple[str, str]]) -> str:
    """The arrows in words, which stand in the picture's description."""
    return "; ".join(f"{a} > {b}" for a, b in sorted(found))


def draw(found: set[tuple[str, str]]) -> Figure:
    """Draws rooms and arrows."""
    rows = layers()
    place = {}
    for i, row in enumerate(rows):
        for j, room in enumerate(row):
            place[room] = (j - (len(row) - 1) / 2) * _ACROSS, -i * _DOWN
    figure = Figure(figsize=(7.5, 0.62 * len(rows)), layout="constrained")
    axes = figure.add_subplot(aspect="equal", xlim=(-5, 5), ylim=(-len(rows) * _DOWN + 0.4, 0.6))
    axes.axis("off")
    for (a, b), curve in ((arrow, _curve(place, *arrow)) for arrow in sorted(found)):
        axes.add_patch(
            FancyArrowPatch(
                place[a],
                place[b],
                connectionstyle=f"arc3,rad={curve}",
                arrowstyle="-|>",
                mutation_scale=11,
                color="#8a94a6",
                linewidth=1.1,
                shrinkA=14,
                shrinkB=14,
            )
        )
    for room, (x, y) in place.items():
        box = FancyBboxPatch(
            (x - _WIDTH / 2, y - _HEIGHT / 2), _WIDTH, _HEIGHT, boxstyle="round,pad=0,rounding_size=.15",
            facecolor="#e8f1f8", edgecolor="#30638e", linewidth=1.2, zorder=3,
        )  # fmt: skip
        axes.add_patch(box)
        axes.text(x, y, room, ha="center", va="center", fontsize=10, zorder=4)
    return figure


def _curve(place: dict[str, tuple[float, float]], a: str, b: str) -> float:
    """How much an arrow bends, so that it does not run through the rooms in between."""
    (x, y), (u, v) = place[a], place[b]
    straight = y - v <= 1.5 * _DOWN or x != u
    return 0.0 if straight else 0.45 * (-1 if (ord(a[0]) + ord(b[0])) % 2 else 1)


def main() -> None:
    """Draws the picture."""
    found = arrows(graph())
    PICTURE.parent.mkdir(exist_ok=True)
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "rooms"}):
        draw(found).savefig(PICTURE, metadata={"Date": None, "Description": describe(found)})
    print(PICTURE.relative_to(ROOT))


if __name__ == "__main__":
    main()

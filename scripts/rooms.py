"""Draw docs/rooms.svg, the imports between rooms of the package; or, with --sizes, print the size of its parts."""

from __future__ import annotations

import argparse
import pathlib
import sys
import tempfile
import tomllib

import grimp
import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch
from scipy.sparse import csgraph

ROOT = pathlib.Path(__file__).parents[1]
PICTURE = ROOT / "docs" / "rooms.svg"
_PACKAGE = "caregiver_mj"
_PARTS = {  # files counted together
    "wheel": (_PACKAGE, "tasks", "models"),
    "studies": ("scripts/study.py", "scripts/studies"),
    "tests": ("tests",),
}
_WIDTH, _HEIGHT = 2.3, 0.62  # of a room's box, in units of the drawing
_DOWN = 1.05  # distance between the middles of layers
_ACROSS = {  # place of each room in its layer, such that no arrow crosses another room
    "cli": 1.6, "viz": 0.0, "experiments": 0.0, "envs": 3.0, "policy": -3.6, "tasks": -0.6,
    "house": -2.0, "grid": 2.6, "caregivers": 3.2, "interventions": 4.6, "recording": -2.0, "robot": 1.5,
    "children": -1.9, "danger": -4.0, "plans": 1.4, "registry": -3.4, "outside": 3.6, "errors": 0.6,
}  # fmt: skip


def layers() -> list[list[str]]:
    """Return the layers of rooms from the top down, from import-linter's contract."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (contract, *_) = project["tool"]["importlinter"]["contracts"]
    return [[room.strip() for room in layer.split("|")] for layer in contract["layers"]]


def assemble(folder: pathlib.Path) -> None:
    """Assemble the package in a folder as installed, with tasks and models inside."""
    package = folder / _PACKAGE
    package.mkdir()
    for path in (*(ROOT / _PACKAGE).iterdir(), ROOT / "tasks", ROOT / "models"):
        (package / path.name).symlink_to(path)


def graph(folder: pathlib.Path | None = None) -> grimp.ImportGraph:
    """Return the imports between modules, also for types and within functions, of an assembled package."""
    if folder is None:
        with tempfile.TemporaryDirectory() as own:
            assemble(pathlib.Path(own))
            return graph(pathlib.Path(own))
    sys.path.insert(0, str(folder))
    known = {name: sys.modules.pop(name) for name in list(sys.modules) if name.split(".")[0] == _PACKAGE}
    try:
        return grimp.build_graph(_PACKAGE, include_external_packages=True, cache_dir=None)
    finally:
        sys.path.remove(str(folder))
        sys.modules.update(known)


def circles(imports: grimp.ImportGraph) -> list[list[str]]:
    """Return the cycles of modules that import each other, directly or indirectly."""
    modules = sorted(name for name in imports.modules if name.split(".")[0] == _PACKAGE)
    number = {name: i for i, name in enumerate(modules)}
    edges = np.zeros((len(modules), len(modules)), bool)
    for name, i in number.items():
        edges[i, [number[other] for other in imports.find_modules_directly_imported_by(name) if other in number]] = True
    count, part = csgraph.connected_components(edges, connection="strong")
    found = ([name for name, i in number.items() if part[i] == one] for one in range(count))
    return [names for names in found if len(names) > 1]


def arrows(imports: grimp.ImportGraph) -> set[tuple[str, str]]:
    """Return the direct imports between rooms that no longer path implies."""
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
    """Return the arrows as text, for the picture's description."""
    return "; ".join(f"{a} > {b}" for a, b in sorted(found))


def draw(found: set[tuple[str, str]]) -> Figure:
    """Draw rooms and arrows."""
    rows = layers()
    place = {room: (_ACROSS[room], -i * _DOWN) for i, row in enumerate(rows) for room in row}
    figure = Figure(figsize=(7.5, 0.56 * len(rows)), layout="constrained")
    axes = figure.add_subplot(aspect="equal", xlim=(-5.6, 6.0), ylim=(-len(rows) * _DOWN + 0.5, 0.5))
    axes.axis("off")
    boxes = {}
    for room, (x, y) in place.items():
        boxes[room] = FancyBboxPatch(
            (x - _WIDTH / 2, y - _HEIGHT / 2), _WIDTH, _HEIGHT, boxstyle="round,pad=0,rounding_size=.15",
            facecolor="#e8f1f8", edgecolor="#30638e", linewidth=1.2, zorder=3,
        )  # fmt: skip
        axes.add_patch(boxes[room])
        axes.text(x, y, room, ha="center", va="center", fontsize=10, zorder=4)
    for a, b in sorted(found):
        style = {"arrowstyle": "-|>", "mutation_scale": 11, "color": "#8a94a6", "linewidth": 1.1}
        axes.add_patch(FancyArrowPatch(place[a], place[b], patchA=boxes[a], patchB=boxes[b], **style))
    return figure


def sizes() -> dict[str, tuple[int, int]]:
    """Return the lines and modules of each part; studies include the lines of their pages."""
    found = {}
    for part, roots in _PARTS.items():
        files = [f for root in roots for f in (ROOT / root, *(ROOT / root).rglob("*")) if f.suffix in (".py", ".md")]
        texts = {f: f.read_text(encoding="utf-8") for f in files if f.suffix == ".py" or part == "studies"}
        lines = sum(text.count("\n") for text in texts.values())
        found[part] = lines, sum(f.suffix == ".py" for f in texts)
    return found


def main() -> None:
    """Draw the picture, or print the sizes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", action="store_true", help="print lines and modules instead")
    if parser.parse_args().sizes:
        for part, (lines, modules) in sizes().items():
            print(f"{part}: {lines} lines, {modules} modules")
        return
    found = arrows(graph())
    PICTURE.parent.mkdir(exist_ok=True)
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "rooms"}):
        draw(found).savefig(PICTURE, metadata={"Date": None, "Description": describe(found)})
    print(PICTURE.relative_to(ROOT))


if __name__ == "__main__":
    main()

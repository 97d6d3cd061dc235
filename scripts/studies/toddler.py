"""How `toddler` walks beside what was measured of toddlers: bouts, distance, where bouts end, dwell at a toy, paths.

Toddlers alone in the grid, in houses that nothing was tested on. A bout is a stretch of moves without a rest in
between; sources are in `caregiver_mj/children/toddler.py` and in the table.
"""

from __future__ import annotations

import argparse
import itertools

import numpy as np

from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.children.toddler import STEP_LENGTH, bout_steps
from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.experiments.spec import episode_streams
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.cell_graph import ACTIONS, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.plans.sets import houses_named
from study import Parser, fill_in, table

_DRAWS = (np.arange(100_000) + 0.5) / 100_000
_LEAST = 3  # moves of a bout whose shape is asked for


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("houses", ["train-20"], "houses, or sets of them")
    parser.add("episodes", 100, "of each toddler in each house")
    parser.add("epsilons", [0.5, 0.75, 0.95], "shares of bouts without a goal")
    parser.add_file("docs", "write it into the guide's page there", "DIR")


def run(options: argparse.Namespace) -> None:
    """Watch the toddlers; print the table, and write it into the guide."""
    plans = houses_named(options.houses)
    found = {
        epsilon: together([watch(plan, epsilon, options.episodes) for plan in plans]) for epsilon in options.epsilons
    }
    steps = bout_steps(_DRAWS)
    later = [float(np.mean(steps[steps > length] == length + 1)) for length in (3, 6, 12)]
    rows = [
        ("bouts of at most 3 steps", "50 % (13 months), 41 % (19 months)", [f"{np.mean(steps <= 3):.0%}"] * len(found)),
        ("a bout ends after step 4, 7, 13", "constant", [", ".join(f"{p:.0%}" for p in later)] * len(found)),
    ]
    for name, published, form in _ROWS:
        rows.append((name, published, [form.format(one[name]) for one in found.values()]))
    titles = "quantity", "published", *(f"epsilon {epsilon:g}" for epsilon in found)
    print(text := table(titles, [(name, published, *cells) for name, published, cells in rows]))
    if options.docs:
        fill_in(options.docs / "guide" / "children.md", "toddler", text)


_ROWS = (
    ("steps an hour", "2,368", "{:,.0f}"),
    ("metres an hour", "700", "{:.0f}"),
    ("bouts that end at a toy", "less than half", "{:.0%}"),
    ("bouts that end beside nothing", "most", "{:.0%}"),
    ("dwell at a toy, median, s", "9.8", "{:.1f}"),
    ("rest elsewhere, median, s", "", "{:.1f}"),
    ("bouts of 3 moves or more that are straight", "less than half", "{:.0%}"),
    ("moves that turn back within a bout", "", "{:.0%}"),
    ("speed while walking, m/s", "0.25 to 0.80", "{:.2f}"),
)


def watch(plan: FloorPlan, epsilon: float, episodes: int) -> dict[str, list[float]]:
    """Return what toddlers did in a house: observations by the name of their row."""
    world = GridWorld(plan, ChildGroup.parse(f"toddler:{epsilon:g}"), None)
    streams = [episode_streams(number, 1) for number in range(episodes)]
    world.reset(streams)
    _, target, _ = plan.graph.moves
    beside = np.array([not {*found} <= {Target.FREE, Target.WALL} for found in target.tolist()])
    actions, cells, toys, before = [], [], [], world.ledger.toys.copy()
    while not world.over:
        world.move_children()
        actions.append(world.previous_action[:, 0].copy())
        cells.append(world.child_cell[:, 0].copy())
        toys.append((world.ledger.toys - before)[:, 0] > 0)
        before = world.ledger.toys.copy()
    return measure(np.array(actions).T, np.array(cells).T, np.array(toys).T, beside, plan.cell_size)


def measure(
    actions: np.ndarray, cells: np.ndarray, toys: np.ndarray, beside: np.ndarray, cell_size: float
) -> dict[str, list[float]]:
    """Return the observations of episodes: move, cell and whether a toy was reached, (episodes, timesteps) each."""
    walks = actions != NOTHING
    metres = float(walks.mean()) * WALKING_SPEED * 3600
    found: dict[str, list[float]] = {name: [] for name, _, _ in _ROWS}
    found["steps an hour"], found["metres an hour"] = [metres / STEP_LENGTH], [metres]
    found["speed while walking, m/s"] = [WALKING_SPEED]
    timestep = cell_size / WALKING_SPEED
    for one, moves in enumerate(walks):
        edges = np.flatnonzero(np.diff(moves.astype(int))) + 1
        for begin, end in itertools.pairwise(edges):  # whole bouts and rests only
            at_toy = bool(toys[one, begin - 1]) if not moves[begin] else bool(toys[one, end - 1])
            if not moves[begin]:
                rest = "dwell at a toy, median, s" if at_toy else "rest elsewhere, median, s"
                found[rest].append((end - begin) * timestep)
                continue
            found["bouts that end at a toy"].append(at_toy)
            found["bouts that end beside nothing"].append(not beside[cells[one, end - 1]])
            way = np.array(ACTIONS)[actions[one, begin:end]]
            back = (way[1:] == -way[:-1]).all(axis=1)
            found["moves that turn back within a bout"] += back.tolist()
            if end - begin >= _LEAST:
                found["bouts of 3 moves or more that are straight"].append(bool((way == way[0]).all()))
    return found


def together(houses: list[dict[str, list[float]]]) -> dict[str, float]:
    """Return the number of each row: a median of times, else a mean."""
    values = {name: np.concatenate([house[name] for house in houses]) for name, _, _ in _ROWS}
    return {name: float(np.median(v) if "median" in name else np.mean(v)) for name, v in values.items()}

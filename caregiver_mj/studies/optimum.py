"""How far caregivers are from the best that anybody could do, in houses small enough to know that.

For tiny generated houses the decision process of the grid, told toy bin and epsilon, is solved exactly twice: for a
caregiver that is free in its motion, and for one with the interventions of ours (`caregiver_mj.studies.exact`). What is
to be least is the planner's own: discounted damage, and a price of denied moves. Beside these optima stands what
caregivers leave: the optimum where an episode begins, and all that their actions in it then forgo.
"""

from __future__ import annotations

import argparse
import dataclasses
import pathlib
from collections.abc import Sequence

import numpy as np
import pandas as pd

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.family import Family
from caregiver_mj.children.side_by_side import side_by_side
from caregiver_mj.children.tape import Tape
from caregiver_mj.experiments import two_level
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.studies.documents import fill_in, table
from caregiver_mj.studies.exact import Exact
from caregiver_mj.studies.trials import add_jobs, run_all

EPSILONS = (1.0, 0.5, 0.05)
CAREGIVERS = {
    "knows-goal": "planner, told bin and epsilon (`knows-goal`)",
    "foresight": "planner (`foresight`)",
    "paper": "rule (`paper`)",
}
SIZES = ("8x7", "9x6-rooms2", "8x7-rooms2", "10x5", "9x6")  # with 13 to 25 free cells
FIRST_SEED = 600_000
TIMESTEPS = 400  # of an episode; what comes later counts less than .3 %
NEAR = 1.05  # of the optimum


@dataclasses.dataclass(frozen=True)
class Job:
    """All episodes in one house."""

    house: str
    episodes: int


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--houses", type=int, default=50, metavar="N", help="how many (default: %(default)s)")
    parser.add_argument("--episodes", type=int, default=40, help="with each child (default: %(default)s)")
    add_jobs(parser)
    parser.add_argument("--docs", type=pathlib.Path, metavar="DIR", help="write it into the guide's page there")
    options = parser.parse_args(arguments)
    work = [Job(house, options.episodes) for house in houses(options.houses)]
    text = report(pd.concat(run_all(run, work, options.jobs, "houses"), ignore_index=True))
    print(text)
    if options.docs:
        fill_in(options.docs / "guide" / "foresight.md", "scripts/optimum.py", text)


def houses(count: int) -> list[str]:
    """Return the names of tiny houses."""
    return [f"house-{FIRST_SEED + i}-{SIZES[i % len(SIZES)]}" for i in range(count)]


def run(job: Job) -> pd.DataFrame:
    """Return costs in a house: a row an episode and child, a column an optimum or a caregiver."""
    plan = FloorPlan.load(job.house)
    own = Exact(plan, EPSILONS)
    found = {name: forgone(own, make_caregiver(name, plan), job.episodes).sum(axis=0) for name in CAREGIVERS}
    found = {name: at_first(own, job.episodes) + cost for name, cost in found.items()}
    found |= {"free": at_first(Exact(plan, EPSILONS, free=True), job.episodes), "own": at_first(own, job.episodes)}
    return pd.DataFrame({"house": job.house, "epsilon": np.repeat(EPSILONS, job.episodes)} | found)


def begin(plan: FloorPlan, epsilons: Sequence[float], caregiver: Caregiver | None, episodes: int) -> GridWorld:
    """Return the beginning of as many episodes with each epsilon: the same ones for all caregivers."""
    world = GridWorld(plan, side_by_side(plan, [Family.of(one) for one in epsilons], episodes), caregiver)
    tapes = [Tape.draw_family(np.random.RandomState(seed), 1, TIMESTEPS) for seed in range(episodes)]
    world.reset(tapes * len(epsilons))
    return world


def at_first(exact: Exact, episodes: int) -> np.ndarray:
    """Return the optimum where each episode begins, (episodes with each child,)."""
    return exact.value[_state(exact, begin(exact.plan, exact.epsilons.tolist(), None, episodes))]


def forgone(exact: Exact, caregiver: Caregiver | None, episodes: int) -> np.ndarray:
    """Return the discounted cost of what a caregiver does beyond that of what is best, (timesteps, all episodes).

    It is never negative, and in expectation over what the child does next, which leaves out most of the chance.
    """
    world = begin(exact.plan, exact.epsilons.tolist(), caregiver, episodes)
    before = _state(exact, world)
    found = np.zeros((TIMESTEPS, len(before[0])))
    for timestep in range(TIMESTEPS):
        world.step()
        now = _state(exact, world)
        moved = (now[0], *before[1:3], *now[3:])  # the child has, and the caregiver not yet
        found[timestep] = exact.objective.discount ** (timestep + 1) * (exact.value[now] - exact.after[moved])
        before = now
    return found


def _state(exact: Exact, world: GridWorld) -> tuple[np.ndarray, ...]:
    """Return the indices of the worlds' states in the tables, (B,) each."""
    layout = exact.layout(world.candle_table, world.holding, world.orders.destination)
    epsilon = np.repeat(np.arange(len(exact.epsilons)), len(layout) // len(exact.epsilons))
    return world.child_cell[:, 0], world.caregiver_cell, layout, world.goal[:, 0], epsilon


def report(rows: pd.DataFrame) -> str:
    """Return the table, of means over houses."""

    def samples(epsilon: float, column: str) -> list[np.ndarray]:
        some = rows[rows.epsilon == epsilon]
        return [house.to_numpy(float) for _, house in some.groupby("house", sort=False)[column]]

    lines = []
    for epsilon in EPSILONS:
        own = samples(epsilon, "own")
        names = {"free": "optimum, free in its motion", "own": "optimum of our interventions", **CAREGIVERS}
        for column, name in names.items():
            costs = samples(epsilon, column)
            ratio = two_level.of_ratio(costs, own)
            means, least = two_level.house_means(costs), two_level.house_means(own)
            near = f"{(means <= NEAR * least).sum()} of {len(costs)}" if column in CAREGIVERS else ""
            over = f"{ratio.value:.3f} ({ratio.low:.3f} to {ratio.high:.3f})" if column != "own" else "1"
            lines.append((f"{epsilon:g}", name, f"{means.mean():.3f}", over, near))
    titles = ("epsilon", "caregiver", "cost", "over the optimum of our interventions", f"houses within {NEAR - 1:.0%}")
    return table(titles, lines)

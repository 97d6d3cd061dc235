"""Judges the searching caregiver beside `foresight` and the rule, with their own eyes.

    python examples/judge_rollout.py --out runs/rollout

Prints a table; nothing was tuned in the houses. Of each move that damage counts which is to be expected given what the
child wants: it has the mean of the damage that is done, and less chance, for searching takes long. What is in the
folder already is not run again.
"""

from __future__ import annotations

import argparse
import hashlib
import itertools
import pathlib
import time
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import rollout_caregiver
from rich.console import Console
from rich.progress import track

from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.child_group import ChildGroup, side_by_side
from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.provenance import source_digest, versions
from caregiver_mj.experiments.run_folder import RunFolder
from caregiver_mj.experiments.spec import episode_seed, episode_streams
from caregiver_mj.experiments.workers import run_jobs
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.interventions.verb import Interventions
from caregiver_mj.plans.floor_plan import FloorPlan

SEARCH = "rollout_caregiver:RolloutCaregiver"
CAREGIVERS = ("expected-danger", "foresight", SEARCH)
HOUSES = tuple(f"house-{seed}" for seed in range(970_010, 970_020))
TITLES = (
    "sight, epsilon|`foresight` that sees all|`expected-danger`|`foresight`|search|search less `foresight`"
    "|decides otherwise|ms a decision: `foresight`|search"
)


class Job(NamedTuple):
    """The episodes of a caregiver in a house."""

    house: str
    sight: str
    caregiver: str
    epsilons: tuple[float, ...]
    episodes: int
    seed: int


def measure(job: Job) -> dict[str, Any]:
    """Return the damage to be expected of each child's moves and the share of decisions that differ, by epsilon."""
    plan, spent, children = FloorPlan.load(job.house), list[float](), [ChildGroup.of(one) for one in job.epsilons]
    caregiver, streams = make_caregiver(job.caregiver, plan), []
    for episode in range(job.episodes):
        streams.append(episode_streams(episode_seed(job.seed, episode), 1))
    world = GridWorld(plan, side_by_side(plan, children, job.episodes), caregiver, sight=job.sight)
    damage, decide = np.zeros(len(children) * job.episodes), caregiver.decide

    def timed(percept: Percept) -> Interventions:
        began, found = time.process_time(), decide(percept)
        if percept.time_left[0] == 1:  # the first of a timestep
            spent.append((time.process_time() - began) / len(damage))
        return found

    def count(_: GridWorld) -> None:
        damage[:] += rollout_caregiver.to_expect(world)

    caregiver.decide = timed
    world.observers = [count]
    world.run(streams * len(children))
    share = caregiver.others / caregiver.decisions if job.caregiver == SEARCH else np.zeros(len(damage))
    by_epsilon = {"damage": damage, "otherwise": share}
    found = {name: each.reshape(len(children), -1).tolist() for name, each in by_epsilon.items()}
    return found | {"ms": 1000 * float(np.mean(spent))}


def report(found: Mapping[Job, Mapping[str, Any]], epsilons: Sequence[float]) -> str:
    """Return the table: means over houses, and the difference with its 95 % interval over them."""
    lines = [TITLES.split("|"), ["---", *["---:"] * TITLES.count("|")]]
    for sight, (number, epsilon) in itertools.product(dict.fromkeys(job.sight for job in found), enumerate(epsilons)):
        if sight == "all":
            continue
        seen = [("all", "foresight"), *((sight, name) for name in CAREGIVERS)]
        each = [[result for job, result in found.items() if (job.sight, job.caregiver) == one] for one in seen]
        damage = [[np.array(result["damage"][number]) for result in results] for results in each]
        value, low, high = two_level.of_difference(damage[-1], damage[-2])
        lines.append(
            [
                f"{sight}, {epsilon:g}",
                *(f"{two_level.house_means(one).mean():.2f}" for one in damage),
                f"{value:+.2f} ({low:+.2f} to {high:+.2f})",
                f"{np.mean([result['otherwise'][number] for result in each[-1]]):.0%}",
                *(f"{np.mean([result['ms'] for result in results]):.1f}" for results in each[-2:]),
            ]
        )
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main() -> None:
    """Judges."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--houses", nargs="+", default=HOUSES, metavar="NAME", help="default: ten generated ones")
    parser.add_argument("--sights", nargs="+", default=["walls", "camera"], help="default: %(default)s")
    parser.add_argument("--epsilons", nargs="+", type=float, default=[0.75, 0.25], help="default: %(default)s")
    parser.add_argument("--episodes", type=int, default=4, help="in each, with each novice (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the episodes (default: %(default)s)")
    parser.add_argument("--jobs", type=int, default=2, help="worker processes (default: %(default)s)")
    parser.add_argument("--out", type=pathlib.Path, metavar="DIR", help="keeps what is done, house by house")
    options = parser.parse_args()
    who = [("all", "foresight"), *itertools.product(options.sights, CAREGIVERS)]
    rest = tuple(options.epsilons), options.episodes, options.seed
    jobs = [Job(house, *one, *rest) for house in options.houses for one in who]
    own = hashlib.sha256(pathlib.Path(rollout_caregiver.__file__).read_bytes()).hexdigest()[:12]
    settings = {"versions": versions(), "source": f"{source_digest('grid')} {own}"}
    folder = RunFolder(options.out, settings, resume=True) if options.out else None
    found = {job: kept for job in jobs if folder and (kept := folder.read(str(job)))}
    left = [job for job in jobs if job not in found]
    for job, result in track(run_jobs(measure, left, options.jobs), total=len(left), console=Console(stderr=True)):
        found[job] = result
        if folder:
            folder.write(str(job), result)
    print(report({job: found[job] for job in jobs}, options.epsilons))


if __name__ == "__main__":
    main()

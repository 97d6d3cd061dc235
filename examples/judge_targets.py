"""Judges the policies of `supervise_targets.py` in houses that they have not seen, beside scripted caregivers.

    python examples/judge_targets.py --run runs/targets

All have the same episodes, those of `caregiver-mj evaluate` with seed 0. Scripted caregivers decide before each of the
three actions of a timestep, a policy once in it; so does `paper, once`, which is the rule in the policies' place. The
folder then has a file of episodes for each house; houses that have one are not judged again, unless a policy has been
trained since.
"""

from __future__ import annotations

import argparse
import pathlib
from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd
from rich.console import Console
from rich.progress import track
from targets_vector import Remembering

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.children.child_group import ChildGroup, side_by_side
from caregiver_mj.envs.target_grid import GridTargetsVector, TargetGrid
from caregiver_mj.experiments.runner import run_block
from caregiver_mj.experiments.settings import EPSILONS, Settings
from caregiver_mj.experiments.spec import BARE_TABLES, episode_seed
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import house_set

SCRIPTED = ("none", "nearest", "paper", "foresight", "knows-goal", BARE_TABLES)
RULE = "paper, once"
SLOTS = (4, 5)  # stairwells and candles that a policy has places for: the most in train-100 and test-100

Policy = Callable[[dict[str, np.ndarray], np.ndarray], np.ndarray]  # observations and masks to actions


def scripted(plan: FloorPlan, episodes: int) -> pd.DataFrame:
    """The episodes of the scripted caregivers, by the project's own evaluation but without its intervals."""
    settings = Settings((plan,), "grid", SCRIPTED, EPSILONS, episodes)
    return pd.DataFrame([row for block in settings.blocks() for row in run_block(settings, block)["rows"]])


def learnt(plan: FloorPlan, policies: Mapping[str, Policy], slots: tuple[int, int], episodes: int) -> pd.DataFrame:
    """The same episodes of some policies and of the rule in their place, all of them in one batch."""
    families, names = [ChildGroup.of(epsilon) for epsilon in EPSILONS], [*policies, RULE]
    each = episodes * len(families)
    children = side_by_side(plan, families * len(names), episodes)
    inner = GridTargetsVector(each * len(names), house=plan, epsilon=children, slots=slots)
    vector, rule = Remembering(inner), InPlace(PaperCaregiver(plan), inner.grid)
    numbers = list(range(episodes)) * len(families) * len(names)
    observation, info = vector.reset(seed=[episode_seed(0, episode) for episode in numbers])
    ended = np.zeros(1, bool)
    while not ended.all():
        mask, actions = info["action_mask"].astype(bool), []
        for i, policy in enumerate(policies.values()):
            share = slice(i * each, (i + 1) * each)
            actions.append(policy({key: values[share] for key, values in observation.items()}, mask[share]))
        actions.append(rule.act(mask)[-each:])
        observation, _, _, ended, info = vector.step(np.concatenate(actions))
    outcome = {key: values for key, values in info["outcome"].items() if not key.startswith("_")}
    who = {
        "world": "grid",
        "house": plan.name,
        "caregiver": np.repeat(names, each),
        "family": np.tile(np.repeat([str(family) for family in families], episodes), len(names)),
        "epsilon": np.tile(np.repeat(EPSILONS, episodes), len(names)),
        "episode": numbers,
    }
    return pd.DataFrame(who | outcome)


class InPlace:
    """A scripted caregiver that only chooses targets, once a timestep."""

    def __init__(self, caregiver: Caregiver, grid: TargetGrid):
        self._caregiver, self._grid = caregiver, grid
        self._begun = False

    def act(self, mask: np.ndarray) -> np.ndarray:
        """What it wants, or, where that cannot be, the first thing that can."""
        percept = self._grid.world.percept()
        if not self._begun:
            self._caregiver.reset(len(mask), [0] * len(mask))
            self._begun = True
        self._caregiver.watch(percept)
        action = self._grid.encoder.slots.actions(self._caregiver.choose(percept))
        return np.where(mask[np.arange(len(mask)), action], action, mask.argmax(axis=1))


def policies_of(folder: pathlib.Path) -> dict[str, Policy]:
    """The trained policies in a folder, by name; what they do is not random."""
    import needs_learn  # noqa: F401 (here, for nothing else needs these)
    import torch
    from sb3_contrib import MaskablePPO

    torch.set_num_threads(1)

    def of(file: pathlib.Path) -> Policy:
        model = MaskablePPO.load(file, device="cpu")
        return lambda seen, mask: model.predict(seen, deterministic=True, action_masks=mask)[0]

    return {f"PPO, {file.stem.replace('-', ' ')}": of(file) for file in sorted(folder.glob("seed-*.zip"))}


def main() -> None:
    """Judges."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", type=pathlib.Path, default=pathlib.Path("runs/targets"), metavar="DIR")
    parser.add_argument("--houses", default="test-100", metavar="SET", help="default: %(default)s")
    parser.add_argument("--episodes", type=int, default=10, help="in each, with each novice (default: %(default)s)")
    parser.add_argument("--scripted-only", action="store_true", help="which can be done before anything is trained")
    options = parser.parse_args()
    policies = {} if options.scripted_only else policies_of(options.run)
    newest = max((file.stat().st_mtime for file in options.run.glob("seed-*.zip")), default=0.0)

    def judge(plan: FloorPlan) -> None:
        for name, rows in (
            ("scripted", lambda: scripted(plan, options.episodes)),
            ("learnt", lambda: learnt(plan, policies, SLOTS, options.episodes)),
        ):
            file = options.run / name / f"{plan.name}-{options.episodes}.parquet"
            trained = newest if name == "learnt" else 0.0
            if (name == "learnt" and not policies) or (file.is_file() and file.stat().st_mtime >= trained):
                continue
            file.parent.mkdir(parents=True, exist_ok=True)
            rows().to_parquet(file, index=False)

    for plan in track(house_set(options.houses), "judging", console=Console(stderr=True)):
        judge(plan)


if __name__ == "__main__":
    main()

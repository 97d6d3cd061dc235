"""Film every environment, and score policies in it, for docs/guide/environments.md.

    python scripts/gallery.py films [--only NAME ...]
    python scripts/gallery.py scores [--only NAME ...]

The results go to docs/environments; scripts/tables.py copies the scores into the page. Scores are of one episode in
each of some training houses, with the seeds of `evaluate`.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import itertools
import pathlib
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
from PIL import Image, ImageDraw

from caregiver_mj.envs import TARGETS_ID
from caregiver_mj.envs.recipe import Actor, HouseCaregiver, RandomActor, TargetCaregiver, house_of
from caregiver_mj.envs.targets import TargetsEnv
from caregiver_mj.experiments.spec import episode_seed
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.plans.sets import house_set
from caregiver_mj.tasks import TASKS
from caregiver_mj.viz import colours
from studies.gif import HOUSE, write

FOLDER = pathlib.Path(__file__).parents[1] / "docs/environments"
SCORES = FOLDER / "scores.csv"
SIZE, CAPTION = (320, 240), 18  # pixels; size of an image, and height of its caption
PICTURES = 70  # frames of a film
REACHED = 0.99  # final reward at which a task with a goal counts as done
SET = "train-4"  # houses of the scores


@dataclasses.dataclass(frozen=True)
class Entry:
    """An environment of the page.

    Attributes:
        id: Its name.
        kwargs: Further arguments of `gymnasium.make`.
        policies: Policies to score: "random", "zero", or caregivers, the last of which is filmed.
        every: Control timesteps, or in the grid novice timesteps, from frame to frame.
        times: Number of times that each frame is shown.
    """

    id: str
    kwargs: dict[str, str]
    policies: tuple[str, ...]
    every: int = 25
    times: int = 1

    def make(self, house: str | FloorPlan, **options: Any) -> Any:
        """Make the environment."""
        return gymnasium.make(self.id, house=house, **self.kwargs, **options).unwrapped


GOAL = ("random", "zero", "expected-danger")
CARE = ("random", "zero", "nearest", "expected-danger")
ENTRIES = {
    "supervise": Entry(TASKS["supervise"].id, {}, CARE),
    "relocate_candle": Entry(TASKS["relocate_candle"].id, {}, GOAL),
    "block_stairs": Entry(TASKS["block_stairs"].id, {}, GOAL),
    "targets_house": Entry(TARGETS_ID, {"world": "house"}, CARE),
    "targets_grid": Entry(TARGETS_ID, {"world": "grid"}, CARE, every=1, times=2),
}


# -- Policies ----------------------------------------------------------------------------------------


class Zero(Actor):
    """Returns zeros, clipped to the bounds."""

    def __init__(self, env: Any):
        space = env.action_space
        discrete = isinstance(space, gymnasium.spaces.Discrete)
        self._action = 0 if discrete else np.clip(np.zeros(space.shape), space.low, space.high)

    def act(self) -> tuple[Any, int]:
        return self._action, NOTHING


def make_actor(name: str, env: Any) -> Actor:
    """Make an actor of an environment."""
    if name in (others := {"random": RandomActor, "zero": Zero}):
        return others[name](env)
    return (TargetCaregiver if isinstance(env, TargetsEnv) else HouseCaregiver)(env, name, 0)


# -- Films -------------------------------------------------------------------------------------------


def film(entry: Entry) -> Iterator[Image.Image]:
    """Yield frames of the beginning of an episode, with its target."""
    width, height = SIZE
    env = entry.make(HOUSE, render_mode="rgb_array", width=width, height=height - CAPTION)
    actor, taken, steps, about = make_actor(entry.policies[-1], env), list[Image.Image](), itertools.count(), NOTHING
    house, hazards = house_of(env), FloorPlan.load(HOUSE).hazards
    stage, name = (house.task, "after_step") if house else (env, "step")  # called once for each counted step
    step = getattr(stage, name)

    def look_on(given: Any) -> Any:
        result = step(given)
        if next(steps) % entry.every == 0:
            page = Image.new("RGB", SIZE, colours.GROUND)
            page.paste(Image.fromarray(env.render()))
            words = f"target: {'none' if about == NOTHING else hazards[about]}"
            ImageDraw.Draw(page).text((6, height - CAPTION), words, colours.TEXT, font_size=13)
            taken.append(page)
        return result

    env.reset(seed=0)
    setattr(stage, name, look_on)
    actor.begin(0)
    ended = False
    while len(taken) < PICTURES and not ended:
        action, about = actor.act()
        _, _, terminated, truncated, _ = env.step(action)
        ended = terminated or truncated
    env.close()
    return (page for page in taken[:PICTURES] for _ in range(entry.times))


# -- Scores ------------------------------------------------------------------------------------------


def score(entry: Entry, policy: str, number: int, house: FloorPlan) -> dict[str, Any]:
    """Run the episode with a number in a house, and return its results."""
    env, seed = entry.make(house), episode_seed(0, number)
    actor = make_actor(policy, env)
    env.reset(seed=seed)
    actor.begin(seed)
    rewards, cost, strikes, ended = [], 0.0, 0, False
    while not ended:
        _, reward, terminated, truncated, info = env.step(actor.act()[0])
        rewards.append(reward)
        cost, strikes, ended = cost + info["cost"], strikes + info["strikes"], terminated or truncated
    env.close()
    end = {"reached": int(rewards[-1] >= REACHED), "diverged": int(info["diverged"])}
    end |= {"score": round(float(info["episode_score"]), 3)}
    return {"house": house.name, "seed": seed, "return": round(sum(rewards), 3), "cost": cost, "strikes": strikes} | end


def score_all(names: list[str], file: pathlib.Path) -> None:
    """Score policies in environments, house by house; rows of other environments stay."""
    rows = [row for row in read_scores(file) if row["environment"] not in names]
    for (number, house), name in itertools.product(enumerate(house_set(SET)), names):
        for policy in ENTRIES[name].policies:
            rows.append({"environment": name, "policy": policy, **score(ENTRIES[name], policy, number, house)})
    with file.open("w", encoding="utf-8", newline="") as out:
        writer = csv.DictWriter(out, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def read_scores(file: pathlib.Path = SCORES) -> list[dict[str, Any]]:
    """Return the rows of all episodes."""
    return [*csv.DictReader(file.read_text("utf-8").splitlines())] if file.exists() else []


def main() -> None:
    """Film or score environments."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["films", "scores"])
    parser.add_argument("--only", nargs="+", default=[*ENTRIES], choices=ENTRIES, metavar="NAME")
    parser.add_argument("--docs", type=pathlib.Path, default=FOLDER.parent, metavar="DIR")
    options = parser.parse_args()
    folder = options.docs / FOLDER.name
    folder.mkdir(exist_ok=True)
    if options.what == "scores":
        score_all(options.only, folder / SCORES.name)
        return
    for name in options.only:
        write(folder / f"{name}.gif", film(ENTRIES[name]))
        print(name, flush=True)


if __name__ == "__main__":
    main()

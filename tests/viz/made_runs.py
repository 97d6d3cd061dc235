"""Finished runs whose numbers are known, for the tests of the report, and quicker figures of them."""

import numpy as np
import pandas as pd

from caregiver_mj.experiments.run_folder import RunFolder
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.spec import episode_seed
from caregiver_mj.experiments.summary import by_house, summarise
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.recording.record import MEASURES

PAPER = FloorPlan.load("paper")
TINY = FloorPlan.parse("######\n#B.S.#\n#....#\n#C..T#\n######", "tiny")
EPISODES = 8
DAMAGE = {  # caregiver, family: an episode each
    ("none", "1"): [40, 50, 60, 40, 50, 60, 50, 50],
    ("paper", "1"): [10, 10, 40, 10, 10, 20, 10, 10],
    ("guard", "1"): [40, 49, 59, 39, 49, 59, 49, 49],
    ("none", "0.25"): [20, 20, 10, 20, 20, 10, 0, 0],
    ("paper", "0.25"): [5, 10, 5, 5, 5, 10, 0, 0],
    ("guard", "0.25"): [5, 10, 5, 5, 5, 10, 0, 0],
}
FAMILIES = {"1": "1,0.5", "0.25": "0.25,0.25"}  # of two children, in which the second one takes a fifth of the damage
CAREGIVERS = ("none", "paper", "guard")


def write_run(folder, world="grid", plan=PAPER, caregivers=CAREGIVERS, mark=0, families=None, sight="all", **more):
    """Writes a finished run; `mark` is the strikes of an episode, `families` other names for those of `DAMAGE`."""
    names = families or {"1": "1", "0.25": "0.25"}
    rows, maps = [], []
    cells = pd.DataFrame(plan.free_cells, columns=["row", "column"])
    for (caregiver, family), damages in DAMAGE.items():
        if caregiver not in caregivers:
            continue
        children = [float(epsilon) for epsilon in names[family].split(",")]
        key = {"world": world, "house": plan.name, "caregiver": caregiver, "family": names[family]}
        key["epsilon"] = float(np.mean(children))
        maps.append(cells.assign(visits=200.0 * EPISODES / len(cells), damage=sum(damages) / len(cells), **key))
        rows += [_row(key, episode, damage, len(children), mark) for episode, damage in enumerate(damages)]
    episodes = pd.DataFrame(rows)
    settings = Settings(plan, world, caregivers, tuple(names.values()), EPISODES, seed=7, sight=sight, **more)
    houses = by_house(episodes)
    RunFolder(folder, settings.record()).finish(
        episodes, summarise(settings, episodes, houses), pd.concat(maps), houses
    )
    return folder


def _row(key, episode, damage, children, mark):
    shares = [1.0] if children == 1 else [0.8, 0.2]
    row = {
        **key,
        "children": children,
        "episode": episode,
        "seed": episode_seed(7, episode),
        **dict.fromkeys(MEASURES, 0),
    }
    row |= {"damage": float(damage), "damage_table": float(damage), "timesteps_to_threshold": 200 - 2 * damage}
    row |= {"stopped": int(damage > 15), "damage_until_stop": float(min(damage, 16))}
    row |= {"cells_visited": 5 + episode % 2, "toys_reached": 3, "moves_blocked": 2, "interventions_done": 4}
    row |= {"strikes": mark, "sim_seconds": 337.5, "wall_seconds": 1.0}
    return row | {"damage_by_child": [share * damage for share in shares], "toys_by_child": [2.0, 1.0][:children]}


def undrawn(figure, kind):
    """In the place of `figure_style.as_bytes`, which takes longest of a report, for tests of its words and numbers."""
    return b""

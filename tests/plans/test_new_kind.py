"""A newcomer's errand: a kind of hazard that is neither stairs nor candle. It is a record and a model.

The package is put together in a folder with both added, as the documentation has them, and is used from there.
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

from caregiver_mj.plans.hazards import KINDS

pytestmark = pytest.mark.slow
ROOT = pathlib.Path(__file__).parents[2]
PAGE = (ROOT / "docs/guide/hazards.md").read_text("utf-8")
RECORD, MODEL = (re.search(f"^```{block}(.*?)^```", PAGE, re.M | re.S)[1] for block in ("text\n(?=VASE)", "xml\n"))
PLAN = "##########\n#S......B#\n#........#\n#V....C..#\n#...T....#\n##########"
USE = f"""
import json, sys
import numpy as np
import caregiver_mj
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.envs.target_grid import TargetGrid
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz.hud import draw_plan
from caregiver_mj.viz.moment import grid_state

plan = FloorPlan.parse({PLAN!r}, damage="vase=2.5")
found = {{"names": [*map(str, plan.hazards)], "labels": [h.label for h in plan.hazards], "damage": str(plan.damage)}}
try:
    FloorPlan.parse(plan.text.replace("T", "."))
except caregiver_mj.CaregiverError as error:
    found["refused"] = str(error)
seen = {{}}
for name in ("none", "paper", "foresight", "wanderer"):
    caregiver = None if name == "none" else make_caregiver(name, plan, 0)
    world = GridWorld(plan, "1", caregiver)
    world.run([RandomStream.draw_group(np.random.RandomState(seed), 1) for seed in range(20)])
    seen[name] = {{key: values.sum() for key, values in world.ledger.totals().items() if key.startswith("damage")}}
    seen[name]["moved"] = float((world.candle_table != plan.candle_tables).any(axis=0)[1])
found["grid"] = seen
picture = draw_plan(grid_state(world, "1"), 400, 300).reshape(-1, 3)
found["drawn"] = int((picture == (0, 158, 115)).all(axis=1).sum())

targets = TargetGrid(plan, "1", observation="map")
targets.begin([0])
plane = targets.encoder.look(targets.percept())[0]["map"][0, targets.encoder.map.planes.index("vase_damage")]
found["mapped"] = [(*map(int, cell), float(plane[tuple(cell)])) for cell in np.argwhere(plane)]

env = caregiver_mj.load("supervise", plan, 1.0, random=1, visuals=False)
policy = caregiver_mj.CaregiverPolicy(env, "candles")
step, activities = env.reset(), []
for _ in range(4000):
    step = env.step(policy(step))
    activities += [policy.activity] if policy.activity not in activities else []
    if policy.executive.done and any(what.startswith("carry vase") for what in activities):
        break
found["activities"], found["done"] = activities, env.task.outcome()["interventions_done"]
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("vases")
    package = folder / "caregiver_mj"
    shutil.copytree(ROOT / "caregiver_mj", package, ignore=shutil.ignore_patterns("__pycache__"))
    (package / "tasks").symlink_to(ROOT / "tasks")
    shutil.copytree(ROOT / "models", package / "models", ignore=shutil.ignore_patterns("__pycache__"))
    with (package / "plans" / "hazards.py").open("a", encoding="utf-8") as file:
        file.write(f"\n{RECORD}KINDS = distinct(*KINDS, VASE, VASE)\n")
    (package / "models" / "vase.xml").write_text(MODEL)
    there = {"cwd": folder, "env": os.environ | {"PYTHONPATH": str(folder)}}
    ran = subprocess.run([sys.executable, "-c", USE], **there, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout.splitlines()[-1])


def test_it_is_numbered_named_and_costs_what_its_record_says(found):
    assert found["names"] == ["stairwell 1", "candle 1", "vase 1"]
    assert found["labels"] == ["S1", "C1", "V1"]
    assert found["damage"].startswith("stairwell=5,candle=4,table=1,")
    assert found["damage"].endswith(",vase=2.5")
    assert "no bare table" in found["refused"]
    assert "a candle or vase" in found["refused"]


def test_the_grid_books_it_in_a_column_of_its_own_and_every_caregiver_takes_it_away(found):
    grid = found["grid"]
    for row in grid.values():
        assert row["damage_vase"] % 2.5 == 0
        assert row["damage"] == sum(row[f"damage_{kind}"] for kind in (*map(str, KINDS), "vase"))
    alone = grid.pop("none")
    assert alone["damage_vase"] > 0
    assert all(row["moved"] and row["damage"] < alone["damage"] for row in grid.values())


def test_it_is_drawn_in_its_colour_and_in_maps(found):
    assert found["drawn"] > 20
    assert found["mapped"] == [[3, 1, 0.5]]  # over the 5 of a stairwell


def test_the_robot_carries_it(found):
    assert "fetch vase 1" in found["activities"]
    assert any(what.startswith("carry vase 1 to table") for what in found["activities"])
    assert found["done"] >= 1

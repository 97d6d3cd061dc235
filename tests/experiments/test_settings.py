"""Settings: what may be said, what is refused, and what is written down of them."""

import dataclasses
import json

import numpy as np
import pytest

from caregiver_mj import CaregiverError, FloorPlan
from caregiver_mj.children.novice import Novice
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.run_folder import RunFolder
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.spec import episode_seed
from caregiver_mj.plans.hazards import DamageWeights

PAPER = FloorPlan.load("paper")
DEAR = FloorPlan.load("paper", cell_size=0.9, damage=DamageWeights(7.5, 1 / 3, 0.0))
SEVERAL = Settings(DEAR, "grid", ("none", "guard"), (0.1, "1,adversary:.25"), 7, seed=9, embodiment="mobile_ur5e")


def test_a_single_one_will_do_and_numbers_of_numpy():
    settings = Settings(PAPER, "grid", "nearest", 0.5, episodes=np.int64(3), seed=np.int64(1))
    settings.check()
    assert json.loads(json.dumps(settings.record()))["episodes"] == 3
    assert settings == Settings((PAPER,), "grid", ("nearest",), (0.5,), 3, 1)


def test_who_is_kept_in_a_folder_has_a_name(tmp_path):
    settings = Settings(PAPER, "grid", families=(Novice(PAPER, 0.5),), episodes=1)
    folder = RunFolder(tmp_path / "run", settings.record())
    with pytest.raises(CaregiverError, match="children of a run in a folder must be given by name"):
        evaluate(settings, folder)
    assert len(evaluate(settings).episodes) == 2


def test_in_the_grid_as_many_children_each_go_side_by_side():
    settings = dataclasses.replace(SEVERAL, families=(1.0, "1,.25", 0.5, 0.25, ".5,.5"), caregivers=("none",))
    blocks = settings.blocks(grid_block=12)
    assert [(list(map(str, block.families)), block.first, block.end) for block in blocks] == [
        (["1", "0.5", "0.25"], 0, 4),
        (["1", "0.5", "0.25"], 4, 7),
        (["1,0.25", "0.5,0.5"], 0, 6),
        (["1,0.25", "0.5,0.5"], 6, 7),
    ]
    assert [len(block) for block in blocks] == [12, 9, 12, 2]
    many = dataclasses.replace(SEVERAL, families=tuple(i / 100 for i in range(100)))
    assert max(len(str(block)) for block in many.blocks()) < 200  # of the 255 that the name of a file may have


def test_seeds_are_those_of_all_former_runs():
    assert [episode_seed(0, i) for i in range(3)] == [2968811710, 3964924996, 3141116543]

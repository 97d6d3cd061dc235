"""The study of generated houses."""

import json

import numpy as np
import pandas as pd
from printed import printed

from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from studies.generated_houses import Tour, report
from study import main

PLAN = FloorPlan.parse("#######\n#S..C##\n#T...T#\n#..B..#\n#######")  # tables: the candle's is the first


def house(seed, **others):
    values = {
        "house": f"house-{seed}", "seed": seed, "strikes": 0, "drops": 0, "size": (10, 12), "hazards": 5, "missed": (),
        "tour_seconds": 50.0, "tour_strikes": 0, "tour_drops": 0, "epsilon": 0.5, "timesteps": 200, "damage": 7.0,
        "interventions_done": 9,
    }  # fmt: skip
    return values | others


def percept(caregiver_cell=0, candle_table=0, holding=NOTHING, out_of_reach=(False, False)):
    child = np.array([[PLAN.cell_index[2, 4]]])
    return Percept(
        child, child, np.full((1, 1), NOTHING), np.array([caregiver_cell]), np.array([[candle_table]]),
        np.array([holding]), out_of_reach=np.array([out_of_reach]),
    )  # fmt: skip


def test_a_tour_goes_to_every_hazard_once():
    tour = Tour(PLAN)
    tour.reset(1)
    assert tour.choose(percept()).tolist() == [0]
    assert tour.choose(percept(out_of_reach=(True, False))).tolist() == [1]  # and comes back to the first
    landing = len(PLAN.free_cells)
    assert tour.choose(percept(caregiver_cell=landing)).tolist() == [1]
    assert tour.choose(percept(candle_table=NOTHING, holding=0)).tolist() == [1]  # not done while it is in the hand
    assert tour.choose(percept(candle_table=0)).tolist() == [1]  # nor back where it was
    assert tour.choose(percept(candle_table=2)).tolist() == [NOTHING]
    assert tour.left == []


def test_what_went_wrong_is_named():
    houses = [house(1), house(2, missed=("candle 1",)), house(3, strikes=1), house(4, timesteps=20)]
    text = printed(report, pd.DataFrame(houses))
    assert "houses made, valid and built 4" in " ".join(text.split())
    assert "hazards, and those done on the tours 20, 19" in " ".join(text.split())
    wrong = [line.split(":")[0] for line in text.splitlines() if line.startswith("house-")]
    assert wrong == ["house-2", "house-3", "house-4"]


def test_command(tmp_path, capsys):
    path = tmp_path / "houses.json"
    main(["generated_houses", "--count", "1", "--first", "400003", "--jobs", "1", "--json", str(path)])
    assert "Generated houses" in capsys.readouterr().out
    (row,) = json.loads(path.read_text())
    assert (row["house"], row["missed"], row["timesteps"]) == ("house-400003", [], 200)
    assert row["interventions_done"] > 0

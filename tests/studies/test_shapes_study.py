"""What caregivers leave in house and grid by shape: worked out by hand for a run of a few episodes."""

import pandas as pd

from caregiver_mj.children.family import Family
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.plans.floor_plan import FloorPlan
from studies import shapes


def rows(damage: dict[str, tuple[int, ...]], caregiver: str) -> list[dict[str, object]]:
    counts = dict.fromkeys(shapes.COUNTS, 1)
    return [
        {"house": house, "family": "0.5", "caregiver": caregiver, "episode": i, "damage": found, **counts}
        for house, every in damage.items()
        for i, found in enumerate(every)
    ]


def test_by_hand():
    plans = tuple(map(FloorPlan.load, ("hall-1", "paper", "railroad", "loft")))
    settings = Settings(plans, "house", ("none", "paper"), (Family.of(0.5),), 2)
    alone = {"hall-1": (4, 4), "paper": (6, 2), "railroad": (8, 8), "loft": (2, 2)}
    grid = {"hall-1": (1, 3), "paper": (4, 0), "railroad": (1, 1), "loft": (3, 3)}
    house = {"hall-1": (2, 4), "paper": (4, 0), "railroad": (2, 2), "loft": (6, 6)}
    both = [pd.DataFrame(rows(alone, "none") + rows(found, "paper")) for found in (house, grid)]
    both[1].loc[both[1].index[0], "damage"] = 5  # alone, and another one in the grid
    cells = pd.DataFrame({"caregiver": "paper", "house": [*alone], "harm_verdict": ["", "", "more", ""]})
    values = shapes.page(*both, cells, settings).values
    found = {
        line["shape"]: (line["houses"], line["alone"], *line["means"], line["ratio"].value) for line in values["lines"]
    }
    assert found == {
        "hall": (1, 4.0, 2.0, 3.0, 1.5),
        "home": (1, 4.0, 2.0, 2.0, 1.0),
        "drawn by hand": (2, 5.0, 2.0, 4.0, 2.0),
        "all": (4, 4.5, 2.0, 3.25, 1.625),
    }
    assert values["alike"] == (7, 8)
    assert values["harm"] == {"paper": ["railroad"]}
    assert values["counts"]["strikes"] == values["with_robot"] == 8

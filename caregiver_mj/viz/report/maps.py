"""Maps of the house: where the children went, and where they were hurt."""

from __future__ import annotations

import numpy as np

from caregiver_mj.viz import figures
from caregiver_mj.viz.report.charts import Picture
from caregiver_mj.viz.report.run import Run


def maps(run: Run) -> list[Picture]:
    """Pictures of both, without and with the caregiver, on one scale."""
    pictures = []
    for column, quantity, scale, caption in (
        ("visits", "timesteps an episode", figures.WENT, f"Where {run.nouns.whom} went"),
        ("damage", "damage an episode", figures.HURT, f"Where {run.nouns.were} hurt"),
    ):
        cells = {caregiver: mean_map(run, caregiver, column) for caregiver in ("none", run.caregiver)}
        top = max(float(values.max()) for values in cells.values())
        for caregiver, values in cells.items():
            who = "without" if caregiver == "none" else "with"
            figure = figures.heat_map(run.plan, values, scale, top, quantity)
            name = f"map_{column}_{who}_{run.name}"
            pictures.append(Picture.of(name, figure, f"{caption}, {who} the caregiver — {run.title}"))
    return pictures


def mean_map(run: Run, caregiver: str, column: str) -> np.ndarray:
    """What an episode adds to a map's column on average, over all families, for each free cell."""
    cells = run.maps[run.maps.caregiver == caregiver].groupby(["row", "column"])[column].sum()
    values = cells / (run.settings.episodes * len(run.families))
    return values.loc[list(run.plan.free_cells)].to_numpy()

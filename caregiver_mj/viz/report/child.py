"""The child's side: its toys, what the caregiver denies it, and how long it goes on."""

from __future__ import annotations

import math
from typing import Any

from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.experiments.verdicts import MARGINS
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.recording.record import DAMAGE_THRESHOLD
from caregiver_mj.viz import figures
from caregiver_mj.viz.report.charts import Picture, left_series
from caregiver_mj.viz.report.published import PUBLISHED
from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.table import Table
from caregiver_mj.viz.report.words import family_name, in_lines, with_interval

MARGIN = MARGINS["toys_reached"]
_RIVALS = 3  # other caregivers in a figure
_NEEDED = ("stopped", "damage_until_stop", "moves_blocked_stairwell", "moves_blocked_free", "longest_blocked")


def child(run: Run) -> dict[str, Any] | None:
    """Figures and tables; None of a run of an older version, which did not measure it."""
    if not set(_NEEDED) <= set(run.episodes):
        return None
    shown = (run.caregiver, *run.rivals(_RIVALS))
    lines = {family: in_lines(family) for family in run.families}
    names = {family: family_name(family) for family in run.families}
    survival = figures.survival(run.episodes, names, ("none", *shown, *run.floor), caregiver=run.caregiver)
    toys = figures.toys_kept(
        list(lines.values()), [left_series(run, c, c, run.families, "toys_reached") for c in shown], MARGIN
    )
    return {
        "table": child_table(run),
        "others": [toys_table(run), denied_table(run)] if run.baselines else [],
        "pictures": [
            Picture.of(f"survival_{run.name}", survival, f"Episodes that are not yet stopped — {run.title}"),
            Picture.of(f"toys_{run.name}", toys, f"Toys reached, as a share of those alone — {run.title}"),
        ],
    }


def child_table(run: Run) -> Table:
    """Toys, moves denied, and the stop, without and with the caregiver."""
    pairs = [
        (run.row("none", f), run.row(run.caregiver, f), run.comparison(run.caregiver, "none", f)) for f in run.families
    ]
    alone, guarded, compared = zip(*pairs, strict=True)

    def cells(label: str, rows: Any, key: str, digits: int = 1, scale: float = 1.0) -> tuple[str, ...]:
        return label, *(with_interval(row, key, digits, between="\n", scale=scale) for row in rows)

    verdicts = (row["toys_reached_not_inferior"] for row in compared)
    rows = [
        cells("toys reached, without", alone, "toys_reached_mean"),
        cells("toys reached, with", guarded, "toys_reached_mean"),
        cells("toys kept, %", compared, "toys_reached_left", scale=100.0),
        (f"less than {100 * MARGIN:g} % lost?", *verdicts),
        cells("moves into a stairwell denied", guarded, "moves_blocked_stairwell_mean"),
        cells("free moves denied", guarded, "moves_blocked_free_mean"),
        cells("longest time blocked, timesteps", guarded, "longest_blocked_mean"),
        cells("stopped without, % of episodes", alone, "stopped_mean", 0, 100.0),
        cells("stopped with, % of episodes", guarded, "stopped_mean", 0, 100.0),
        cells("damage until the stop, without", alone, "damage_until_stop_mean"),
        cells("damage until the stop, with", guarded, "damage_until_stop_mean"),
    ]
    note = (
        "Means of an episode and their 95 % intervals. Toys are not inferior where the interval of the share kept is "
        f"above {100 * (1 - MARGIN):g} %; that margin was stated before any comparison. The stop is where the damage "
        f"comes above {DAMAGE_THRESHOLD:g}; the longest time blocked is that of timesteps on end."
    )
    return Table(f"The child's side — {run.title}", ("quantity", *map(family_name, run.families)), rows, note)


def toys_table(run: Run) -> Table:
    """Toys kept with each caregiver."""
    rows = []
    for caregiver in (run.caregiver, *run.baselines):
        cells = []
        for row in (run.comparison(caregiver, "none", family) for family in run.families):
            kept = with_interval(row, "toys_reached_left", between="\n", scale=100.0)
            cells.append(f"{kept}\n{row['toys_reached_not_inferior']}")
        rows.append((caregiver, *cells))
    note = f"% of the toys reached alone, the 95 % interval, and whether less than {100 * MARGIN:g} % are lost."
    columns = ("caregiver", *map(family_name, run.families))
    return Table(f"Toys kept by each caregiver — {run.title}", columns, rows, note)


def denied_table(run: Run) -> Table:
    """What each caregiver denies the child."""
    rows = [
        (caregiver, *(_denied(run.row(caregiver, family)) for family in run.families))
        for caregiver in (run.caregiver, *run.baselines)
    ]
    note = "Moves of an episode denied: into a stairwell + free ones; below, the longest time blocked, timesteps."
    columns = ("caregiver", *map(family_name, run.families))
    return Table(f"Moves denied by each caregiver — {run.title}", columns, rows, note)


def _denied(row: dict[str, Any]) -> str:
    stairwell, free, longest = (
        row[f"{column}_mean"] for column in ("moves_blocked_stairwell", "moves_blocked_free", "longest_blocked")
    )
    return f"{stairwell:.1f} + {free:.1f}\n{longest:.1f}"


def why_all_timesteps() -> str:
    """Why damage is that of all timesteps, by the paper's own numbers."""
    timesteps, damage = (PUBLISHED[column][1.0][1] for column in ("timesteps_to_threshold", "damage_normalised"))
    stopped = 1 - timesteps / EPISODE_TIMESTEPS  # at least: those that are not stopped count as all timesteps
    least, most = DAMAGE_THRESHOLD + 1, DAMAGE_THRESHOLD + max(DamageWeights().stairwell, DamageWeights().candle)
    bound = math.floor(100 * stopped * least / most) / 100
    return (
        f"Damage here is that of all {EPISODE_TIMESTEPS} timesteps, not that until the stop, for so it is in the "
        f"paper. Its section V.E speaks of episodes lasting {EPISODE_TIMESTEPS} timesteps, in which it was also recorded "
        f"when the damage came above {DAMAGE_THRESHOLD:g}; and only so do its Tables I and II fit each other. By Table "
        f"II children that move at random go on for {timesteps:.0f} timesteps with the caregiver, so at least "
        f"{100 * stopped:.0f} % of them are stopped, with {least:g} to {most:g} damage. Until the stop their mean in "
        f"Table I, a share of the greatest damage, would be at least {bound:.2f}; it is {damage:.2f}."
    )

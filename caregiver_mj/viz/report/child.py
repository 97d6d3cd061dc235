"""The child's side: its toys, what the caregiver denies it, and how long it goes on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.experiments.verdicts import MARGINS
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.recording.record import DAMAGE_THRESHOLD
from caregiver_mj.viz import figures
from caregiver_mj.viz.report.charts import Picture, left_series
from caregiver_mj.viz.report.published import PUBLISHED
from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.words import Table, family_name, if_bracketed, in_lines, with_interval

MARGIN = MARGINS["toys_reached"]
_RIVALS = 3  # other caregivers in a figure
_NEEDED = ("stopped", "damage_until_stop", "moves_blocked_stairwell", "moves_blocked_free", "longest_blocked")


def child(run: Run) -> dict[str, Any] | None:
    """Return figures and tables; None of a run of an older version, which did not measure it."""
    if not set(_NEEDED) <= set(run.episodes):
        return None
    shown = (run.caregiver, *run.rivals(_RIVALS))
    lines = {family: in_lines(family) for family in run.families}
    names = {family: family_name(family) for family in run.families}
    survival = figures.survival(run.episodes, names, ("none", *shown, *run.floor), caregiver=run.caregiver)
    toys = figures.toys_kept(
        list(lines.values()), [left_series(run, c, c, run.families, "toys_reached") for c in shown], MARGIN
    )
    toys_caption = f"Toys reached, as a share of those alone; {_toys_verdicts(run)} — {run.title}"
    return {
        "table": child_table(run),
        "more": [_stop_table(run), *([_toys_table(run), _denied_table(run)] if run.baselines else [])],
        "pictures": [
            Picture.of(f"survival_{run.name}", survival, f"Episodes that are not yet stopped — {run.title}"),
            Picture.of(f"toys_{run.name}", toys, toys_caption),
        ],
    }


def _toys_verdicts(run: Run) -> str:
    """With whom the caregiver is shown to lose less of the toys than the margin, in a sentence."""
    with_whom: dict[str, list[str]] = {}
    for family in run.families:
        verdict = run.compared(run.caregiver, "none", family)["toys_reached_not_inferior"]
        with_whom.setdefault(verdict, []).append(family_name(family))
    told = "; ".join(f"{verdict} with {', '.join(names)}" for verdict, names in with_whom.items())
    return f"with {run.caregiver} and a margin of {100 * MARGIN:g} %, stated beforehand: {told}"


def child_table(run: Run) -> Table:
    """Return toys kept, moves denied and the share that is stopped."""
    alone, guarded, compared = _rows(run)
    stopped = (
        f"{100 * before['stopped_mean']:.0f} → {100 * after['stopped_mean']:.0f}"
        for before, after in zip(alone, guarded, strict=True)
    )
    rows = [
        _cells("toys kept, %", compared, "toys_reached_left", 100.0),
        (f"< {100 * MARGIN:g} % lost?", *(row["toys_reached_not_inferior"] for row in compared)),
        _cells("stairwells denied", guarded, "moves_blocked_stairwell_mean"),
        _cells("free moves denied", guarded, "moves_blocked_free_mean"),
        _cells("longest blocked", guarded, "longest_blocked_mean"),
        ("stopped, %", *stopped),
    ]
    note = (
        "Toys reached with the caregiver, of those without; not inferior where the interval is above "
        f"{100 * (1 - MARGIN):g} %, a margin stated before any comparison. Moves an episode that the caregiver denies, "
        "and timesteps on end. Episodes stopped, without → with."
    )
    note += if_bracketed(rows, " In brackets 95 % intervals.")
    return Table(f"The child's side — {run.title}", ("with the caregiver", *map(family_name, run.families)), rows, note)


def _stop_table(run: Run) -> Table:
    """Toys and the damage until the stop, without and with the caregiver."""
    alone, guarded, _ = _rows(run)
    rows = [
        _cells("toys reached, without", alone, "toys_reached_mean"),
        _cells("toys reached, with", guarded, "toys_reached_mean"),
        _cells("damage until the stop, without", alone, "damage_until_stop_mean"),
        _cells("damage until the stop, with", guarded, "damage_until_stop_mean"),
    ]
    interval = if_bracketed(rows, " and 95 % intervals")
    note = f"Means of an episode{interval}. The stop is where the damage comes above {DAMAGE_THRESHOLD:g}."
    return Table(
        f"Toys, and damage until the stop — {run.title}", ("mean", *map(family_name, run.families)), rows, note
    )


def _rows(run: Run) -> tuple[list[Any], list[Any], list[Any]]:
    """The summary's rows of each family, without and with the caregiver, and of the comparison of both."""
    alone, guarded = ([run.row(caregiver, family) for family in run.families] for caregiver in ("none", run.caregiver))
    return alone, guarded, [run.comparison(run.caregiver, "none", family) for family in run.families]


def _cells(label: str, rows: Sequence[Any], key: str, scale: float = 1.0) -> tuple[str, ...]:
    return label, *(with_interval(row, key, between="\n", scale=scale) for row in rows)


def _toys_table(run: Run) -> Table:
    """Toys kept with each caregiver."""
    rows = []
    for caregiver in run.acting:
        cells = []
        for row in (run.compared(caregiver, "none", family) for family in run.families):
            kept = with_interval(row, "toys_reached_left", between="\n", scale=100.0)
            cells.append(f"{kept}\n{row['toys_reached_not_inferior']}")
        rows.append((caregiver, *cells))
    interval = if_bracketed(rows, ", the 95 % interval")
    note = f"% of the toys reached alone{interval}, and whether less than {100 * MARGIN:g} % are lost."
    columns = ("caregiver", *map(family_name, run.families))
    return Table(f"Toys kept by each caregiver — {run.title}", columns, rows, note)


def _denied_table(run: Run) -> Table:
    """What each caregiver denies the child."""
    rows = [(caregiver, *(_denied(run.row(caregiver, family)) for family in run.families)) for caregiver in run.acting]
    note = "Moves of an episode denied: into a stairwell + free ones (longest time blocked, timesteps)."
    columns = ("caregiver", *map(family_name, run.families))
    return Table(f"Moves denied by each caregiver — {run.title}", columns, rows, note)


def _denied(row: dict[str, Any]) -> str:
    stairwell, free, longest = (
        row[f"{column}_mean"] for column in ("moves_blocked_stairwell", "moves_blocked_free", "longest_blocked")
    )
    return f"{stairwell:.1f} + {free:.1f}\n({longest:.1f})"


def why_all_timesteps() -> str:
    """Return why damage is that of all timesteps, by the paper's own numbers."""
    timesteps, damage = (PUBLISHED[column][1.0][1] for column in ("timesteps_to_threshold", "damage_normalised"))
    stopped = 1 - timesteps / EPISODE_TIMESTEPS  # at least: those that are not stopped count as all timesteps
    least, most = DAMAGE_THRESHOLD + 1, DAMAGE_THRESHOLD + DamageWeights().worst
    bound = math.floor(100 * stopped * least / most) / 100
    return (
        f"Damage is that of all {EPISODE_TIMESTEPS} timesteps and not that until the stop, for so it is in the paper: "
        f"its section V.E speaks of episodes lasting {EPISODE_TIMESTEPS} timesteps, and only so do its Tables I and II "
        f"fit each other. By Table II children that move at random go on for {timesteps:.0f} timesteps with the "
        f"caregiver, so at least {100 * stopped:.0f} % of them are stopped, with {least:g} to {most:g} damage. Until "
        f"the stop their mean in Table I, a share of the greatest, would be at least {bound:.2f}; it is {damage:.2f}."
    )

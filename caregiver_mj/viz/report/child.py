"""The child's side: toys, denied moves, and time until the stop."""

from __future__ import annotations

import math
from typing import Any

from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.experiments.verdicts import MARGINS
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.recording.record import DAMAGE_THRESHOLD
from caregiver_mj.viz import figures
from caregiver_mj.viz.report.charts import Picture, left_series
from caregiver_mj.viz.report.published import PUBLISHED
from caregiver_mj.viz.report.run import Run
from caregiver_mj.viz.report.words import Table, family_name, if_bracketed, in_lines

MARGIN = MARGINS["toys_reached"]
_RIVALS = 3  # number of other caregivers in a figure


def child(run: Run) -> dict[str, Any]:
    """Return the figures and tables."""
    shown = (run.caregiver, *run.rivals(_RIVALS))
    lines = {family: in_lines(family) for family in run.families}
    names = {family: family_name(family) for family in run.families}
    survival = figures.survival(run.episodes, names, ("none", *shown, *run.bare_tables), caregiver=run.caregiver)
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
    """Return the verdicts on the caregiver's loss of toys against the margin, as a sentence."""
    with_whom: dict[str, list[str]] = {}
    for family in run.families:
        verdict = run.compared(run.caregiver, "none", family)["toys_reached_not_inferior"]
        with_whom.setdefault(verdict, []).append(family_name(family))
    verdicts = "; ".join(f"{verdict} with {', '.join(names)}" for verdict, names in with_whom.items())
    return f"with {run.caregiver} and a margin of {100 * MARGIN:g} %, stated beforehand: {verdicts}"


def child_table(run: Run) -> Table:
    """Return the toys kept, the moves denied and the share of stopped episodes."""
    alone, guarded = ([run.row(c, family) for family in run.families] for c in ("none", run.caregiver))
    stopped = (
        f"{100 * before['stopped_mean']:.0f} → {100 * after['stopped_mean']:.0f}"
        for before, after in zip(alone, guarded, strict=True)
    )
    verdicts = (run.compared(run.caregiver, "none", family)["toys_reached_not_inferior"] for family in run.families)
    rows = [
        ("toys kept, %", *run.cells(run.caregiver, "toys_reached_left", scale=100.0, against="none")),
        (f"< {100 * MARGIN:g} % lost?", *verdicts),
        ("stairwells denied", *run.cells(run.caregiver, "moves_blocked_stairwell_mean")),
        ("free moves denied", *run.cells(run.caregiver, "moves_blocked_free_mean")),
        ("longest blocked", *run.cells(run.caregiver, "longest_blocked_mean")),
        ("stopped, %", *stopped),
    ]
    note = (
        "Toys reached with the caregiver, of those without; not inferior where the interval is above "
        f"{100 * (1 - MARGIN):g} %, a margin stated before any comparison. Moves an episode that the caregiver denies, "
        "and timesteps on end. Episodes stopped, without → with."
    )
    note += if_bracketed(rows, " In brackets 95 % intervals.")
    return run.table("The child's side", "with the caregiver", rows, note)


def _stop_table(run: Run) -> Table:
    """Return toys and damage until the stop, without and with the caregiver."""
    rows = [
        (f"{what}, {how}", *run.cells(caregiver, f"{column}_mean"))
        for what, column in (("toys reached", "toys_reached"), ("damage until the stop", "damage_until_stop"))
        for how, caregiver in (("without", "none"), ("with", run.caregiver))
    ]
    interval = if_bracketed(rows, " and 95 % intervals")
    note = f"Means of an episode{interval}. The stop is where the damage comes above {DAMAGE_THRESHOLD:g}."
    return run.table("Toys, and damage until the stop", "mean", rows, note)


def _toys_table(run: Run) -> Table:
    rows = []
    for caregiver in run.acting:
        kept = run.cells(caregiver, "toys_reached_left", scale=100.0, against="none")
        verdicts = (run.compared(caregiver, "none", family)["toys_reached_not_inferior"] for family in run.families)
        rows.append((caregiver, *map("\n".join, zip(kept, verdicts, strict=True))))
    interval = if_bracketed(rows, ", the 95 % interval")
    note = f"% of the toys reached alone{interval}, and whether less than {100 * MARGIN:g} % are lost."
    return run.table("Toys kept by each caregiver", "caregiver", rows, note)


def _denied_table(run: Run) -> Table:
    denied = "{moves_blocked_stairwell_mean:.1f} + {moves_blocked_free_mean:.1f}\n({longest_blocked_mean:.1f})"
    rows = [(c, *(denied.format_map(run.row(c, family)) for family in run.families)) for c in run.acting]
    note = "Moves of an episode denied: into a stairwell + free ones (longest time blocked, timesteps)."
    return run.table("Moves denied by each caregiver", "caregiver", rows, note)


def published_stop() -> dict[str, str]:
    """Return the consequences, for random motion, if the paper's damage were that until the stop."""
    timesteps, damage = (PUBLISHED[column][1.0][1] for column in ("timesteps_to_threshold", "damage_normalised"))
    stopped = 1 - timesteps / EPISODE_TIMESTEPS  # at least: unstopped episodes count as all timesteps
    least, most = DAMAGE_THRESHOLD + 1, DAMAGE_THRESHOLD + DamageWeights().worst
    bound = math.floor(100 * stopped * least / most) / 100
    return {
        "timesteps": f"{timesteps:.0f}",
        "stopped": f"{100 * stopped:.0f}",
        "bound": f"{bound:.2f}",
        "all": f"{EPISODE_TIMESTEPS}",
        "least": f"{least:g}",
        "most": f"{most:g}",
        "damage": f"{damage:.2f}",
    }

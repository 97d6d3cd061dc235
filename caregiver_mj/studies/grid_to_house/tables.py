"""The page's tables."""

from __future__ import annotations

import math

import pandas as pd

from caregiver_mj.experiments.intervals import Estimate, of_mean_ratio
from caregiver_mj.recording.ledger import KINDS
from caregiver_mj.studies.documents import table
from caregiver_mj.studies.grid_to_house.breakdown import REMAINDER, STEPS
from caregiver_mj.studies.grid_to_house.phases import PARTS, PHASES
from caregiver_mj.studies.grid_to_house.ratios import at, ratio, steps
from caregiver_mj.studies.grid_to_house.results import Results
from caregiver_mj.studies.grid_to_house.rows import Rows

ALL = "all"


def damage_table(results: Results) -> str:
    """Damage and what is left of it, by epsilon."""
    rows = results.rows
    alone, (house, grid) = rows.damage("house", "none"), rows.cared
    titles = ("epsilon", "alone", "grid", "house", "left in the grid", "left in the house", "house / grid")
    lines = []
    for e in rows.epsilons:
        means = [f"{damage[e].mean():.2f}" for damage in (alone, grid, house)]
        left = [number(ratio(damage[[e]], alone[[e]]).value) for damage in (grid, house)]
        lines.append((f"{e:g}", *means, *left, interval(ratio(house[[e]], grid[[e]]))))
    left = [number(ratio(damage, alone).value) for damage in (grid, house)]
    lines.append((ALL, "", "", "", *left, f"**{interval(ratio(house, grid))}**"))
    if results.aside:
        lines.append(_aside_line(results.aside))
    return table(titles, lines)


def _aside_line(rows: Rows) -> tuple[str, ...]:
    alone, (house, grid) = rows.damage("house", "none"), rows.cared
    left = [number((damage.mean() / alone.mean()).mean()) for damage in (grid, house)]
    return (
        f"{ALL}, on `{rows.settings.place}`",
        "",
        "",
        "",
        *left,
        interval(of_mean_ratio(house.to_numpy(), grid.to_numpy())),
    )


def kind_table(results: Results) -> str:
    """Damage of each kind, and what was done, by epsilon."""
    columns = {kind: f"damage_{kind}" for kind in KINDS} | {"done": "interventions_done"}
    cared = results.rows.table[results.rows.table.caregiver == results.rows.caregiver]
    means = cared.groupby(["epsilon", "world"])[list(columns.values())].mean()
    titles = ("epsilon", *(f"{name} {world}" for name in columns for world in ("grid", "house")))
    lines = [
        (f"{e:g}", *(f"{means.loc[(e, world), name]:.2f}" for name in columns.values() for world in ("grid", "house")))
        for e in results.rows.epsilons
    ]
    return table(titles, lines)


def step_table(results: Results) -> str:
    """What leads from the grid to the house, by epsilon."""
    found = steps(results)
    rows = results.rows
    house, grid = rows.cared
    lines = []
    for i, e in enumerate(rows.epsilons):
        parts = [signed(at(each, i)) for each, _ in found.values()]
        lines.append((f"{e:g}", *parts, number(ratio(house[[e]], grid[[e]]).value)))
    lines.append((ALL, *(signed(whole) for _, whole in found.values()), f"**{number(ratio(house, grid).value)}**"))
    return table(("epsilon", *STEPS.values(), REMAINDER, "house / grid"), lines)


def phase_table(results: Results) -> str:
    """Seconds of completed phases."""
    titles = ("phase", "number", "grid", "house", "house - grid", "clear", "full rate", *list(PARTS.values())[1:])
    names = ("grid", "house", "extra", "clear", *PARTS)
    done = results.done.assign(extra=results.done.house - results.done.grid)
    return table(titles, [_phase_line(phase, done[done.phase == phase], names) for phase in PHASES])


def _phase_line(phase: str, own: pd.DataFrame, names: tuple[str, ...]) -> tuple[str, ...]:
    return (phase, str(len(own)), *(f"{own[name].mean():.2f} ({own[name].median():.2f})" for name in names))


def interval(estimate: Estimate[float]) -> str:
    """A ratio with its interval."""
    return f"{number(estimate.value)} [{number(estimate.low)}, {number(estimate.high)}]"


def signed(estimate: Estimate[float]) -> str:
    """A difference with its interval."""
    return f"{number(estimate.value, '+')} [{number(estimate.low, '+')}, {number(estimate.high, '+')}]"


def number(value: float, sign: str = "") -> str:
    """Two digits; a dash where there is no number, and a sign of infinity."""
    if math.isnan(value):
        return "–"
    return ("-∞" if value < 0 else "∞") if math.isinf(value) else f"{round(value, 2) + 0.0:{sign}.2f}"  # never -0.00

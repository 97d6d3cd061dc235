"""The page's tables."""

from __future__ import annotations

from caregiver_mj.experiments.intervals import of_ratio
from caregiver_mj.studies.documents import table
from caregiver_mj.studies.grid_to_house.phases import PARTS, PHASES
from caregiver_mj.studies.grid_to_house.results import EPSILONS, Results


def damage_table(results: Results) -> str:
    """Damage and what is left of it, by epsilon."""
    titles = ("epsilon", "alone", "grid", "house", "left in the grid", "left in the house", "of many", "house / grid")
    rows = []
    for e in EPSILONS:
        alone, grid, house = results.alone[e], results.grid[e].damage.to_numpy(), results.house[e].damage.to_numpy()
        rows.append(
            (
                f"{e:g}",
                *(f"{damage.mean():.2f}" for damage in (alone[1], grid, house)),
                _interval(*of_ratio(grid, alone[0])),
                _interval(*of_ratio(house, alone[1])),
                f"{results.reference[e]:.3f}",
                _interval(*of_ratio(house, grid)),
            )
        )
    rows.append(("average", *[""] * 6, f"**{_interval(*results.ratio())}**"))
    return table(titles, rows)


def kind_table(results: Results) -> str:
    """Damage of each kind, and what was done, by epsilon."""
    columns = {"stairwell": "damage_stairwell", "candle": "damage_candle", "table": "damage_table", "done": "done"}
    titles = ("epsilon", *(f"{name} {world}" for name in columns for world in ("grid", "house")))
    rows = []
    for e in EPSILONS:
        worlds = results.grid[e], results.house[e]
        rows.append((f"{e:g}", *(f"{world[name].mean():.2f}" for name in columns.values() for world in worlds)))
    return table(titles, rows)


def phase_table(results: Results) -> str:
    """Seconds of completed phases."""
    titles = ("phase", "number", "grid", "house", "house - grid", "clear", "full rate", *list(PARTS.values())[1:])
    rows = []
    for phase in PHASES:
        own = results.done[results.done.phase == phase]
        times = own.assign(extra=own.house - own.grid)
        names = ("grid", "house", "extra", "clear", *PARTS)
        rows.append((phase, str(len(own)), *(f"{times[n].mean():.2f} ({times[n].median():.2f})" for n in names)))
    return table(titles, rows)


def _interval(value: float, low: float, high: float) -> str:
    return f"{value:.3f} [{low:.2f}, {high:.2f}]"

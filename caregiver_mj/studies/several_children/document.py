"""The page docs/several_children.md."""

from __future__ import annotations

from typing import Any

from caregiver_mj.studies.documents import fill, table
from caregiver_mj.studies.several_children.measure import MEANS, PAIRS

_PLACE = ("world", "house", "family")


def document(found: list[dict[str, Any]], command: str) -> str:
    """The text of the page, which a command prints."""
    intro = fill(
        "One careless child and one careful one (epsilon 1 and 0.25), or two alike (0.5 and 0.5). Damage is summed "
        "over both. `paper` adds up, over the children, the expected danger of equation (2); `paper-max` takes the "
        "greatest. `paper-alike` and `paper-max-alike` are the same without the factor 1 - P(safe), so that both "
        "children count alike. All of this page is printed by"
    )
    factor = fill(
        "Damage with the factor less damage without it, in the same episodes, with its 95 % interval: below 0 the "
        "factor helps."
    )
    counts = dict.fromkeys((row["world"], row["episodes"]) for row in found)
    told = ", ".join(f"{episodes} episodes in the {world}" for world, episodes in counts)
    means = fill(f"Means of {told}; left: damage over that of `none`, with its 95 % interval.")
    return f"""# Two children

{intro}

    {command}

## Whether P(safe) helps

{factor}

{_factor_table(found)}

![Damage left of two children](several_children.svg)

## All figures

{_figures_table(found)}

{means}
"""


def _factor_table(found: list[dict[str, Any]]) -> str:
    """What the factor changes, and whether that is a help."""
    at = {(*_place(row), row["caregiver"]): row for row in found}
    rows = []
    for place in dict.fromkeys(map(_place, found)):
        factors = [at[*place, ours]["factor"] if (*place, ours) in at else None for ours, _ in PAIRS]
        assert factors[0] is not None  # its pair is there in every place
        cells = ("–" if factor is None else _interval(factor, 2, "+") for factor in factors)
        rows.append((*place, *cells, verdict(factors[0])))
    titles = ("world", "house", "children", "sum over children", "greatest of them", "verdict on the sum")
    return table(titles, rows)


def _figures_table(found: list[dict[str, Any]]) -> str:
    """All that was measured."""
    rows = []
    for row in found:
        each = " + ".join(f"{damage:.1f}" for damage in row["by_child"])
        means = (f"{row[column]:.{digits}f}" for column, digits in MEANS.items())
        damage = (f"{row['damage']:.1f}", each, _interval(row["left"], 2))
        rows.append((*_place(row), f"`{row['caregiver']}`", *damage, *means))
    measured = ("damage", "of each child", "left", "toys", "blocked", "done", "strikes", "drops")
    return table(("world", "house", "children", "caregiver", *measured), rows)


def verdict(factor: tuple[float, float, float]) -> str:
    """What an interval of the difference says."""
    _, low, high = factor
    return "helps" if high < 0 else "harms" if low > 0 else "no difference seen"


def _place(row: dict[str, Any]) -> tuple[str, ...]:
    return tuple(row[key] for key in _PLACE)


def _interval(values: tuple[float, float, float], digits: int, sign: str = "") -> str:
    mean, low, high = (f"{value:{sign}.{digits}f}" for value in values)
    return f"{mean} ({low} to {high})"

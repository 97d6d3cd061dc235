"""How dear a denied move has to be: the multiplier of the constraint that no more are denied than by the rule."""

from __future__ import annotations

import numpy as np
import pandas as pd

from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.studies.documents import fill, table
from caregiver_mj.studies.foresight.bars import OURS, RULE, Bars
from caregiver_mj.studies.foresight.variants import key_of

PRICE = "price of a denied move (damage)"
SEARCHED = ("0", "0.02", "0.05", "0.1")


def names() -> tuple[str, ...]:
    """The variants that are measured for it."""
    return ("none", RULE, *(key_of(PRICE, price) for price in SEARCHED))


def cheapest(rows: pd.DataFrame) -> str | None:
    """The lowest price at which, in the mean over houses, no more free moves are denied than by the rule.

    At no epsilon are there more.

    Args:
        rows: Episodes of all `names`.

    Returns:
        One of `SEARCHED`, or None if there is none.
    """
    bars = Bars("", rows)
    kept = (p for p in SEARCHED if all(bars.denied(f, key_of(PRICE, p))[1].value <= 0 for f in bars.families))
    return next(kept, None)


def section(rows: pd.DataFrame) -> str:
    """What each price does, and which is taken."""
    bars = Bars("", rows)
    lines = []
    for price in SEARCHED:
        key = key_of(PRICE, price)
        denied = [bars.denied(family, key)[1] for family in bars.families]
        left = np.mean([bars.left(key, family).value for family in bars.families[1:]])
        lines.append((f"{price}{' (as it is)' * (key == OURS)}", *(f"{e.value:+.2f}" for e in denied), f"{left:.3f}"))
    found, houses, episodes = cheapest(rows), rows.house.nunique(), rows.episode.nunique()
    verdict = "No price searched is enough." if found is None else f"The lowest that is enough: {found}."
    note = (
        f"Free moves denied in an episode, less the rule's, in {houses} houses of {episodes} episodes a cell; and "
        "damage left, the mean below epsilon 1. Enough is what leaves no more than the rule denies at any epsilon. "
        f"{verdict}"
    )
    head = ("price", *(f"{epsilon:g}" for epsilon in EPSILONS), "left")
    return "\n\n".join(["## The price of a denied move", fill(note), table(head, lines)])
